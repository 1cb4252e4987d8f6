/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which caching cameras may show some of what a tile sees, and how well at most. Needs:
 * camera_score.glsl, tile_box.glsl, depth_ranges.glsl. */

/* Whether nothing that a camera holds lies where a box of the view is: `middle` in the camera's
 * axes, with half of its sides in columns. None of its normals faces the camera by a smaller cosine
 * than `facing`; `size` bounds the coordinates that were rounded.
 *
 * A footprint's texels lie within a texel of the point in each direction. One that shows the point's
 * surface is off its plane by less than `same_surface_bound`, so that with z and z_t the depths of
 * point and texel, r and r_t their rays at depth 1, and step a texel's width there,
 *
 *   |z_t - z| |n . r_t| < bound + z |n . (r - r_t)|,
 *   |n . (r - r_t)| <= sqrt(2) step,  |n . r_t| >= facing - sqrt(2) step. */
bool shows_nothing(int camera, vec3 middle, mat3 sides, float facing, float size)
{
  float step = 2.0 * half_extent(camera) / picture_resolution(camera);
  float aside = 1.4143 * step;
  float nearest = middle.z - dot(abs(vec3(sides[0].z, sides[1].z, sides[2].z)), vec3(1.0));
  float farthest = 2.0 * middle.z - nearest;
  if (facing <= 1.01 * aside || nearest <= 0.01 * farthest) {
    return false;
  }
  vec2 low = vec2(ABOVE_SCORES);
  vec2 high = vec2(-ABOVE_SCORES);
  for (int i = 0; i < 8; i++) {
    vec3 corner = middle + ((i & 1) == 0 ? sides[0] : -sides[0]) +
                  ((i & 2) == 0 ? sides[1] : -sides[1]) + ((i & 4) == 0 ? sides[2] : -sides[2]);
    vec2 uv = picture_coordinates(camera, corner);
    low = min(low, uv);
    high = max(high, uv);
  }
  vec2 range = depth_range(camera, clamp(low, 0.0, 1.0), clamp(high, 0.0, 1.0));
  if (range.x > range.y) {
    return true;
  }
  float slack = same_surface_bound(camera, farthest, size) + farthest * aside;
  slack *= 1.01 / (facing - aside);
  return range.y < nearest - slack || range.x > farthest + slack;
}

/* The score that no point of a tile passes with a camera; 0 where the camera shows none of it, or
 * where that is not between `least` and `most`: who asks then wants no more, and what the camera
 * holds, which costs more look-ups, is not asked. */
float tile_score_bound(TileBounds tile, int camera, float least, float most)
{
  vec3 place = camera_place(camera).xyz;
  vec3 middle = 0.5 * (tile.low + tile.high);
  vec3 reach = 0.5 * (tile.high - tile.low);
  vec3 centre = tile.axes[0] * middle.x + tile.axes[1] * middle.y + tile.axes[2] * middle.z;
  float size = length(centre) + 2.0 * length(reach) + length(place - centre);
  reach += POSITION_ROUNDING * size;

  /* The frustum's sides, one for each sign of x and y, and what is behind it: the box is outside
   * where its nearest corner is. */
  vec3 q = camera_from_local(camera, centre);
  vec3 x, y, z;
  mat3 sides;
  for (int i = 0; i < 3; i++) {
    vec3 axis = camera_axes(camera, tile.axes[i]);
    sides[i] = axis * reach[i];
    x[i] = axis.x;
    y[i] = axis.y;
    z[i] = axis.z;
  }
  float extent = half_extent(camera) * (1.0 + BOUND_ROUNDING);
  z *= extent;
  float front = q.z * extent;
  vec4 outside = vec4(q.x, -q.x, q.y, -q.y) - front;
  vec4 corner = vec4(
      dot(abs(x - z), reach), dot(abs(x + z), reach), dot(abs(y - z), reach), dot(abs(y + z), reach));
  if (any(greaterThan(outside, corner)) || front + dot(abs(z), reach) <= 0.0) {
    return 0.0;
  }

  /* From the box to the camera: above it along the first axis, and aside from it. */
  vec3 away = vec3(
      dot(tile.axes[0], place), dot(tile.axes[1], place), dot(tile.axes[2], place)) - middle;
  float above = away.x + reach.x;
  vec3 nearest = max(abs(away) - reach, 0.0);
  float distance_squared = dot(nearest, nearest);
  if (distance_squared <= 0.0) {
    return ABOVE_SCORES;
  }
  /* The greatest cosine between the first axis and a way to the camera. */
  float aside = above > 0.0 ? length(nearest.yz) : length(abs(away.yz) + reach.yz);
  float cosine = above * inversesqrt(above * above + aside * aside);
  cosine = min(cosine + BOUND_ROUNDING, 1.0);
  /* Of a normal that leans from the axis toward the camera. */
  float facing = 1.0;
  if (cosine < tile.cosine) {
    float sines = sqrt((1.0 - cosine * cosine) * (1.0 - tile.cosine * tile.cosine));
    facing = cosine * tile.cosine + sines + BOUND_ROUNDING;
  }
  if (facing <= 0.0) {
    return 0.0;
  }
  float bound = camera_score_bound(camera, distance_squared, facing);
  bound = min(bound * (1.0 + 4.0 * BOUND_ROUNDING), ABOVE_SCORES);
  if (!(bound > least) || bound > most) {
    return 0.0;
  }
  /* The least cosine, of a normal that leans away. */
  float below = away.x - reach.x;
  float least_facing = 0.0;
  if (below > 0.0 && tile.cosine > 0.0) {
    vec2 farthest = abs(away.yz) + reach.yz;
    float lowest = below * inversesqrt(below * below + dot(farthest, farthest));
    float sines = sqrt(max(1.0 - lowest * lowest, 0.0) * (1.0 - tile.cosine * tile.cosine));
    least_facing = lowest * tile.cosine - sines - BOUND_ROUNDING;
  }
  return shows_nothing(camera, q, sides, least_facing, size) ? 0.0 : bound;
}
