/* SPDX-License-Identifier: GPL-3.0-or-later
 * The axes of a covariance: its greater (x) and its smaller variance (y), and the unit `axis` of the
 * greater one. */
vec2 ellipse(mat2 cov, out vec2 axis)
{
  float middle = 0.5 * (cov[0][0] + cov[1][1]);
  float apart = 0.5 * (cov[0][0] - cov[1][1]);
  float mixed = 0.5 * (cov[0][1] + cov[1][0]);
  float radius = sqrt(apart * apart + mixed * mixed);
  /* Of two forms of the same, the one that does not cancel. */
  axis = apart >= 0.0 ? vec2(radius + apart, mixed) : vec2(mixed, radius - apart);
  float size_sq = dot(axis, axis);
  axis = size_sq > 0.0 ? axis * inversesqrt(size_sq) : vec2(1.0, 0.0);
  return max(vec2(middle + radius, middle - radius), vec2(0.0));
}
