/* SPDX-License-Identifier: GPL-3.0-or-later
 * What is known of a rasterized fragment's triangle (addon/corrmap/triangle_table.py). */

/* Its plane: unit normal n, and n . x of each of its points x. */
vec4 surface_plane()
{
  return texelFetch(triangle_plane, ivec2(surface_triangle & 4095, surface_triangle >> 12), 0);
}

#ifdef HAS_POSES
/* 1 + material id, 1 + object id. */
vec2 surface_ids()
{
  return texelFetch(triangle_ids, ivec2(surface_triangle & 4095, surface_triangle >> 12), 0).rg;
}
#endif
