/* SPDX-License-Identifier: GPL-3.0-or-later
 * The vertex stage of every pass that rasterizes the scene. */
void main()
{
#ifdef HAS_INSTANCES
  int drawn = raster.first_drawn + gl_InstanceID;
  surface_instance = int(texelFetch(drawn_instances, row_texel(drawn), 0).r);
  vec3 place = instance_point(surface_instance, position);
#else
  vec3 place = position;
#endif
#ifdef HAS_TRIANGLES
  /* Triangles share no vertices, so a vertex tells its triangle. gl_PrimitiveID would too, but
   * Blender's Metal back end has it only for shaders that Python cannot describe. */
  surface_triangle = raster.first_triangle + gl_VertexID / 3;
#endif
#ifdef HAS_POSES
#  ifdef HAS_INSTANCES
  int object = int(instance_object(surface_instance)) - 1;
#  else
  int object = int(texelFetch(triangle_ids, row_texel(surface_triangle), 0).g) - 1;
#  endif
  place = moved_point(object, place);
#endif
  local_position = place;
#if defined(HAS_CUTOUT) || defined(HAS_SHEER)
  surface_uv = uv;
#endif
  gl_Position = raster.clip_from_local * vec4(place, 1.0);
}
