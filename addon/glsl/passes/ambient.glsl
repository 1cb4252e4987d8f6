/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world's light on the surfaces, dimmed by their ambient occlusion. */

#ifdef HAS_PICTURE
vec3 lobe_at(int level, vec3 direction)
{
  ivec2 size = textureSize(world_lobes, 0);
  size.y /= LOBE_COUNT;
  int row = level * size.y;
  vec2 at = equirect_texel(direction, size);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  vec3 bottom = mix(EQUIRECT_TEXEL(world_lobes, size, row, low),
                    EQUIRECT_TEXEL(world_lobes, size, row, low + ivec2(1, 0)),
                    t.x);
  vec3 top = mix(EQUIRECT_TEXEL(world_lobes, size, row, low + ivec2(0, 1)),
                 EQUIRECT_TEXEL(world_lobes, size, row, low + ivec2(1, 1)),
                 t.x);
  return mix(bottom, top, t.y);
}

float lobe_roughness(int level)
{
  return ambient.roughness[level / 4][level % 4];
}

/* What a lobe of this roughness sees around its mirrored direction. */
vec3 reflected_world(vec3 R, float roughness)
{
  if (roughness <= lobe_roughness(0)) {
    return mix(picture_at(R), lobe_at(0, R), roughness / lobe_roughness(0));
  }
  int level = 0;
  while (level < LOBE_COUNT - 2 && roughness > lobe_roughness(level + 1)) {
    level++;
  }
  float low = lobe_roughness(level);
  float t = clamp((roughness - low) / (lobe_roughness(level + 1) - low), 0.0, 1.0);
  return mix(lobe_at(level, R), lobe_at(level + 1, R), t);
}

/* Ramamoorthi and Hanrahan, An Efficient Representation for Irradiance Environment Maps (2001);
 * the constants are in the coefficients. */
vec3 diffuse_world(vec3 N)
{
  vec3 sum = ambient.harmonics[0].rgb + ambient.harmonics[1].rgb * N.y +
             ambient.harmonics[2].rgb * N.z + ambient.harmonics[3].rgb * N.x +
             ambient.harmonics[4].rgb * (N.x * N.y) + ambient.harmonics[5].rgb * (N.y * N.z) +
             ambient.harmonics[6].rgb * (3.0 * N.z * N.z - 1.0) +
             ambient.harmonics[7].rgb * (N.x * N.z) +
             ambient.harmonics[8].rgb * (N.x * N.x - N.y * N.y);
  return max(sum, vec3(0.0)); /* nine harmonics ring below zero opposite to a small sun */
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
    vec3 N = specular_normal(lobe.N, s.Ng, s.V);
    float mu = max(dot(N, s.V), 0.0);
    vec4 albedo = microfacet_albedo(mu, lobe.roughness);
    vec3 diffuse = lobe.diffuse_color * layer_transmission(lobe, mu, albedo);
    vec3 reflectance = specular_albedo(lobe, mu, albedo);
    vec3 R = reflect(-s.V, N);
    vec3 seen = ambient.diffuse_factor * diffuse * diffuse_world(lobe.N);
#ifdef HAS_SHEEN
    /* Of its albedo; where the light comes from is left to the diffuse base's share. */
    seen += ambient.diffuse_factor * lobe.sheen_color *
            (sheen_shape(dot(lobe.N, s.V), lobe.sheen_roughness).x * diffuse_world(lobe.N));
#endif
#ifdef HAS_TRANSLUCENT
    seen += ambient.diffuse_factor * lobe.translucent_color * diffuse_world(-lobe.N);
#endif
    seen += ambient.specular_factor * reflectance * reflected_world(R, lobe.roughness);
#ifdef HAS_VIEW_WEIGHT
    seen *= view_weight(lobe, s.V);
#endif
    sum += seen;
  }
  radiance = vec4(sum * s.ambient_occlusion, 0.0);
}
