/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cycles' microfiber sheen: a linearly transformed cosine (Zeltner, Burley and Chiang, Practical
 * Multiple-Scattering Sheen Using Linearly Transformed Cosines, 2022), with the numbers that
 * tools/measure_sheen.py found. */

/* (R, a, b) of a view's cosine and a roughness. */
vec3 sheen_shape(float mu, float roughness)
{
  ivec2 size = textureSize(sheen_table, 0);
  vec2 at = clamp(vec2(mu, max(roughness, 1e-3)), vec2(0.0), vec2(1.0)) * vec2(size - ivec2(1));
  ivec2 low = min(ivec2(at), size - ivec2(2));
  vec2 t = at - vec2(low);
  vec3 shape = MIXED_NODES(sheen_table, low, t).rgb;
  /* Cycles leaves it out below. */
  return shape.x < 1e-5 || abs(shape.y) < 1e-5 ? vec3(0.0, 1.0, 0.0) : shape;
}

/* Times NoL. */
vec3 sheen(Lobe lobe, vec3 V, vec3 L)
{
  float NoL = dot(lobe.N, L);
  if (NoL <= 0.0) {
    return vec3(0.0);
  }
  float NoV = dot(lobe.N, V);
  vec3 shape = sheen_shape(NoV, lobe.sheen_roughness);
  /* L's share along the view's projection, and across. */
  vec3 T = V - NoV * lobe.N;
  float length_sq = dot(T, T);
  float x = length_sq > 0.0 ? dot(T, L) * inversesqrt(length_sq) : 0.0;
  float y = length_sq > 0.0 ? dot(cross(lobe.N, T), L) * inversesqrt(length_sq) : 0.0;
  float along = shape.y * x + shape.z * NoL;
  float l = along * along + shape.y * shape.y * y * y + NoL * NoL;
  float ratio = shape.y / l;
  return lobe.sheen_color * (shape.x * NoL / PI * ratio * ratio);
}
