/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where a texture holds value n of a long row (addon/glsl/row_texture.py). Needs: ROW_BITS. */
ivec2 row_texel(int n)
{
  return ivec2(n & ((1 << ROW_BITS) - 1), n >> ROW_BITS);
}
