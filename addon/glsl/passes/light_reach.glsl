/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a shadow ray needs to know of each pixel: xyz the way from the surface to the light's
 * point (metres; a sun's is a direction), w the side that is lit: 1 the viewer's, -1 the other,
 * 0 none, where the light doesn't reach, or its filters or its linking let nothing through; twice
 * that where the object does not stand in its own light. */
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
  float side = sign(NgoL);
#ifdef HAS_OBJECTS
  vec3 share = object_share(texel);
  if (max(share.x, share.y) <= 0.0) {
    return;
  }
  /* What does not stand in its own light may be lit by its shading normal. */
  if (share.z < 0.5) {
    side *= 2.0;
  }
#endif
#ifndef BOTH_SIDES
  if (side == -1.0) {
    return;
  }
#endif
  reach = vec4(way_to_light(position.xyz), side);
}
