/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which pixel of a `SurfaceBuffer` a pass reads. */

/* The texel of the surfaces that a pixel shades: of a coarse layer, the middle of those that the
 * pixel covers. */
ivec2 surface_texel(int stride)
{
  ivec2 texel = ivec2(gl_FragCoord.xy) * stride + ivec2(stride / 2);
  return min(texel, textureSize(surface_position, 0) - 1);
}
