/* SPDX-License-Identifier: GPL-3.0-or-later
 * One light's radiance from the surfaces, added to its layer. */

/* What a surface sends to the viewer, by kind of lobe. */
struct Reflected {
  vec3 diffuse;
  vec3 specular;
  vec3 sheen;
  vec3 translucent;
};

/* Adds what a lobe sends of light from L: on the side that the viewer is on, and through it. */
void add_lobe(inout Reflected sum, Lobe lobe, Surface s, Incidence lit)
{
  float weight = 1.0;
#ifdef HAS_VIEW_WEIGHT
  weight = view_weight(lobe, s.V);
#endif
  vec3 diffuse = diffuse_base(lobe, s.V, lit.L);
#ifdef HAS_SPECULAR
  vec3 N = specular_normal(lobe.N, s.Ng, s.V);
  float mu = dot(N, s.V);
  vec4 albedo = microfacet_albedo(mu, lobe.roughness);
  diffuse *= layer_transmission(lobe, mu, albedo);
  sum.specular += (weight * light.specular_factor) *
                  specular_lobe(lobe, N, s.V, lit.L, lit.cell_sq, albedo);
#endif
  weight *= light.diffuse_factor;
  sum.diffuse += weight * diffuse;
#ifdef HAS_SHEEN
  sum.sheen += weight * sheen(lobe, s.V, lit.L);
#endif
#ifdef HAS_TRANSLUCENT
  sum.translucent += (weight * max(-dot(lobe.N, lit.L), 0.0) / PI) * lobe.translucent_color;
#endif
}

vec3 all_lobes(Reflected parts)
{
  return parts.diffuse + parts.specular + parts.sheen + parts.translucent;
}

void write(Reflected parts, vec3 arriving)
{
#ifdef SPLIT_LOBES
  radiance_diffuse = vec4(parts.diffuse * arriving, 0.0);
#  ifdef HAS_SPECULAR
  radiance_specular = vec4(parts.specular * arriving, 0.0);
#  endif
#  ifdef HAS_SHEEN
  radiance_sheen = vec4(parts.sheen * arriving, 0.0);
#  endif
#  ifdef HAS_TRANSLUCENT
  radiance_translucent = vec4(parts.translucent * arriving, 0.0);
#  endif
#else
  radiance = vec4(all_lobes(parts) * arriving, 0.0);
#endif
}

void main()
{
  Reflected parts = Reflected(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  write(parts, vec3(0.0));
  Surface s;
  if (!read_surface(surface_texel(view.stride), view.eye, s)) {
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
  for (int i = 0; i < SURFACE_LOBES; i++) {
    if (!is_black(s.lobes[i])) {
      add_lobe(parts, s.lobes[i], s, lit);
    }
  }
#ifdef HAS_SHADOW
  /* A surface hides the other side's light from this one, but for what comes through. */
  float NgoL = dot(s.Ng, lit.L);
  if (NgoL > 0.0) {
    parts.translucent = vec3(0.0);
  }
  else {
    parts = Reflected(vec3(0.0), vec3(0.0), vec3(0.0), parts.translucent);
  }
  if (NgoL == 0.0 || all_lobes(parts) == vec3(0.0)) {
    return;
  }
  lit.strength *= visibility(s.position, NgoL > 0.0 ? s.Ng : -s.Ng);
#endif
  write(parts, color * lit.strength);
}
