/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which triangle each pixel of the view sees; the rest follows from that, once for each pixel. */
void main()
{
  cut_away();
  gl_FragDepth = view_depth();
  visible_triangle = surface_code();
}
