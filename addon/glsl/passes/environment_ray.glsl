/* SPDX-License-Identifier: GPL-3.0-or-later
 * Of each pixel a mirrored direction, and what the world sends along it if nothing is in the way. */

#ifdef HAS_PICTURE
/* Directions of `environment.glsl` per steradian, in a texel's alpha. */
float density_at(vec3 direction, ivec2 size, bool of_suns)
{
  ivec2 at = ivec2(floor(equirect_texel(direction, size) + vec2(0.5)));
  ivec2 inside = ivec2(at.x - size.x * int(floor(float(at.x) / float(size.x))),
                       clamp(at.y, 0, size.y - 1));
#  ifdef HAS_SUNS
  if (of_suns) {
    return texelFetch(world_suns, inside, 0).a;
  }
#  endif
  return rays_block.directions * texelFetch(world_picture, inside, 0).a;
}

#  ifdef HAS_SUNS
vec3 suns_at(vec3 direction)
{
  ivec2 size = textureSize(world_suns, 0);
  vec2 at = equirect_texel(direction, size);
  return EQUIRECT_BILINEAR(world_suns, size, 0, at);
}
#  endif
#endif

/* The world's radiance over how many directions and rays there are per steradian. */
vec3 world_over_density(vec3 L, float rays)
{
#ifdef HAS_PICTURE
  ivec2 size = textureSize(world_picture, 0);
  vec3 seen = picture_at(L) / (density_at(L, size, false) + rays);
#  ifdef HAS_SUNS
  seen += suns_at(L) / (density_at(L, size, true) + rays);
#  endif
  return seen;
#else
  return rays_block.color.rgb / (rays_block.color.w + rays);
#endif
}

uint hashed(uint x)
{
  /* C. Wellons' lowbias32. */
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

/* A number in [0, 1) of a pixel's own. */
float pixel_number(ivec2 pixel, uint salt)
{
  uint bits = hashed(uint(pixel.x) ^ hashed(uint(pixel.y) ^ hashed(salt)));
  return float(bits >> 8) / 16777216.0;
}

void main()
{
  ray = vec4(0.0);
  arriving = vec4(0.0);
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  Surface s;
  if (!read_surface(pixel, view.eye, s)) {
    return;
  }
  float chances[SURFACE_LOBES];
  ray_chances(s, chances);
  /* Of a point that all pixels share, turned by the pixel's own numbers. */
  vec3 u = fract(rays_block.point.xyz + vec3(pixel_number(pixel, 1u),
                                             pixel_number(pixel, 2u),
                                             pixel_number(pixel, 3u)));
  int chosen = -1;
  float left = u.z;
  for (int i = 0; i < SURFACE_LOBES; i++) {
    if (chances[i] > 0.0) {
      chosen = i;
      left -= chances[i];
      if (left < 0.0) {
        break;
      }
    }
  }
  if (chosen < 0) {
    return;
  }
  Lobe lobe = s.lobes[chosen];
  vec3 N = specular_normal(lobe.N, s.Ng, s.V);
  float mu = dot(N, s.V);
  vec4 albedo = microfacet_albedo(mu, lobe.roughness);
  float number = rays_block.number * chances[chosen];
  vec3 seen;
  vec3 L;
  if (is_mirror(lobe)) {
    L = reflect(-s.V, N);
    float ratio = layer_ratio(lobe.layer);
    vec3 F = fresnel_mix(lobe, schlick_weight(mu), dielectric_weight(mu, ratio));
    F = max(F - edge_tint(lobe, mu), vec3(0.0));
    /* As many rays as there are leave all other directions behind. */
    seen = F * world_over_density(L, 1e20) * (1e20 / number);
  }
  else {
    L = mirrored_direction(lobe, N, s.V, u.xy);
    if (dot(N, L) <= 0.0) {
      return;
    }
    float rays = number * mirrored_density(lobe, N, s.V, L);
    seen = specular_lobe(lobe, N, s.V, L, 0.0, albedo) * world_over_density(L, rays);
  }
  if (dot(s.Ng, L) <= 0.0) {
    return;
  }
#ifdef HAS_VIEW_WEIGHT
  seen *= view_weight(lobe, s.V);
#endif
  float brightest = max(max(seen.x, seen.y), seen.z);
  if (brightest <= 0.0) {
    return;
  }
  ray = vec4(L, 1.0);
  arriving = vec4(seen, 0.0);
}
