/* SPDX-License-Identifier: GPL-3.0-or-later
 * The surface that each pixel of the view sees, from its triangle: where it is, which way it
 * faces, what it is made of. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 code = texelFetch(visible_triangle, pixel, 0).rg;
  visible_position = vec4(0.0);
  visible_normal = vec4(0.0);
#ifdef HAS_OBJECT_ID
  visible_object = 0.0;
#endif
#ifdef HAS_SHADING_NORMAL
  visible_shading_normal = vec4(0.0);
#endif
#ifdef HAS_BEND
  normal_bend = vec4(0.0);
#endif
  if (code.x == 0.0) {
    return;
  }
  vec4 plane = seen_plane(code);
  vec2 ids = seen_ids(code);
  vec3 o = ray_origin(gl_FragCoord.xy);
  vec3 d = ray_direction(gl_FragCoord.xy);
#ifdef HAS_TRACED_DEPTH
  float rasterized = texelFetch(visible_depth, pixel, 0).r;
#else
  float rasterized = (texelFetch(visible_depth, pixel, 0).r - ray.clip.y) / ray.clip.x;
#endif
#ifdef HAS_POSES
  /* Seen where it is at the time, told where the geometry has it: there it is shaded. */
  int object = int(ids.y) - 1;
  vec4 moved = moved_plane(object, plane);
  vec3 place = reference_point(object, o + plane_depth(o, d, moved, rasterized) * d);
  float away = dot(moved.xyz, d);
#else
  vec3 place = o + plane_depth(o, d, plane, rasterized) * d;
  float away = dot(plane.xyz, d);
#endif
  visible_position = vec4(place, ids.x);
  visible_normal = vec4(away > 0.0 ? -plane.xyz : plane.xyz, 0.0);
#ifdef HAS_OBJECT_ID
  visible_object = ids.y;
#endif
#ifdef HAS_CORNERS
  SeenCorners corners = seen_corners(code);
#endif
#ifdef HAS_SHADING_NORMAL
  vec3 N = corner_normal(corners, place);
  visible_shading_normal = vec4(away > 0.0 ? -N : N, 0.0);
#endif
#ifdef HAS_BEND
  normal_bend = pixel_bend(corners, place);
#endif
}
