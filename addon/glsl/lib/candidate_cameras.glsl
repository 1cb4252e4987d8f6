/* SPDX-License-Identifier: GPL-3.0-or-later
 * The caching cameras that a pixel has to try: those that its tile's lists name, the most promising
 * first, up to the first that cannot be better than what was found; see candidate_cameras.py.
 * Needs: samplers candidates_0 and so on, CANDIDATE_LISTS of them, each with CANDIDATES cameras, and
 * the pass's functions. */

float best_score();
void try_camera(int camera, vec3 p, vec3 n);

/* A list's next three cameras, numbers that are negative behind the last; x is the least upper bound
 * of their scores. */
vec4 three_candidates(ivec2 tile, int i)
{
#if CANDIDATE_LISTS > 1
  if (i >= CANDIDATES) {
    i -= CANDIDATES;
    return texelFetch(candidates_1, ivec2((CANDIDATES / 3) * tile.x + i / 3, tile.y), 0);
  }
#endif
  return texelFetch(candidates_0, ivec2((CANDIDATES / 3) * tile.x + i / 3, tile.y), 0);
}

/* One loop with one place where a camera is tried: where branches are not skipped, as in software,
 * that is run as often as the pixels side by side have cameras to try, and no more. */
void search_candidates(ivec2 pixel, vec3 p, vec3 n)
{
  ivec2 tile = pixel >> TILE_BITS;
  const int listed = CANDIDATE_LISTS * CANDIDATES;
  int count = camera_count();
  /* More cameras than the lists hold may be better still: behind them all are tried. */
  int steps = count > listed ? listed + count : listed;
  for (int i = 0; i < steps; i++) {
    int camera = i - listed;
    if (i < listed) {
      vec4 three = three_candidates(tile, i);
      int k = i % 3;
      camera = int(k == 0 ? three.y : (k == 1 ? three.z : three.w));
      if (camera < 0 || (k == 0 && three.x < best_score())) {
        break;
      }
    }
    try_camera(camera, p, n);
  }
}
