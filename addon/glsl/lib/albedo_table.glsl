/* SPDX-License-Identifier: GPL-3.0-or-later
 * The tables of addon/relight/shading/directional_albedo.py. Nodes lie on 0 and 1 of every axis. */

/* (E, B, unused, E_avg): albedo of the white microfacet lobe, its Schlick-weighted part, and
 * the mean of E over the hemisphere. E - B is the split sum's factor of f0. */
vec4 microfacet_albedo(float mu, float roughness)
{
  ivec2 size = textureSize(microfacet_table, 0);
  vec2 at = clamp(vec2(mu, roughness), vec2(0.0), vec2(1.0)) * vec2(size - ivec2(1));
  ivec2 low = min(ivec2(at), size - ivec2(2));
  vec2 t = at - vec2(low);
  return MIXED_NODES(microfacet_table, low, t);
}

float dielectric_slice(float mu, float roughness, int slice, int nodes)
{
  vec2 at = clamp(vec2(mu, roughness), vec2(0.0), vec2(1.0)) * float(nodes - 1);
  ivec2 low = min(ivec2(at), ivec2(nodes - 2));
  vec2 t = at - vec2(low);
  ivec2 base = low + ivec2(0, slice * nodes);
  return MIXED_NODES(dielectric_table, base, t).r;
}

/* The same as B for the Fresnel curve of a dielectric with this reflectance at normal incidence,
 * rescaled to go from 0 to 1. Slices are even in the fourth root of f0. */
float dielectric_albedo(float mu, float roughness, float f0)
{
  ivec2 size = textureSize(dielectric_table, 0);
  int slices = size.y / size.x;
  float at = sqrt(sqrt(clamp(f0, 0.0, 1.0))) * float(slices - 1);
  int low = min(int(at), slices - 2);
  return mix(dielectric_slice(mu, roughness, low, size.x),
             dielectric_slice(mu, roughness, low + 1, size.x),
             at - float(low));
}
