/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two triangles for each block, in the page's clip space. */
void main()
{
  staged_from = apart;
  gl_Position = vec4(corner, 0.0, 1.0);
}
