/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world's picture by direction, bilinear. Needs: sampler world_picture, equirect.glsl. */
vec3 picture_at(vec3 direction)
{
  ivec2 size = textureSize(world_picture, 0);
  vec2 at = equirect_texel(direction, size);
  return EQUIRECT_BILINEAR(world_picture, size, 0, at);
}
