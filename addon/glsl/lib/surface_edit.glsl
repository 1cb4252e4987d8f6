/* SPDX-License-Identifier: GPL-3.0-or-later
 * What an artist changes about a surface while it is relit: addon/scene/surface_edit.py says what
 * each number means. The rows are those of addon/corrmap/surface_edit_table.py. */

struct SurfaceEdit {
  vec3 color;    /* factor on colours */
  vec3 specular; /* factor on gloss */
  float roughness_factor;
  float roughness_offset;
  float emission;
};

/* That one edit takes in the table. */
const int EDIT_ROWS = 3;

/* Schlick's weight where a metal's edge tint is given: (6/7)^5; Kutz et al. 2021. */
const float WEIGHT_AT_82 = 0.46266436;

/* Reflectances that agree up to 8 bits are the same; see packing.py. */
const float SAME_REFLECTANCE = 1.0 / 256.0;

SurfaceEdit read_edit(int column, int row)
{
  vec4 color = material_value(column, row);
  vec4 specular = material_value(column, row + 1);
  vec4 rest = material_value(column, row + 2);
  return SurfaceEdit(color.rgb, specular.rgb, rest.x, rest.y, rest.z);
}

/* One after the other. */
SurfaceEdit joined(SurfaceEdit a, SurfaceEdit b)
{
  return SurfaceEdit(a.color * b.color,
                     a.specular * b.specular,
                     a.roughness_factor * b.roughness_factor,
                     a.roughness_offset * b.roughness_factor + b.roughness_offset,
                     a.emission * b.emission);
}

float largest(vec3 v)
{
  return max(max(v.x, v.y), v.z);
}

float edited_roughness(float roughness, SurfaceEdit edit)
{
  return clamp(roughness * edit.roughness_factor + edit.roughness_offset, 0.0, 1.0);
}

/* A lobe's reflectance is that of its dielectric, which `dielectric` and `layer` tell, and the
 * rest: a metal, which goes up to its weight toward grazing incidence, or a glossy reflection,
 * which has one reflectance for all angles. A metal that is wholly white is both at the front, and
 * is taken for the glossy one. Where a metal and a tinted dielectric are one lobe, the dielectric
 * is taken for grey. */
void edit_specular(inout Lobe lobe, SurfaceEdit edit)
{
  float strongest = largest(edit.specular);
  float layer90 = lobe.dielectric * lobe.layer.y;
  vec3 weight90 = min(lobe.f90, vec3(layer90));
  vec3 metal90 = lobe.f90 - weight90;
  vec3 dielectric0 = min(lobe.f0, vec3(lobe.dielectric * lobe.layer.x));
  bool has_metal = largest(metal90) > SAME_REFLECTANCE * layer90;
  if (!has_metal) {
    weight90 = lobe.f90;
    metal90 = vec3(0.0);
    dielectric0 = lobe.f0;
  }
  vec3 metal0 = max(lobe.f0 - dielectric0, vec3(0.0));
  float metal_share = has_metal ? max(lobe.specular_share - layer90, 0.0) : 0.0;
  float dielectric_share = lobe.specular_share - metal_share;

  bvec3 is_glossy = greaterThanEqual(metal0, metal90 * (1.0 - SAME_REFLECTANCE));
  vec3 colored0 = metal0 * edit.color;
  vec3 edited0 = mix(min(colored0, metal90), colored0, is_glossy);
  vec3 edited90 = mix(metal90, metal90 * edit.color, is_glossy);
  /* A metal's dip is so much of what Schlick's reflectance is at 82 degrees. */
  vec3 at_82 = mix(metal0, metal90, WEIGHT_AT_82);
  vec3 dip = lobe.dip * mix(edited0, edited90, WEIGHT_AT_82) / max(at_82, vec3(1e-20));

  float before = largest(dielectric0);
  lobe.f0 = vec3(0.0);
  lobe.f90 = vec3(0.0);
  if (strongest > 0.0) {
    vec3 reflected = dielectric0 * edit.specular;
    float factor = before > 0.0 ? largest(reflected) / before : strongest;
    lobe.layer.x = min(lobe.layer.x * factor, lobe.layer.y);
    lobe.f0 = min(reflected, weight90);
    lobe.f90 = weight90;
  }
  else {
    lobe.layer = vec2(0.0);
    dielectric_share = 0.0;
  }
  lobe.f0 += edited0 * edit.specular;
  lobe.f90 += edited90 * edit.specular;
  lobe.dip = dip * edit.specular;
  lobe.specular_share = dielectric_share + metal_share * strongest;
  lobe.roughness = edited_roughness(lobe.roughness, edit);
}

/* What a coat or a sheen keeps from the lobes under it follows the coat's or sheen's own edit. */
void edit_view_curve(inout Lobe lobe, SurfaceEdit edit)
{
  if (lobe.view_curve > 3.5) {
    lobe.view_slope *= largest(edit.color);
  }
  else if (lobe.view_curve > 2.5) {
    float strongest = largest(edit.specular);
    lobe.view_parameter = min(lobe.view_parameter * strongest, 1.0);
    lobe.view_slope *= strongest > 0.0 ? 1.0 : 0.0;
    lobe.view_roughness = edited_roughness(lobe.view_roughness, edit);
  }
}

void edit_lobe(inout Lobe lobe, SurfaceEdit edit)
{
  lobe.diffuse_color *= edit.color;
  lobe.translucent_color *= edit.color;
  lobe.sheen_color *= edit.color;
#ifdef HAS_SPECULAR
  edit_specular(lobe, edit);
#endif
#ifdef HAS_VIEW_WEIGHT
  edit_view_curve(lobe, edit);
#endif
}

void edit_surface(inout Surface surface, SurfaceEdit edit)
{
  for (int i = 0; i < SURFACE_LOBES; i++) {
    edit_lobe(surface.lobes[i], edit);
  }
  surface.emission *= edit.emission;
}
