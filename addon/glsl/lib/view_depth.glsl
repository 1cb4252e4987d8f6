/* SPDX-License-Identifier: GPL-3.0-or-later
 * The depth of a rasterized fragment, which is discarded beyond the clips. Needs: pixel_ray.glsl where
 * depths are those of planes. */

#if defined(EXACT_DEPTH) && defined(HAS_POSES)
/* Comes after this one. */
vec2 seen_ids(vec2 code);
#endif

float view_depth()
{
#ifdef EXACT_DEPTH
  vec3 o = ray_origin(gl_FragCoord.xy);
  vec3 d = ray_direction(gl_FragCoord.xy);
  vec4 plane = seen_plane(surface_code());
#  ifdef HAS_POSES
  plane = moved_plane(int(seen_ids(surface_code()).y) - 1, plane);
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
  return clamp(share, 0.0, 1.0);
}
