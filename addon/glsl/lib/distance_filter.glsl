/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between which distances there is light: addon/relight/filters/distance.py. */

/* smoothstep(low, low + width, x), a step where that has no width: at `low` it is not yet up. */
float distance_edge(float low, float width, float x)
{
  if (x <= low) {
    return 0.0;
  }
  float t = width > 0.0 ? min((x - low) / width, 1.0) : 1.0;
  return t * t * (3.0 - 2.0 * t);
}

vec3 distance_filter(vec3 q)
{
  vec4 range = filters.distance_range; /* near, its edge, far, its edge */
  float r = filters.distance_along_axis > 0.5 ? -q.z : length(q);
  /* From the near end backwards, so that all of it from `near` on is lit. */
  float near = 1.0 - distance_edge(-range.x, range.y, -r);
  return vec3(near * (1.0 - distance_edge(range.z, range.w, r)));
}
