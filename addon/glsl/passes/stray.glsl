/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which pixels' hits are on another surface than their own shading sample. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  bool same = same_surface(texelFetch(sample_position, pixel, 0),
                           texelFetch(sample_normal, pixel, 0).xyz,
                           texelFetch(visible_position, pixel, 0),
                           texelFetch(visible_normal, pixel, 0).xyz);
  stray = same ? 0.0 : 1.0;
}
