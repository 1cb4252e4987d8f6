/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world's light on the surfaces, dimmed by their ambient occlusion: all of it in the first
 * picture; in a refined one only what its directions (environment.glsl) start from. */

#ifdef HAS_PICTURE
/* Level 0 is the diffuse one. A level's first and last row look straight down and up. */
vec3 level_at(int level, vec3 direction)
{
  ivec2 size = textureSize(world_levels, 0);
  size.y /= LEVEL_COUNT;
  int row = level * size.y;
  vec2 at = equirect_texel(direction, size - ivec2(0, 1)) + vec2(0.0, 0.5);
  return EQUIRECT_BILINEAR(world_levels, size, row, at);
}

float level_roughness(int level)
{
  return ambient.roughness[(level - 1) / 4][(level - 1) % 4];
}

/* What a lobe of this roughness sees around its mirrored direction. */
vec3 reflected_world(vec3 R, float roughness)
{
  if (roughness <= level_roughness(1)) {
    return mix(picture_at(R), level_at(1, R), roughness / level_roughness(1));
  }
  int level = 1;
  while (level < LEVEL_COUNT - 2 && roughness > level_roughness(level + 1)) {
    level++;
  }
  float low = level_roughness(level);
  float t = clamp((roughness - low) / (level_roughness(level + 1) - low), 0.0, 1.0);
  return mix(level_at(level, R), level_at(level + 1, R), t);
}

vec3 diffuse_world(vec3 N)
{
  return level_at(0, N);
}
#else
vec3 reflected_world(vec3 R, float roughness)
{
  return ambient.color.rgb;
}

vec3 diffuse_world(vec3 N)
{
  return ambient.color.rgb;
}
#endif

void main()
{
  radiance = vec4(0.0);
  Surface s;
  if (!read_surface(surface_texel(view.stride), view.eye, s)) {
    return;
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < SURFACE_LOBES; i++) {
    Lobe lobe = s.lobes[i];
    if (is_black(lobe)) {
      continue;
    }
#ifdef ONLY_LAMBERT
    if (!is_lambert(lobe)) {
      continue;
    }
#endif
    vec3 N = specular_normal(lobe.N, s.Ng, s.V);
    float mu = max(dot(N, s.V), 0.0);
    vec4 albedo = microfacet_albedo(mu, lobe.roughness);
    vec3 diffuse = lobe.diffuse_color * layer_transmission(lobe, mu, albedo);
    vec3 seen = ambient.diffuse_factor * diffuse * diffuse_world(lobe.N);
#ifndef ONLY_LAMBERT
#  ifdef HAS_SHEEN
    /* Of its albedo; where the light comes from is left to the diffuse base's share. */
    seen += ambient.diffuse_factor * lobe.sheen_color *
            (sheen_shape(dot(lobe.N, s.V), lobe.sheen_roughness).x * diffuse_world(lobe.N));
#  endif
#  ifdef HAS_TRANSLUCENT
    seen += ambient.diffuse_factor * lobe.translucent_color * diffuse_world(-lobe.N);
#  endif
    vec3 reflectance = specular_albedo(lobe, mu, albedo);
    vec3 R = reflect(-s.V, N);
    seen += ambient.specular_factor * reflectance * reflected_world(R, lobe.roughness);
#endif
#ifdef HAS_VIEW_WEIGHT
    seen *= view_weight(lobe, s.V);
#endif
    sum += seen;
  }
  radiance = vec4(sum * s.ambient_occlusion, 0.0);
}
