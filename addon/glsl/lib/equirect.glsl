/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reads equirectangular pictures in Blender's mapping: u = 1/2 - atan2(y, x) / 2 pi, row 0
 * straight down. `row` is where a picture of `size` texels starts in the texture. */

const float TWO_PI = 6.28318530717958647692;

/* A macro, because a function's parameter can't be a sampler on every back end. */
#define EQUIRECT_TEXEL(picture, size, row, at) \
  texelFetch(picture, \
             ivec2((at).x - (size).x * int(floor(float((at).x) / float((size).x))), \
                   (row) + clamp((at).y, 0, (size).y - 1)), \
             0) \
      .rgb

/* Between the centres of texels, at a place of `equirect_texel`. */
#define EQUIRECT_BILINEAR(picture, size, row, at) \
  mix(mix(EQUIRECT_TEXEL(picture, size, row, ivec2(floor(at))), \
          EQUIRECT_TEXEL(picture, size, row, ivec2(floor(at)) + ivec2(1, 0)), \
          fract((at).x)), \
      mix(EQUIRECT_TEXEL(picture, size, row, ivec2(floor(at)) + ivec2(0, 1)), \
          EQUIRECT_TEXEL(picture, size, row, ivec2(floor(at)) + ivec2(1, 1)), \
          fract((at).x)), \
      fract((at).y))

vec2 equirect_texel(vec3 direction, ivec2 size)
{
  /* Straight up and down have no longitude, and atan(0, 0) no value. */
  bool pole = direction.x == 0.0 && direction.y == 0.0;
  float longitude = pole ? 0.0 : atan(direction.y, direction.x);
  /* Not asin(direction.z), which has few digits left near the poles. */
  float latitude = atan(direction.z, length(direction.xy));
  vec2 uv = vec2(0.5 - longitude / TWO_PI, 0.5 + latitude * 2.0 / TWO_PI);
  return uv * vec2(size) - vec2(0.5);
}
