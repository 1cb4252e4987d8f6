/* SPDX-License-Identifier: GPL-3.0-or-later
 * How well a caching camera shows a point (Kim, Kyung, Lee 2009, equation 5), and what that is at
 * most for all points of a tile. Whoever changes the one changes the other: candidates are left out
 * by it (`candidate_cameras.glsl`). Needs: caching_camera.glsl. */

/* Texels that see a unit solid angle on the axis: cameras of different resolution and field of view
 * compare. */
float texel_density(int camera)
{
  float across = 0.5 * picture_resolution(camera) / half_extent(camera);
  return across * across;
}

/*   (n(p) . u_i) / d_i^2, times the density of texels,
 *
 * of a point at q with the normal n, both in the camera's axes, all of whose footprint is seen.
 * What is seen of it multiplies it, and is at most one. */
float camera_score(int camera, vec3 q, vec3 n)
{
  float distance_squared = dot(q, q);
  float facing = -dot(n, q) * inversesqrt(distance_squared);
  return facing * texel_density(camera) / distance_squared;
}

/* Its upper bound for points no nearer than a distance, of which none faces the camera by a greater
 * cosine. */
float camera_score_bound(int camera, float distance_squared, float facing)
{
  return facing * texel_density(camera) / distance_squared;
}
