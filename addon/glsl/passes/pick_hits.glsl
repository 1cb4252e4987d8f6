/* SPDX-License-Identifier: GPL-3.0-or-later
 * The hits at some pixels of the view, packed. */
void main()
{
  ivec2 pixel = ivec2(texelFetch(picked_pixel, ivec2(gl_FragCoord.xy), 0).xy);
  picked_position = texelFetch(visible_position, pixel, 0);
  picked_normal = texelFetch(visible_normal, pixel, 0);
  picked_triangle = texelFetch(visible_triangle, pixel, 0).xy;
}
