/* SPDX-License-Identifier: GPL-3.0-or-later
 * Copies a layer of an array texture: the pages of a cache that got more of them. */
void main()
{
  copied = texelFetch(pages, ivec3(ivec2(gl_FragCoord.xy), page.number), 0);
}
