/* SPDX-License-Identifier: GPL-3.0-or-later
 * Lobes of surfaces whose normals turn within what a sample stands for.
 *
 * What the viewer gets is the mean over these normals: the lobe's slopes and the normals' added up.
 * `surface_bend` says how the normals vary (normal_bend.glsl). Beckmann's lobe is a Gaussian, and so
 * is the sum, with twice the variance added to alpha's square (Y. Tokuyoshi and A. Kaplanyan,
 * "Improved Geometric Specular Antialiasing", 2019). GGX's has no variance: its middle grows wider
 * than that, and its tail, which is all that is seen far from a mirror image, hardly changes.
 *
 * As Gaussians of all widths, GGX(s) is the integral of e^-t alpha^2 / (2 t)-wide ones over t (s in
 * slopes, the width a variance). Those which a slope comes from have t = 2 / (1 + u) on average, where
 * 1 / (1 + u) is the lobe's share beyond that slope: they grow as if alpha's square by 4 / (1 + u)
 * times the variance. So a slope s of the sum is where
 *
 *   q = s / sqrt(alpha^2 + 4 variance / (1 + u)),  u = |q|^2,
 *
 * is in a lobe of alpha 1. All of q's plane is covered once, and no light is lost. With a variance of
 * less than a tenth of alpha's square the share beyond any slope is within 0.002 of the true one; with
 * a far greater one the sum is an even disk of that variance.
 *
 * Straight edges of a cell of a light stay straight only with the same growth for all of the cell: that
 * of its slope nearest to the lobe's middle, and the density that the sum has there. Needs
 * ellipse.glsl. */

/* As normal_bend.glsl has it, of the place that is shaded. */
vec4 normal_bend = vec4(0.0);

/* Variances of less than this share of alpha's square change a highlight by less than the cells of
 * its light do. */
const float LEAST_BEND = 0.005;

/* Where bends are this and more, a sum of their own narrow outline is mostly noise: on a bevel of a
 * fiftieth of a pixel one facet in four is met, and what is seen of a lamp in it is all or nothing.
 * A lobe with GGX's tail is seen on all of them. */
const float MANY_WIDTHS = 16.0;

/* Along two axes, to which the frame is turned and alpha goes over: 4 variances of the normals over
 * alpha's square, or 0. */
vec2 bend_of_lobe(inout mat2x3 across, inout vec2 alpha)
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
  across = across * mat2(axis, other);
  alpha = sqrt(own_sq);
  return 2.0 * max(wide_sq - own_sq, vec2(0.0)) / own_sq;
}

/* u for like bends along both axes. */
float beyond_even(float slope_sq, float bend)
{
  /* The root of u^2 + (1 + bend - s^2) u - s^2, in a form that neither cancels nor overflows. */
  float middle = 0.5 * (slope_sq - 1.0 - bend);
  float size = max(abs(middle), sqrt(slope_sq));
  float share = middle / size;
  float root = size * sqrt(share * share + slope_sq / size / size);
  return middle > 0.0 ? middle + root : slope_sq / (root - middle);
}

/* u for a slope over alpha. */
float beyond(vec2 slope, vec2 bend)
{
  vec2 slope_sq = slope * slope;
  /* As if both axes were bent like the mean, by what each is good for in the middle of the lobe. */
  vec2 middle = slope_sq / (1.0 + bend);
  float mean = dot(middle, bend) / max(middle.x + middle.y, 1e-37);
  float u = beyond_even((middle.x + middle.y) * (1.0 + mean), mean);
  /* And Newton's way to where u is |q|^2. */
  for (int i = 0; i < 2; i++) {
    vec2 inner = 1.0 / (1.0 + u + bend);
    float next = (1.0 + u) * dot(slope_sq, inner);
    float steep = 1.0 - dot(slope_sq * inner, bend * inner);
    u = steep > 1e-3 ? max(u + (next - u) / steep, 0.0) : next;
  }
  return u;
}

/* By which share of itself alpha's square grows at a slope over alpha; how much denser the sum is there
 * than a lobe that is as wide everywhere; and the part of the slope that is the normals' own. */
vec2 growth(vec2 slope, vec2 bend, out float denser, out vec2 bent)
{
  float u = beyond(slope, bend);
  vec2 grown = bend / (1.0 + u);
  bent = grown / (1.0 + grown);
  vec2 q_sq = slope * slope / (1.0 + grown);
  denser = 1.0 / (1.0 - dot(q_sq, grown / (1.0 + grown)) / (1.0 + u));
  /* Beyond many times its width it is the lobe as the paper widens it. */
  float most = max(bend.x, bend.y) / MANY_WIDTHS;
  most *= most * most * most;
  float wide = most / (1.0 + most);
  denser = mix(denser, 1.0, wide);
  return mix(grown, 0.5 * bend, wide);
}
