/* SPDX-License-Identifier: GPL-3.0-or-later
 * One light's radiance from the surfaces, added to its layer. */

/* What reaches the seen object's diffuse and specular lobes, and whether it stands in its own
 * light. */
#ifdef HAS_OBJECTS
vec3 share;
#  define DIFFUSE_SHARE share.x
#  define SPECULAR_SHARE share.y
#  define STANDS_IN_OWN_LIGHT (share.z > 0.5)
#else
#  define DIFFUSE_SHARE 1.0
#  define SPECULAR_SHARE 1.0
#  define STANDS_IN_OWN_LIGHT true
#endif

#ifdef HAS_EXTENT
/* Fewer samples than that are not to shine for all. */
const float LEAST_SHARE_ABOVE = 0.02;
#endif

/* What a surface sends to the viewer for light.intensity 1, by kind of lobe. */
struct Reflected {
  vec3 diffuse;
  vec3 specular;
  vec3 sheen;
  vec3 translucent;
#ifdef SHADOW_HAS_SPOTS
  vec3 hidden; /* of the specular, what its own part of the light is in shadow of */
#endif
};

Reflected nothing()
{
  Reflected parts;
  parts.diffuse = vec3(0.0);
  parts.specular = vec3(0.0);
  parts.sheen = vec3(0.0);
  parts.translucent = vec3(0.0);
#ifdef SHADOW_HAS_SPOTS
  parts.hidden = vec3(0.0);
#endif
  return parts;
}

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
#  ifdef HAS_EXTENT
  Facets facets = lobe_facets(lobe, N, s.V, s.position);
  vec3 specular = highlight(lobe, facets, s.V, s.position, lit, albedo);
#    ifdef HAS_SHADOW
  specular /= max(share_above(s.position, s.Ng), LEAST_SHARE_ABOVE);
#    endif
#  else
  vec3 specular = lit.strength * specular_lobe(lobe, N, s.V, lit.L, lit.cell_sq, albedo);
#  endif
  specular *= weight * light.specular_factor * SPECULAR_SHARE;
  sum.specular += specular;
#  ifdef SHADOW_HAS_SPOTS
  if (specular != vec3(0.0)) {
    sum.hidden += (1.0 - highlight_open(lobe, facets, s.V, s.position, lit, open_spots())) * specular;
  }
#  endif
#endif
  weight *= light.diffuse_factor * DIFFUSE_SHARE * lit.strength;
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

/* `gleam` arrives in the specular lobe, `arriving` in all others; `from_all_sides` is what the
 * surface sends of light that knows no direction. */
void write(Reflected parts, vec3 arriving, vec3 gleam, vec3 from_all_sides)
{
  const vec3 most = vec3(MOST_RADIANCE);
#ifdef SPLIT_LOBES
  radiance_diffuse = vec4(min(parts.diffuse * arriving + from_all_sides, most), 0.0);
#  ifdef HAS_SPECULAR
  radiance_specular = vec4(min(parts.specular * gleam, most), 0.0);
#  endif
#  ifdef HAS_SHEEN
  radiance_sheen = vec4(min(parts.sheen * arriving, most), 0.0);
#  endif
#  ifdef HAS_TRANSLUCENT
  radiance_translucent = vec4(min(parts.translucent * arriving, most), 0.0);
#  endif
#else
  vec3 specular = parts.specular;
  parts.specular = vec3(0.0);
  vec3 sum = all_lobes(parts) * arriving + specular * gleam + from_all_sides;
  radiance = vec4(min(sum, most), 0.0);
#endif
}

#ifdef HAS_AMBIENT
/* Over PI: what all diffuse lobes send of light from everywhere. */
vec3 flat_albedo(Surface s)
{
  vec3 sum = vec3(0.0);
  for (int i = 0; i < SURFACE_LOBES; i++) {
    vec3 albedo = s.lobes[i].diffuse_color;
#  ifdef HAS_TRANSLUCENT
    albedo += s.lobes[i].translucent_color;
#  endif
#  ifdef HAS_VIEW_WEIGHT
    albedo *= view_weight(s.lobes[i], s.V);
#  endif
    sum += albedo;
  }
  return sum / PI;
}
#endif

void main()
{
  Reflected parts = nothing();
  write(parts, vec3(0.0), vec3(0.0), vec3(0.0));
  Surface s;
  if (!read_surface(surface_texel(view.stride), view.eye, s)) {
    return;
  }
#ifdef HAS_OBJECTS
  share = object_share(surface_texel(view.stride));
  if (max(share.x, share.y) <= 0.0) {
    return;
  }
#endif
#ifdef HAS_BENDS
  normal_bend = texelFetch(surface_bend, surface_texel(view.stride), 0);
#endif
  Incidence lit = incidence(s.position);
  vec3 color = light.intensity.rgb;
  vec3 through = vec3(1.0);
#ifdef HAS_FILTERS
  through = min(light_filters(s.position), vec3(MOST_STRENGTH / max(lit.strength, 1e-20)));
  color *= through;
#endif
#ifdef HAS_EXTENT
  bool is_lit = lit.strength > 0.0 || lit.radiance > 0.0;
#else
  bool is_lit = lit.strength > 0.0;
#endif
  if (!is_lit || through == vec3(0.0)) {
    return;
  }
  vec3 from_all_sides = vec3(0.0);
#ifdef HAS_AMBIENT
  from_all_sides = (light.ambient * DIFFUSE_SHARE * lit.strength) * color * flat_albedo(s);
#endif
  vec3 arriving = color;
  vec3 gleam = arriving;
  for (int i = 0; i < SURFACE_LOBES; i++) {
    if (!is_black(s.lobes[i])) {
      add_lobe(parts, s.lobes[i], s, lit);
    }
  }
#ifdef HAS_SHADOW
  /* A surface hides the other side's light from this one, but for what comes through. */
  float NgoL = dot(s.Ng, lit.L);
  if (is_before(NgoL) && STANDS_IN_OWN_LIGHT) {
    parts.translucent = vec3(0.0);
  }
  else if (STANDS_IN_OWN_LIGHT) {
    vec3 translucent = parts.translucent;
    parts = nothing();
    parts.translucent = translucent;
  }
  float seen = 0.0;
  if (NgoL != 0.0 && all_lobes(parts) != vec3(0.0)) {
    seen = visibility(s.position, NgoL > 0.0 ? s.Ng : -s.Ng);
  }
#  ifdef SHADOW_HAS_TINT
  /* What sheer surfaces let through of what is seen. */
  vec3 tint = shadow_tint();
#  else
  const float tint = 1.0;
#  endif
  gleam *= seen * tint;
#  ifdef SHADOW_HAS_SPOTS
  vec3 shining = (parts.specular - parts.hidden) * (arriving * tint);
#  endif
#  ifdef HAS_SHADOW_FILL
  vec3 fill = light.shadow_fill.rgb * through;
#    ifdef SHADOW_HAS_SPOTS
  if (light.hide_highlights < 0.5) {
    shining = parts.specular * arriving + light.shadow_fill.w * parts.hidden * (fill - arriving);
#      ifdef SHADOW_HAS_TINT
    shining += light.shadow_fill.w * (1.0 - tint) * (parts.specular - parts.hidden) *
               (fill - arriving);
#      endif
  }
#    endif
  arriving = mix(arriving, fill, light.shadow_fill.w * (1.0 - seen * tint));
  if (light.hide_highlights < 0.5) {
    gleam = arriving;
  }
#  else
  arriving = gleam;
#  endif
#  ifdef SHADOW_HAS_SPOTS
  parts.specular = shining;
  gleam = vec3(1.0);
#  endif
#endif
  write(parts, arriving, gleam, from_all_sides);
}
