/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world's picture by direction, bilinear. Needs: sampler world_picture, equirect.glsl. */
vec3 picture_at(vec3 direction)
{
  ivec2 size = textureSize(world_picture, 0);
  vec2 at = equirect_texel(direction, size);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  vec3 bottom = mix(EQUIRECT_TEXEL(world_picture, size, 0, low),
                    EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(1, 0)),
                    t.x);
  vec3 top = mix(EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(0, 1)),
                 EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(1, 1)),
                 t.x);
  return mix(bottom, top, t.y);
}
