/* SPDX-License-Identifier: GPL-3.0-or-later
 * One triangle that covers the whole picture. */
void main()
{
  gl_Position = vec4(corner, 0.0, 1.0);
}
