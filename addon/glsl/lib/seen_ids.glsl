/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a triangle is of, by its code (addon/corrmap/triangle_codes.py). */

/* 1 + material id, 1 + object id. */
vec2 seen_ids(vec2 code)
{
#ifdef HAS_INSTANCES
  if (is_instanced(code)) {
    return vec2(texelFetch(mesh_plane, mesh_texel(code), 0).w, instance_object(seen_instance(code)));
  }
#endif
  return texelFetch(triangle_ids, alone_texel(code), 0).rg;
}
