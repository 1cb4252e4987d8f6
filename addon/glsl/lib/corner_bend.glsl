/* SPDX-License-Identifier: GPL-3.0-or-later
 * By how much the normals that corner_normal.glsl gives turn within a part of a triangle, given as a
 * Gaussian about p with standard deviations along `u` and `v` on the triangle, metres.
 *
 * What lies beyond the triangle does not count: evenly covered, it has a variance of its own, and
 * the part that is seen of it is the product of both as Gaussians, so that of a triangle smaller than
 * the part all is seen, and no more. */

/* An evenly covered triangle's variance is 1/18 of one corner's share and -1/36 of two: its
 * Cholesky factor, and the inverse of that. */
const mat2 SHARE_DEVIATION = mat2(0.23570226, -0.11785113, 0.0, 0.20412415);
const mat2 IN_DEVIATIONS = mat2(4.2426407, 2.4494897, 0.0, 4.8989795);

/* Of a part that reaches beyond so many of these all of the triangle is seen, but for a thousandth. */
const float FARTHEST = 30.0;

vec2 in_deviations(vec3 to_b, vec3 to_c, vec3 way)
{
  vec2 share = IN_DEVIATIONS * vec2(dot(to_b, way), dot(to_c, way));
  return share * min(FARTHEST / max(max(abs(share.x), abs(share.y)), 1e-30), 1.0);
}

/* xyz is the direction in which normals vary most, as long as their standard deviation there, and w
 * that across it. frame_across and ellipse are needed. */
vec4 corner_bend(SeenCorners of, vec3 p, vec3 u, vec3 v)
{
  vec4 to_b = of.to_b;
  vec4 to_c = of.to_c;
  vec3 A = of.A;
  vec3 B = of.B;
  vec3 C = of.C;
  vec2 share = max(vec2(dot(to_b.xyz, p) + to_b.w, dot(to_c.xyz, p) + to_c.w), vec2(0.0));
  share /= max(share.x + share.y, 1.0);
  vec3 N = (1.0 - share.x - share.y) * A + share.x * B + share.y * C;
  float size_sq = dot(N, N);
  if (size_sq <= 0.0) {
    return vec4(0.0);
  }
  vec2 along = in_deviations(to_b.xyz, to_c.xyz, u);
  vec2 across = in_deviations(to_b.xyz, to_c.xyz, v);
  vec2 axis;
  vec2 part = ellipse(outerProduct(along, along) + outerProduct(across, across), axis);
  part = sqrt(part / (1.0 + part));
  mat2 seen = SHARE_DEVIATION * mat2(part.x * axis, part.y * vec2(-axis.y, axis.x));
  N *= inversesqrt(size_sq);
  mat2x3 frame = frame_across(N);
  mat2 turn = mat2((B - A) * frame, (C - A) * frame) * seen;
  vec2 variance = ellipse(turn * transpose(turn), axis) / size_sq;
  return vec4(sqrt(variance.x) * (frame * axis), sqrt(variance.y));
}
