/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which triangle each pixel of the view sees; the rest follows from that, once for each pixel. */
void main()
{
  cut_away();
#ifdef EXACT_DEPTH
  vec3 o = ray_origin(gl_FragCoord.xy);
  vec3 d = ray_direction(gl_FragCoord.xy);
  vec4 plane = surface_plane();
#  ifdef HAS_POSES
  plane = moved_plane(int(surface_ids().y) - 1, plane);
#  endif
  float depth = plane_depth(o, d, plane, dot(ray.axis.xyz, local_position - o));
#else
  float depth = dot(ray.axis.xyz, local_position) + ray.clip.w;
#endif
  /* A depth that is proportional to the distance keeps float32's relative precision at any
   * distance; one after a division by w has none left far from the near clip. The far clip is
   * here for the same reason. */
  float share = depth * ray.clip.x + ray.clip.y;
  if (share > 1.0 || (share < 0.0 && ray.clip.z > 0.0)) {
    discard;
  }
  gl_FragDepth = clamp(share, 0.0, 1.0);
  /* Two numbers, each exact in float32 however many triangles there are. */
  visible_triangle = vec2(float((surface_triangle >> 12) + 1), float(surface_triangle & 4095));
}
