/* SPDX-License-Identifier: GPL-3.0-or-later
 * One light's radiance from the surfaces, added to its layer. */

/* What a lobe sends to the viewer of light from L, on the side that the viewer is on. */
vec3 reflected(Lobe lobe, Surface s, Incidence lit)
{
  vec3 diffuse = light.diffuse_factor * diffuse_base(lobe, s.V, lit.L);
  vec3 over = vec3(0.0);
#ifdef HAS_SHEEN
  over = light.diffuse_factor * sheen(lobe, s.V, lit.L);
#endif
#ifdef HAS_SPECULAR
  vec3 N = specular_normal(lobe.N, s.Ng, s.V);
  float mu = dot(N, s.V);
  vec4 albedo = microfacet_albedo(mu, lobe.roughness);
  diffuse *= layer_transmission(lobe, mu, albedo);
  return over + diffuse +
         light.specular_factor * specular_lobe(lobe, N, s.V, lit.L, lit.cell_sq, albedo);
#else
  return over + diffuse;
#endif
}

void main()
{
  radiance = vec4(0.0);
  Surface s;
  if (!read_surface(ivec2(gl_FragCoord.xy), view.eye, s)) {
    return;
  }
  Incidence lit = incidence(s.position);
  vec3 color = light.intensity.rgb;
#ifdef HAS_FILTERS
  color *= light_filters(s.position);
#endif
  if (lit.strength <= 0.0 || color == vec3(0.0)) {
    return;
  }
  float NgoL = dot(s.Ng, lit.L);
  vec3 sum = vec3(0.0);
  vec3 through = vec3(0.0);
  for (int i = 0; i < SURFACE_LOBES; i++) {
    Lobe lobe = s.lobes[i];
    if (is_black(lobe)) {
      continue;
    }
    float weight = 1.0;
#ifdef HAS_VIEW_WEIGHT
    weight = view_weight(lobe, s.V);
#endif
    sum += weight * reflected(lobe, s, lit);
#ifdef HAS_TRANSLUCENT
    through += (weight * light.diffuse_factor * max(-dot(lobe.N, lit.L), 0.0) / PI) *
               lobe.translucent_color;
#endif
  }
#ifdef HAS_SHADOW
  /* A surface hides the other side's light from this one, but for what comes through. */
  vec3 kept = NgoL > 0.0 ? sum : through;
  if (max(max(kept.x, kept.y), kept.z) <= 0.0 || NgoL == 0.0) {
    return;
  }
  lit.strength *= visibility(s.position, NgoL > 0.0 ? s.Ng : -s.Ng);
#else
  vec3 kept = sum + through;
#endif
  radiance = vec4(kept * color * lit.strength, 0.0);
}
