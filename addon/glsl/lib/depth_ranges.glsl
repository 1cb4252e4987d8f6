/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between which depths a caching camera has texels in a rectangle of its picture; see
 * depth_ranges.py. Needs: sampler depth_ranges, RANGE_BITS, caching_camera.glsl. */

/* A texel of the pyramid that begins at `first`. */
vec2 depth_range_texel(ivec2 first, int index)
{
  ivec2 inside = ivec2(index & ((1 << RANGE_BITS) - 1), index >> RANGE_BITS);
  return texelFetch(depth_ranges, first + inside, 0).xy;
}

/* The least and the greatest depth of the held texels that footprints in a rectangle of picture
 * coordinates read; the least is the greater where there is none. */
vec2 depth_range(int camera, vec2 low, vec2 high)
{
  vec4 picture = camera_picture(camera);
  /* A footprint begins half a texel before its place; the other half is for roundings. */
  ivec2 last = ivec2(int(picture.w) - 1);
  ivec2 first = clamp(ivec2(floor(low * picture.w - 1.0)), ivec2(0), last) >> BLOCK_BITS;
  ivec2 end = clamp(ivec2(floor(high * picture.w + 1.0)), ivec2(0), last) >> BLOCK_BITS;
  int side = 1;
  while (side < int(picture.y)) {
    side <<= 1;
  }
  ivec2 pyramid = ivec2(int(camera_forward(camera).w) << RANGE_BITS, int(camera_right(camera).w));
  int level = 0;
  while (any(greaterThan(end - first, ivec2(1)))) {
    level += side * side;
    side >>= 1;
    first >>= 1;
    end >>= 1;
  }
  vec2 a = depth_range_texel(pyramid, level + first.y * side + first.x);
  vec2 b = depth_range_texel(pyramid, level + first.y * side + end.x);
  vec2 c = depth_range_texel(pyramid, level + end.y * side + first.x);
  vec2 d = depth_range_texel(pyramid, level + end.y * side + end.x);
  vec2 least = vec2(1.0, 0.0);
  bool any_held = false;
  vec2 cells[4] = vec2[4](a, b, c, d);
  for (int i = 0; i < 4; i++) {
    if (cells[i].y > 0.0) {
      least = any_held ? vec2(min(least.x, cells[i].x), max(least.y, cells[i].y)) : cells[i];
      any_held = true;
    }
  }
  return least;
}
