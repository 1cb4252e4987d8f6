/* SPDX-License-Identifier: GPL-3.0-or-later
 * The distance from a light's point, or along a sun's rays from the map's plane. */
void main()
{
  cut_away();
  vec3 from_origin = local_position - caster.origin.xyz;
  /* w is 1 for a sun: then the axis holds the rays' direction. */
  float distance_to_light = mix(
      length(from_origin), dot(from_origin, caster.axis.xyz), caster.axis.w);
  caster_distance = vec4(distance_to_light, 0.0, 0.0, 0.0);
}
