/* SPDX-License-Identifier: GPL-3.0-or-later
 * Whether one shading sample serves two places of the view; addon/corrmap/same_surface.py. */

/* Places as in `visible_position` (w is 1 + material id, 0 for nothing), unit geometric normals. */
bool same_surface(vec4 p, vec3 n, vec4 q, vec3 m)
{
  if (p.w != q.w) {
    return false;
  }
  if (p.w == 0.0) {
    return true;
  }
  vec3 apart = q.xyz - p.xyz;
  float reach = MOST_BEND * length(apart) + PLACE_SPACING * (length(p.xyz) + length(q.xyz));
  return dot(n, m) >= SAME_BEND && abs(dot(n, apart)) <= reach && abs(dot(m, apart)) <= reach;
}
