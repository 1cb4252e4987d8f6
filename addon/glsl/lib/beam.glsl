/* SPDX-License-Identifier: GPL-3.0-or-later
 * Places across a light's beam. LIGHT_TYPE 2 is a sun. */

/* Beyond any place that is lit; products with sizes of up to 1e6 m stay finite. */
const float BEAM_END = 1e18;

/* The place across the beam of q (light space): at one metre before the light; of a sun q.xy.
 * False behind the light. */
bool across_beam(vec3 q, out vec2 p)
{
#if LIGHT_TYPE == 2
  p = q.xy;
  return true;
#else
  p = vec2(0.0);
  if (q.z >= 0.0) {
    return false;
  }
  p = clamp(q.xy / -q.z, vec2(-BEAM_END), vec2(BEAM_END));
  return true;
#endif
}
