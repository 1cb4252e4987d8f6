/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world's light from some directions, the same for all pixels, each with its shadow.
 *
 * A Lambert base has its whole irradiance, times the share of the sky that is open, from the
 * ambient pass; here it gets what the directions say beyond that, which is nothing on average
 * where light is hidden evenly (a control variate: M. Pharr, W. Jakob and G. Humphreys,
 * Physically Based Rendering, 2.2.4). Microfacet lobes share the work with rays of their own, by
 * the balance heuristic (E. Veach, Robust Monte Carlo Methods for Light Transport Simulation,
 * 1997, 9.2). */

bool is_from_before(float NgoL)
{
#ifdef ONE_DIRECTION
  return is_before(NgoL);
#else
  return NgoL > 0.0;
#endif
}

float direction_visibility(int d, vec3 position, vec3 Ng)
{
#ifdef ONE_DIRECTION
  return visibility(position, Ng);
#else
  return face_visibility_at(d, position, Ng);
#endif
}

void main()
{
  radiance = vec4(0.0);
#ifdef SHADOW_HAS_TINT
  vec3 tint = shadow_tint();
#else
  const float tint = 1.0;
#endif
  Surface s;
  if (!read_surface(surface_texel(view.stride), view.eye, s)) {
    return;
  }
  /* Above zero: seen by the viewer's side; below: by the other. */
  float open_share[MOST_DIRECTIONS];
  for (int d = 0; d < environment.count; d++) {
    vec3 L = environment.toward[d].xyz;
    float NgoL = dot(s.Ng, L);
    open_share[d] = 0.0;
    if (is_from_before(NgoL)) {
      open_share[d] = direction_visibility(d, s.position, s.Ng);
    }
#ifdef HAS_TRANSLUCENT
    else {
      open_share[d] = -direction_visibility(d, s.position, -s.Ng);
    }
#endif
  }
#ifdef HAS_SPECULAR
  float chances[SURFACE_LOBES];
  if (environment.rays > 0.0) {
    ray_chances(s, chances);
  }
#endif
  float expected = environment.control * s.ambient_occlusion;
  vec3 sum = vec3(0.0);
  for (int i = 0; i < SURFACE_LOBES; i++) {
    Lobe lobe = s.lobes[i];
    if (is_black(lobe)) {
      continue;
    }
    float base_factor = environment.diffuse_factor;
    float expected_here = 0.0;
    if (is_lambert(lobe)) {
      base_factor *= environment.lambert;
      expected_here = expected;
    }
    vec3 of_lobe = vec3(0.0);
    vec3 base = vec3(1.0);
#ifdef HAS_SPECULAR
    vec3 N = specular_normal(lobe.N, s.Ng, s.V);
    float mu = dot(N, s.V);
    vec4 albedo = microfacet_albedo(mu, lobe.roughness);
    base = vec3(layer_transmission(lobe, mu, albedo));
    float ray_density = environment.rays > 0.0 ? environment.rays * chances[i] : 0.0;
#endif
    for (int d = 0; d < environment.count; d++) {
      vec3 L = environment.toward[d].xyz;
      float open = max(open_share[d], 0.0);
      vec3 seen = base_factor * (open * tint - expected_here) * base * diffuse_base(lobe, s.V, L);
#ifdef HAS_SHEEN
      seen += (environment.diffuse_factor * open * tint) * sheen(lobe, s.V, L);
#endif
#ifdef HAS_TRANSLUCENT
      seen += (environment.diffuse_factor * max(-open_share[d], 0.0) * tint *
               max(-dot(lobe.N, L), 0.0) / PI) * lobe.translucent_color;
#endif
#ifdef HAS_SPECULAR
      if (open > 0.0 && mu > 0.0 && dot(N, L) > 0.0) {
        float share = 1.0;
        if (ray_density > 0.0) {
          float density = environment.toward[d].w;
          share = is_mirror(lobe) ? 0.0 :
                                    density / (density + ray_density *
                                               mirrored_density(lobe, N, s.V, L));
        }
        if (share > 0.0) {
          seen += (environment.specular_factor * open * share * tint) *
                  specular_lobe(lobe, N, s.V, L, environment.radiance[d].w, albedo);
        }
      }
#endif
      of_lobe += seen * environment.radiance[d].rgb;
    }
#ifdef HAS_VIEW_WEIGHT
    of_lobe *= view_weight(lobe, s.V);
#endif
    sum += of_lobe;
  }
  radiance = vec4(sum, 0.0);
}
