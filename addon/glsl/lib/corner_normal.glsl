/* SPDX-License-Identifier: GPL-3.0-or-later
 * The unit normal that a triangle's corners give one of its points p for shading, as Cycles
 * interpolates it (triangle_smooth_normal); `flat_normal` where they cancel. `texel` is the
 * triangle's in a CornerNormalTable, whose samplers and octahedral_normal are needed. */
vec3 corner_normal(ivec2 texel, vec3 p, vec3 flat_normal)
{
  vec4 ab = texelFetch(corner_normals_ab, texel, 0);
  vec2 c = texelFetch(corner_normal_c, texel, 0).rg;
  vec4 to_b = texelFetch(corner_share_b, texel, 0);
  vec4 to_c = texelFetch(corner_share_c, texel, 0);
  /* Rasterizers see a triangle up to 1/256 of a pixel beyond its edges. */
  vec2 share = max(vec2(dot(to_b.xyz, p) + to_b.w, dot(to_c.xyz, p) + to_c.w), vec2(0.0));
  share /= max(share.x + share.y, 1.0);
  vec3 N = (1.0 - share.x - share.y) * octahedral_normal(ab.xy) +
           share.x * octahedral_normal(ab.zw) + share.y * octahedral_normal(c);
  float size_sq = dot(N, N);
  return size_sq > 0.0 ? N * inversesqrt(size_sq) : flat_normal;
}
