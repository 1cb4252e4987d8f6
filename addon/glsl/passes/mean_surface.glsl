/* SPDX-License-Identifier: GPL-3.0-or-later
 * The mean of what was gathered at several hits; `write_mean` is made by
 * addon/corrmap/surface_layout.py. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  write_mean(texel, mean.share, texelFetch(surface_geometric_normal, texel, 0).xyz);
}
