/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which caching cameras may show some of what a tile sees, and how well at most. Needs:
 * camera_score.glsl, tile_box.glsl. */

/* The score that no point of a tile passes with a camera; 0 where the camera shows none of it. */
float tile_score_bound(TileBounds tile, int camera)
{
  vec3 place = camera_place(camera).xyz;
  vec3 middle = 0.5 * (tile.low + tile.high);
  vec3 reach = 0.5 * (tile.high - tile.low);
  vec3 centre = tile.axes[0] * middle.x + tile.axes[1] * middle.y + tile.axes[2] * middle.z;
  float rounding = POSITION_ROUNDING * (length(centre) + length(reach) + length(place - centre));
  reach += rounding;

  /* The frustum's sides, one for each sign of x and y, and what is behind it: the box is outside
   * where its nearest corner is. */
  vec3 q = camera_from_local(camera, centre);
  vec3 x, y, z;
  for (int i = 0; i < 3; i++) {
    vec3 axis = camera_axes(camera, tile.axes[i]);
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
  vec3 least = max(abs(away) - reach, 0.0);
  float distance_squared = dot(least, least);
  if (distance_squared <= 0.0) {
    return ABOVE_SCORES;
  }
  /* The greatest cosine between the first axis and a way to the camera. */
  float aside = above > 0.0 ? length(least.yz) : length(abs(away.yz) + reach.yz);
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
  return min(bound * (1.0 + 4.0 * BOUND_ROUNDING), ABOVE_SCORES);
}
