/* SPDX-License-Identifier: GPL-3.0-or-later
 * One light's radiance from the surfaces, added to its layer. */
void main()
{
  radiance = vec4(0.0);
  ivec2 texel = ivec2(gl_FragCoord.xy);
  Surface s;
  if (!read_surface(texel, view.eye, s)) {
    return;
  }
  Incidence lit = incidence(s.position);
  float NoL = dot(s.N, lit.L);
#ifdef HAS_SPECULAR
  vec3 N_specular = specular_normal(s.N, s.Ng, s.V);
  bool dark = NoL <= 0.0 && dot(N_specular, lit.L) <= 0.0;
#else
  bool dark = NoL <= 0.0;
#endif
  if (dark || lit.strength <= 0.0) {
    return;
  }
#ifdef HAS_SHADOW
  if (dot(s.Ng, lit.L) <= 0.0) {
    return; /* the surface shades itself */
  }
  lit.strength *= visibility(s.position, s.Ng);
  if (lit.strength <= 0.0) {
    return;
  }
#endif
  vec3 reflected = s.diffuse_color * (max(NoL, 0.0) / PI);
#ifdef HAS_SPECULAR
  float mu = dot(N_specular, s.V);
  vec4 albedo = microfacet_albedo(mu, s.roughness);
  reflected *= light.diffuse_factor * layer_transmission(s.layer, mu, s.roughness, albedo);
  reflected += light.specular_factor *
               specular_lobe(s, N_specular, lit.L, lit.cell_sq, albedo);
#else
  reflected *= light.diffuse_factor;
#endif
  radiance = vec4(reflected * light.intensity.rgb * lit.strength, 0.0);
}
