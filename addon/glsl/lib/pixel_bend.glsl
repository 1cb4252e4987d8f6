/* SPDX-License-Identifier: GPL-3.0-or-later
 * By how much the normals for shading turn within what a sample of the view stands for. Needs
 * frame_across.glsl and corner_bend.glsl, and the block `look`. */

/* A part of a pixel is at most so many times as long on a surface that is seen edge-on: nothing is
 * seen of what is farther round. */
const float LONGEST = 20.0;

/* As `corner_bend`, at p on a triangle. */
vec4 pixel_bend(SeenCorners corners, vec3 p)
{
  vec3 n = corners.own;
  vec3 V = look.eye.xyz - p * look.eye.w;
  float deviation = look.deviation * mix(1.0, length(V), look.eye.w);
  V = normalize(V);
  /* As wide as seen, and longer along the view. */
  vec3 side = cross(n, V);
  float sine_sq = dot(side, side);
  side = sine_sq > 1e-12 ? side * inversesqrt(sine_sq) : frame_across(n)[0];
  vec3 along = cross(side, n) / max(abs(dot(n, V)), 1.0 / LONGEST);
  return corner_bend(corners, p, deviation * side, deviation * along);
}
