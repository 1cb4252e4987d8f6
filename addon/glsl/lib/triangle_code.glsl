/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where tables hold a triangle, by its code (addon/corrmap/triangle_codes.py). Needs:
 * row_texture.glsl where there are instances. */

ivec2 alone_texel(vec2 code)
{
  return ivec2(int(code.y), int(code.x) - 1);
}

#ifdef HAS_INSTANCES
bool is_instanced(vec2 code)
{
  return code.x < 0.0;
}

int seen_instance(vec2 code)
{
  return -1 - int(code.x);
}

ivec2 mesh_texel(vec2 code)
{
  return row_texel(int(code.y));
}
#endif
