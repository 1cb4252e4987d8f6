/* SPDX-License-Identifier: GPL-3.0-or-later
 * A traced shadow (addon/relight/shadows/traced_shadow.py): which spots of the light each pixel sees,
 * a bit each. */

int open_spots()
{
  return int(texelFetch(traced_spots, ivec2(gl_FragCoord.xy), 0).r);
}

float visibility(vec3 position, vec3 Ng)
{
  return float(bitCount(open_spots())) / float(CELL_SPOTS);
}
