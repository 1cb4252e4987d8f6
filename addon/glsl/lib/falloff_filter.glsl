/* SPDX-License-Identifier: GPL-3.0-or-later
 * Another falloff than the square's: addon/relight/falloff.py. */

/* As a power of two. With 1 / d^2 at 1e-6 m it is 1e36, which a float still holds. */
const float MOST_FALLOFF = 80.0;

vec3 falloff_filter(vec3 q)
{
  float r = length(q) / filters.falloff_distance;
  float stops = r > 0.0 ? log2(r) : -126.0;
  return vec3(exp2(clamp(filters.falloff_power * stops, -MOST_FALLOFF, MOST_FALLOFF)));
}
