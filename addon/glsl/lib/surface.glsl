/* SPDX-License-Identifier: GPL-3.0-or-later
 * One pixel of the SurfaceBuffer. */

const float PI = 3.14159265358979323846;

struct Surface {
  vec3 position; /* local, metres */
  vec3 Ng;       /* unit geometric normal, facing the viewer */
  vec3 N;        /* unit shading normal */
  vec3 V;        /* unit, towards the viewer */
  float roughness;
  vec3 diffuse_color;
  vec2 layer; /* f0 and f90 of the dielectric layer over the diffuse lobe */
  vec3 f0;
  vec3 f90;
  float ambient_occlusion;
};

/* `eye` is the camera's local place with w = 1, or the unit direction towards it with w = 0. */
vec3 direction_to_eye(vec4 eye, vec3 position)
{
  return normalize(eye.xyz - position * eye.w);
}

/* False where the pixel sees no surface; `surface` is then neutral. */
bool read_surface(ivec2 texel, vec4 eye, out Surface surface)
{
  vec4 position = texelFetch(surface_position, texel, 0);
  vec4 geometric_normal = texelFetch(surface_geometric_normal, texel, 0);
  vec4 shading = texelFetch(surface_shading, texel, 0);
  vec4 diffuse = texelFetch(surface_diffuse, texel, 0);
  vec4 specular_f0 = texelFetch(surface_specular_f0, texel, 0);
  vec4 specular_f90 = texelFetch(surface_specular_f90, texel, 0);
  surface.position = position.xyz;
  surface.Ng = geometric_normal.xyz;
  surface.N = shading.xyz;
  surface.V = vec3(0.0, 0.0, 1.0);
  surface.roughness = clamp(shading.w, 0.0, 1.0);
  surface.diffuse_color = diffuse.rgb;
  surface.layer = vec2(diffuse.w, specular_f0.w);
  surface.f0 = specular_f0.rgb;
  surface.f90 = specular_f90.rgb;
  surface.ambient_occlusion = specular_f90.w;
  if (position.w <= 0.0) {
    return false;
  }
  surface.V = direction_to_eye(eye, position.xyz);
  return true;
}
