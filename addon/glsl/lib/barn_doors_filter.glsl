/* SPDX-License-Identifier: GPL-3.0-or-later
 * Barn doors: addon/relight/filters/barn_doors.py. */

vec3 barn_doors_filter(vec3 q)
{
  vec2 p;
  float covered = 0.0;
  if (across_beam(q, p)) {
#if LIGHT_TYPE == 2
    p += filters.barn_doors_placing.xy * q.z;
#else
    p -= filters.barn_doors_placing.xy;
#endif
    vec2 turn = filters.barn_doors_placing.zw; /* cosine and sine */
    p = vec2(turn.x * p.x + turn.y * p.y, turn.x * p.y - turn.y * p.x);
    covered = superellipse(p,
                           filters.barn_doors_outline.xy,
                           filters.barn_doors_outline.zw,
                           filters.barn_doors_roundness);
  }
  float taken = filters.barn_doors_invert > 0.5 ? covered : 1.0 - covered;
  return vec3(1.0 - filters.barn_doors_density * taken);
}
