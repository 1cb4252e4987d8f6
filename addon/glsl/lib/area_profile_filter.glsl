/* SPDX-License-Identifier: GPL-3.0-or-later
 * An area light that emits another colour at each of its places: addon/relight/filters/profile.py.
 * Needs: profile_filter.glsl. */

/* A level of the pyramid, bilinear; `side` texels, the first row at `row`. */
vec3 area_level(vec2 uv, int side, int row)
{
  vec2 at = clamp(uv, 0.0, 1.0) * float(side) - vec2(0.5);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  ivec2 a = clamp(low, ivec2(0), ivec2(side - 1));
  ivec2 b = clamp(low + ivec2(1), ivec2(0), ivec2(side - 1));
  vec3 bottom = mix(texelFetch(profile_over_area, ivec2(a.x, row + a.y), 0).rgb,
                    texelFetch(profile_over_area, ivec2(b.x, row + a.y), 0).rgb,
                    t.x);
  vec3 top = mix(texelFetch(profile_over_area, ivec2(a.x, row + b.y), 0).rgb,
                 texelFetch(profile_over_area, ivec2(b.x, row + b.y), 0).rgb,
                 t.x);
  return mix(bottom, top, t.y);
}

vec3 area_profile_filter(vec3 q)
{
  vec3 sampled = light.place.xyz - filters.light_origin.xyz;
  vec3 s = vec3(dot(filters.light_x.xyz, sampled),
                dot(filters.light_y.xyz, sampled),
                dot(filters.light_z.xyz, sampled));
  vec2 uv = vec2(dot(filters.area_profile_u.xyz, s), dot(filters.area_profile_v.xyz, s)) + vec2(0.5);
  /* The level whose texels are about what one sample stands for; and as samples are not spread
   * evenly, what brings their mean to the picture's. */
  int level = int(filters.area_profile_level + 0.5);
  int side = textureSize(profile_over_area, 0).x;
  int row = 0;
  for (int i = 0; i < level; i++) {
    row += side;
    side /= 2;
  }
  return filters.area_profile_evened.rgb * area_level(uv, side, row) * profile_filter(q);
}
