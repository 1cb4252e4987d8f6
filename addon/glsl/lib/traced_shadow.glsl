/* SPDX-License-Identifier: GPL-3.0-or-later
 * A traced shadow (addon/relight/shadows/traced_shadow.py): whether each pixel sees the light's point. */

float visibility(vec3 position, vec3 Ng)
{
  return texelFetch(traced_visibility, ivec2(gl_FragCoord.xy), 0).r;
}
