/* SPDX-License-Identifier: GPL-3.0-or-later
 * A traced shadow (addon/relight/shadows/traced_shadow.py): which spots of the light each pixel sees,
 * a bit each, and which side of the surface is lit. */

const float SIDE_IS_KNOWN = 65536.0;

float traced_here()
{
  return texelFetch(traced_spots, ivec2(gl_FragCoord.xy), 0).r;
}

int open_spots()
{
  float here = abs(traced_here());
  return int(here >= SIDE_IS_KNOWN ? here - SIDE_IS_KNOWN : here);
}

/* Whether the light is on the viewer's side of the surface: near the terminator its interpolated
 * normal says so, not its facet's. */
bool is_before(float NgoL)
{
  float here = traced_here();
  return abs(here) >= SIDE_IS_KNOWN ? here > 0.0 : NgoL > 0.0;
}

#ifdef SHADOW_HAS_TINT
vec3 shadow_tint()
{
  return texelFetch(traced_tint, ivec2(gl_FragCoord.xy), 0).rgb;
}
#endif

float visibility(vec3 position, vec3 Ng)
{
  return float(bitCount(open_spots())) / float(CELL_SPOTS);
}
