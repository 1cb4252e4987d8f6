/* SPDX-License-Identifier: GPL-3.0-or-later
 * The vertex stage of every pass that rasterizes the scene. */
void main()
{
  local_position = position;
#ifdef HAS_TRIANGLES
  /* Triangles share no vertices, so a vertex tells its triangle. gl_PrimitiveID would too, but
   * Blender's Metal back end has it only for shaders that Python cannot describe. */
  surface_triangle = raster.first_triangle + gl_VertexID / 3;
#endif
  vec3 place = position;
#ifdef HAS_POSES
  int object = int(texelFetch(
      triangle_ids, ivec2(surface_triangle & 4095, surface_triangle >> 12), 0).g) - 1;
  place = moved_point(object, position);
  local_position = place;
#endif
#ifdef HAS_CUTOUT
  surface_uv = uv;
#endif
  gl_Position = raster.clip_from_local * vec4(place, 1.0);
}
