/* SPDX-License-Identifier: GPL-3.0-or-later
 * The caching cameras that may show best some of what a tile sees, by their score's upper bound: as
 * many as there is room for, or as follow those of an earlier list. */

const int RANKS = 18;

/* Three cameras, of which none has a greater bound than the first number. */
vec4 three(vec2 first, vec2 second, vec2 third)
{
  return vec4(first.y, first.x, second.x, third.x);
}

void main()
{
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 axis = texelFetch(tile_axis, at, 0);
  vec3 along = texelFetch(tile_along, at, 0).xyz;
  TileBounds tile;
  tile.axes[0] = axis.xyz;
  tile.axes[1] = along;
  tile.axes[2] = cross(axis.xyz, along);
  tile.low = texelFetch(tile_low, at, 0).xyz;
  tile.high = texelFetch(tile_high, at, 0).xyz;
  tile.cosine = axis.w;
  bool seen = all(lessThanEqual(tile.low, tile.high));
  int count = seen ? camera_count() : 0;
#ifdef HAS_EARLIER
  int earlier = int(texelFetch(earlier_last, at, 0).w);
  /* A list with room left names all. */
  count = earlier < 0 ? 0 : count;
  vec2 last = vec2(float(earlier), 0.0);
  if (earlier >= 0) {
    last.y = tile_score_bound(tile, earlier, 0.0, ABOVE_SCORES);
  }
#else
  vec2 last = vec2(-1.0, ABOVE_SCORES);
#endif
  /* (number, bound) from the greatest bound down; of equal ones the lower number first. */
  vec2 ranked[RANKS];
  for (int i = 0; i < RANKS; i++) {
    ranked[i] = vec2(-1.0, 0.0);
  }
  for (int camera = 0; camera < count; camera++) {
    float bound = tile_score_bound(tile, camera, ranked[RANKS - 1].y, last.y);
    vec2 entry = vec2(float(camera), bound);
    bool taken = entry.y > last.y || (entry.y == last.y && entry.x <= last.x);
    if (taken || !(entry.y > ranked[RANKS - 1].y)) {
      continue;
    }
    for (int i = 0; i < RANKS; i++) {
      if (entry.y > ranked[i].y) {
        vec2 lower = ranked[i];
        ranked[i] = entry;
        entry = lower;
      }
    }
  }
  ranks_0 = three(ranked[0], ranked[1], ranked[2]);
  ranks_1 = three(ranked[3], ranked[4], ranked[5]);
  ranks_2 = three(ranked[6], ranked[7], ranked[8]);
  ranks_3 = three(ranked[9], ranked[10], ranked[11]);
  ranks_4 = three(ranked[12], ranked[13], ranked[14]);
  ranks_5 = three(ranked[15], ranked[16], ranked[17]);
}
