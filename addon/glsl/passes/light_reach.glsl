/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a shadow ray needs to know of each pixel: xyz the way from the surface to the light's
 * point (metres; a sun's is a direction), w the side that is lit: 1 the viewer's, -1 the other,
 * 0 none, where the light doesn't reach or its filters let nothing through. */
void main()
{
  reach = vec4(0.0);
  ivec2 texel = surface_texel(reached.stride);
  vec4 position = texelFetch(surface_position, texel, 0);
  if (position.w <= 0.0) {
    return;
  }
  Incidence lit = incidence(position.xyz);
  if (lit.strength <= 0.0) {
    return;
  }
#ifdef HAS_FILTERS
  if (light_filters(position.xyz) == vec3(0.0)) {
    return;
  }
#endif
  float NgoL = dot(texelFetch(surface_geometric_normal, texel, 0).xyz, lit.L);
#ifndef HAS_TRANSLUCENT
  if (NgoL < 0.0) {
    return;
  }
#endif
  reach = vec4(way_to_light(position.xyz), sign(NgoL));
}
