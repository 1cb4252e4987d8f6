/* SPDX-License-Identifier: GPL-3.0-or-later
 * The six texels that a tile's list was drawn to, side by side: a pass that reads a list then needs
 * one texture for it. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 tile = ivec2(pixel.x / 6, pixel.y);
  int part = pixel.x - 6 * tile.x;
  ranks = part == 0 ? texelFetch(ranks_0, tile, 0) :
          part == 1 ? texelFetch(ranks_1, tile, 0) :
          part == 2 ? texelFetch(ranks_2, tile, 0) :
          part == 3 ? texelFetch(ranks_3, tile, 0) :
          part == 4 ? texelFetch(ranks_4, tile, 0) :
                      texelFetch(ranks_5, tile, 0);
}
