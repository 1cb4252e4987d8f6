/* SPDX-License-Identifier: GPL-3.0-or-later
 * The vertex stage of every pass that rasterizes the scene. */
void main()
{
  local_position = position;
  surface_normal = geometric_normal;
  surface_material = material_id;
#ifdef HAS_OBJECT_ID
  surface_object = object_id;
#endif
#ifdef HAS_CUTOUT
  surface_uv = uv;
#endif
  gl_Position = raster.clip_from_local * vec4(position, 1.0);
}
