/* SPDX-License-Identifier: GPL-3.0-or-later
 * Copies blocks of texels to their places in a page. */
void main()
{
  placed = texelFetch(staged, ivec2(gl_FragCoord.xy) + ivec2(staged_from), 0);
}
