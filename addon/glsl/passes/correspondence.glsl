/* SPDX-License-Identifier: GPL-3.0-or-later
 * The best caching camera for each pixel (Kim, Kyung, Lee 2009, equation 5):
 *
 *   k = argmax_i  v_i(p) (n(p) . u_i) / d_i^2
 *
 * extended by the density of texels; see camera_score.glsl. Of cameras that show a point equally
 * well the lowest number is taken, so that the order in which they are tried does not matter. */

/* The best so far: number, u, v, score. */
vec4 best = vec4(-1.0, 0.0, 0.0, 0.0);

float best_score()
{
  return best.w;
}

bool is_better(int camera, float score)
{
  return score > best.w || (score == best.w && float(camera) < best.x);
}

void try_camera(int camera, vec3 p, vec3 n)
{
  vec3 q = camera_from_local(camera, p);
  if (q.z <= 0.0 || max(abs(q.x), abs(q.y)) > q.z * half_extent(camera)) {
    return;
  }
  vec3 n_camera = camera_axes(camera, n);
  float score = camera_score(camera, q, n_camera);
  if (!is_better(camera, score)) {
    return;
  }
  vec2 uv = picture_coordinates(camera, q);
  float size = length(p) + length(q);
  vec4 weight = visible_weights(camera, bilinear_footprint(camera, uv), q, n_camera, size);
  float share = dot(weight, vec4(1.0));
  /* A camera that sees only part of the footprint loses to one that sees it all. */
  score *= share;
  if (share >= VISIBLE_SHARE && is_better(camera, score)) {
    best = vec4(float(camera), uv, score);
  }
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 position = texelFetch(visible_position, pixel, 0);
  correspondence = best;
  if (position.w == 0.0) {
    return;
  }
  vec3 p = position.xyz;
  vec3 n = texelFetch(visible_normal, pixel, 0).xyz;
#ifdef CANDIDATE_LISTS
  search_candidates(pixel, p, n);
#else
  for (int camera = 0; camera < camera_count(); camera++) {
    try_camera(camera, p, n);
  }
#endif
  correspondence = best;
}
