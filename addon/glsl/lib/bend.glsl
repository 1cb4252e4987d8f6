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
 *   q = s / sqrt(alpha^2 + 4 variance / (k + u)),  u = |q|^2,
 *
 * is in a lobe of alpha 1. k is 1 for small variances; for great ones, whose sum is a Gaussian, it is
 * 2. All of q's plane is covered once, and no light is lost. Up to a variance of a quarter of alpha's
 * square the density is within 3 % of the true one at any slope; where both are equal, within 15 %.
 *
 * Straight edges of a cell of a light stay straight only with the same growth for all of the cell: that
 * of its slope nearest to the lobe's middle, and the density that the sum has there. Over a wide cell
 * the paper's growth is nearer to the mass. Needs ellipse.glsl. */

/* As normal_bend.glsl has it, of the place that is shaded. */
vec4 normal_bend = vec4(0.0);

/* Variances of less than this share of alpha's square change a highlight by less than the cells of
 * its light do. */
const float LEAST_BEND = 0.005;

/* About this bend and beyond, a sum of its own narrow outline is mostly noise: on a bevel of a fiftieth
 * of a pixel one facet in four is met, and what is seen of a lamp in it is all or nothing. The paper's
 * lobe, with GGX's tail, is seen on all of them. */
const float PAPERS_BEND = 16.0;

/* Of k: for the true density in the middle, which is the integral of t e^-t / (1 + bend t / 2). */
const float MIDDLE_BEND = 4.0;

/* Slopes over alpha beyond this have no light, and squares of more overflow. */
const float STEEPEST = 1e13;

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
float beyond_even(float slope_sq, float bend, float k)
{
  /* The root of u^2 + (k + bend - s^2) u - k s^2, in a form that neither cancels nor overflows. */
  float middle = 0.5 * (slope_sq - k - bend);
  float size = max(abs(middle), sqrt(slope_sq));
  float share = middle / size;
  float root = size * sqrt(share * share + k * slope_sq / size / size);
  return middle > 0.0 ? middle + root : k * slope_sq / (root - middle);
}

/* u for a slope over alpha. */
float beyond(vec2 slope, vec2 bend, float k)
{
  vec2 slope_sq = slope * slope;
  /* As if both axes were bent like the mean, by what each is good for in the middle of the lobe. */
  vec2 middle = slope_sq / (1.0 + bend / k);
  float mean = dot(middle, bend) / max(middle.x + middle.y, 1e-37);
  float u = beyond_even((middle.x + middle.y) * (1.0 + mean / k), mean, k);
  /* And Newton's way to where u is |q|^2. */
  for (int i = 0; i < 2; i++) {
    vec2 inner = 1.0 / (k + u + bend);
    float next = (k + u) * dot(slope_sq, inner);
    float steep = 1.0 - dot(slope_sq * inner, bend * inner);
    u = steep > 1e-3 ? max(u + (next - u) / steep, 0.0) : next;
  }
  return u;
}

/* What bends do to a lobe for one cell of the light. */
struct Growth {
  vec2 grown;   /* by which share of itself alpha's square grows */
  vec2 leaning; /* the normals' own part of a slope */
  float denser; /* how much denser the sum is there than a lobe that is as wide everywhere */
};

/* For a cell's slope over alpha nearest to the lobe's middle, and the variance of its corners'. */
Growth growth(vec2 nearest, float spread, vec2 bend)
{
  nearest = clamp(nearest, vec2(-STEEPEST), vec2(STEEPEST));
  float most = max(bend.x, bend.y);
  float is_wide = spread / (spread + 1.0 + 0.5 * most);
  float k = mix((MIDDLE_BEND + 2.0 * most) / (MIDDLE_BEND + most), 2.0, is_wide);
  float u = beyond(nearest, bend, k);
  vec2 grown = bend / (k + u);
  vec2 leaning = grown / (1.0 + grown);
  float denser = 1.0 / (1.0 - dot(nearest * nearest / (1.0 + grown), leaning) / (k + u));
  float beside = min(most / PAPERS_BEND, 1e4);
  beside *= beside * beside * beside;
  float paper = beside / (1.0 + beside);
  return Growth(mix(grown, 0.5 * bend, paper), leaning, mix(denser, 1.0, max(is_wide, paper)));
}
