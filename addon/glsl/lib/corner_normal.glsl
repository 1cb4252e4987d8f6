/* SPDX-License-Identifier: GPL-3.0-or-later
 * The unit normal that a triangle's corners give one of its points p for shading, as Cycles
 * interpolates it (triangle_smooth_normal); its own where they cancel. */
vec3 corner_normal(SeenCorners of, vec3 p)
{
  vec4 to_b = of.to_b;
  vec4 to_c = of.to_c;
  /* Rasterizers see a triangle up to 1/256 of a pixel beyond its edges. */
  vec2 share = max(vec2(dot(to_b.xyz, p) + to_b.w, dot(to_c.xyz, p) + to_c.w), vec2(0.0));
  share /= max(share.x + share.y, 1.0);
  vec3 N = (1.0 - share.x - share.y) * of.A + share.x * of.B + share.y * of.C;
  float size_sq = dot(N, N);
  return size_sq > 0.0 ? N * inversesqrt(size_sq) : of.own;
}
