/* SPDX-License-Identifier: GPL-3.0-or-later
 * Uneven light: addon/relight/filters/noise.py. */

vec3 noise_filter(vec3 q)
{
  vec3 at = q;
  if (filters.noise_projected > 0.5) {
#if LIGHT_TYPE == 2
    at = vec3(q.xy, 0.0);
#else
    float r = length(q);
    at = r > 0.0 ? q / r : vec3(0.0);
#endif
  }
  float noise = noise_texture(filters.noise_placing.w * at + filters.noise_placing.xyz,
                              filters.noise_detail,
                              filters.noise_roughness);
  return vec3(max(1.0 + filters.noise_amount * (2.0 * noise - 1.0), 0.0));
}
