/* SPDX-License-Identifier: GPL-3.0-or-later
 * The distance from a light's point, or along a sun's rays from the map's plane. */
void main()
{
  cut_away();
  /* Cycles' point and spot lights are disks through their centre that face what they light;
   * a point light's points here fill a ball. What lies inside it hides some of these points
   * and none of that disk: a lamp on a wall would lose half its light. */
  vec3 from_centre = local_position - caster.centre.xyz;
  if (dot(from_centre, from_centre) < caster.centre.w) {
    discard;
  }
  vec3 from_origin = local_position - caster.origin.xyz;
  /* w is 1 for a sun: then the axis holds the rays' direction. */
  float distance_to_light = mix(
      length(from_origin), dot(from_origin, caster.axis.xyz), caster.axis.w);
  /* The distance itself sorts surfaces: a projected depth resolves only what is near, or would
   * clip what touches the light. */
  gl_FragDepth = distance_to_light / caster.far;
  caster_distance = vec4(distance_to_light, 0.0, 0.0, 0.0);
}
