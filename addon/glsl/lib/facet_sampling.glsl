/* SPDX-License-Identifier: GPL-3.0-or-later
 * Mirrored directions of a microfacet lobe, by the normals that the viewer sees (E. Heitz,
 * Sampling the GGX Distribution of Visible Normals, 2018). GGX's normals serve every distribution:
 * its tails are the longest, so nothing is missed. */

/* The axes along and across the tangent of a lobe about its normal. */
void lobe_axes(Lobe lobe, vec3 N, out vec3 X, out vec3 Y)
{
  vec3 side = abs(N.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
  Y = cross(N, side);
#ifdef HAS_ASPECT
  vec3 across = cross(N, lobe.tangent);
  if (dot(across, across) > 0.0) {
    Y = across;
  }
#endif
  Y = normalize(Y);
  X = cross(Y, N);
}

/* A direction, for u in [0, 1)^2; it may lie below the surface. V is above it. */
vec3 mirrored_direction(Lobe lobe, vec3 N, vec3 V, vec2 u)
{
  float alpha = lobe.roughness * lobe.roughness;
  vec2 axes = vec2(alpha);
#ifdef HAS_ASPECT
  axes = vec2(alpha / lobe.aspect, alpha * lobe.aspect);
#endif
  vec3 X;
  vec3 Y;
  lobe_axes(lobe, N, X, Y);
  vec3 view_local = vec3(dot(V, X), dot(V, Y), dot(V, N));
  vec3 stretched = normalize(vec3(axes * view_local.xy, view_local.z));
  float across_sq = dot(stretched.xy, stretched.xy);
  vec3 T1 = across_sq > 0.0 ? vec3(-stretched.y, stretched.x, 0.0) * inversesqrt(across_sq) :
                              vec3(1.0, 0.0, 0.0);
  vec3 T2 = cross(stretched, T1);
  float r = sqrt(u.x);
  float phi = 2.0 * PI * u.y;
  float t1 = r * cos(phi);
  float t2 = r * sin(phi);
  float s = 0.5 * (1.0 + stretched.z);
  t2 = (1.0 - s) * sqrt(max(1.0 - t1 * t1, 0.0)) + s * t2;
  vec3 facet = t1 * T1 + t2 * T2 + sqrt(max(1.0 - t1 * t1 - t2 * t2, 0.0)) * stretched;
  vec3 local_H = normalize(vec3(axes * facet.xy, max(facet.z, 1e-12)));
  vec3 H = local_H.x * X + local_H.y * Y + local_H.z * N;
  return normalize(2.0 * dot(V, H) * H - V);
}

/* Such directions per steradian (there, eq. 17). V and L are above the surface. */
float mirrored_density(Lobe lobe, vec3 N, vec3 V, vec3 L)
{
  vec3 H = normalize(L + V);
  Alphas a = lobe_alphas(lobe, N, V, L, H);
  float NoV = dot(N, V);
  return a.stretch * D_ggx(N, H, a.half_sq, 0.0) / (4.0 * NoV * (1.0 + lambda_ggx(NoV, a.view_sq)));
}

/* Whether a lobe is a mirror, in which directions from elsewhere are never seen. */
bool is_mirror(Lobe lobe)
{
  float alpha_sq = lobe.roughness * lobe.roughness;
  return alpha_sq * alpha_sq <= MIRROR_ALPHA_SQ;
}

/* How bright a lobe's mirrored picture of a white world is. */
float mirrored_weight(Lobe lobe, vec3 N, vec3 V)
{
  float NoV = dot(N, V);
  if (NoV <= 0.0) {
    return 0.0;
  }
  vec3 albedo = specular_albedo(lobe, NoV, microfacet_albedo(NoV, lobe.roughness));
  float weight = max(max(albedo.x, albedo.y), albedo.z);
#ifdef HAS_VIEW_WEIGHT
  weight *= view_weight(lobe, V);
#endif
  return max(weight, 0.0);
}

/* With what chance a ray is sent for each lobe; their sum is one, or zero. */
void ray_chances(Surface s, out float chances[SURFACE_LOBES])
{
  float sum = 0.0;
  for (int i = 0; i < SURFACE_LOBES; i++) {
    Lobe lobe = s.lobes[i];
    chances[i] = 0.0;
    if (!is_black(lobe)) {
      chances[i] = mirrored_weight(lobe, specular_normal(lobe.N, s.Ng, s.V), s.V);
    }
    sum += chances[i];
  }
  for (int i = 0; i < SURFACE_LOBES; i++) {
    chances[i] = sum > 0.0 ? chances[i] / sum : 0.0;
  }
}
