/* SPDX-License-Identifier: GPL-3.0-or-later
 * Lobes of surfaces whose normals turn within what a sample stands for.
 *
 * What the viewer gets is the mean over these normals, which is as if the facets had slopes of both:
 * Y. Tokuyoshi and A. Kaplanyan, "Improved Geometric Specular Antialiasing" (2019), add twice
 * the variance of slopes to alpha's square. `surface_bend` says how the normals vary
 * (normal_bend.glsl). Needs ellipse.glsl. */

/* As normal_bend.glsl has it, of the place that is shaded. */
vec4 normal_bend = vec4(0.0);

/* Variances of less than this share of alpha's square change a highlight by less than the cells of
 * its light do. */
const float LEAST_BEND = 0.01;

/* Widen a lobe in its frame; the share of each new alpha's square that is the bend's. */
vec2 widen(inout mat2x3 across, inout vec2 alpha)
{
  vec2 own_sq = alpha * alpha;
  if (dot(normal_bend.xyz, normal_bend.xyz) <= LEAST_BEND * min(own_sq.x, own_sq.y)) {
    return vec2(0.0);
  }
  vec2 d = normal_bend.xyz * across;
  vec2 e = vec2(-d.y, d.x) * (normal_bend.w * inversesqrt(max(dot(d, d), 1e-30)));
  mat2 cov = 2.0 * (outerProduct(d, d) + outerProduct(e, e));
  cov[0][0] += own_sq.x;
  cov[1][1] += own_sq.y;
  vec2 axis;
  vec2 wide_sq = ellipse(cov, axis);
  vec2 other = vec2(-axis.y, axis.x);
  own_sq = vec2(dot(axis * axis, own_sq), dot(other * other, own_sq));
  wide_sq = max(wide_sq, own_sq);
  across = across * mat2(axis, other);
  alpha = sqrt(wide_sq);
  return 1.0 - own_sq / wide_sq;
}
