/* SPDX-License-Identifier: GPL-3.0-or-later
 * The caching cameras that a pixel has to try: those that its tile's lists name, the most promising
 * first, up to the first that cannot be better than what was found; see candidate_cameras.py.
 * Needs: samplers candidates_0 and so on, CANDIDATE_LISTS of them, and the pass's functions. */

float best_score();
void try_camera(int camera, vec3 p, vec3 n);
void search_all(vec3 p, vec3 n);

/* Tries three cameras, the least upper bound of whose scores is x; false where neither they nor any
 * that follows can be better. Numbers are negative behind the last camera. */
bool try_three(vec4 three, vec3 p, vec3 n)
{
  if (three.y < 0.0 || three.x < best_score()) {
    return false;
  }
  try_camera(int(three.y), p, n);
  if (three.z >= 0.0) {
    try_camera(int(three.z), p, n);
  }
  if (three.w >= 0.0) {
    try_camera(int(three.w), p, n);
  }
  return three.w >= 0.0;
}

#define SEARCH_LIST(candidates) \
  for (int i = 0; i < 6; i++) { \
    if (!try_three(texelFetch(candidates, ivec2(6 * tile.x + i, tile.y), 0), p, n)) { \
      return; \
    } \
  }

void search_candidates(ivec2 pixel, vec3 p, vec3 n)
{
  ivec2 tile = pixel >> TILE_BITS;
  SEARCH_LIST(candidates_0)
#if CANDIDATE_LISTS > 1
  SEARCH_LIST(candidates_1)
#endif
#if CANDIDATE_LISTS > 2
  SEARCH_LIST(candidates_2)
#endif
  /* More cameras than the lists hold may be better still. */
  search_all(p, n);
}
