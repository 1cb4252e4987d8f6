/* SPDX-License-Identifier: GPL-3.0-or-later
 * The code of a rasterized fragment's triangle (addon/corrmap/triangle_codes.py): two numbers, each
 * exact in float32 however many triangles there are. Needs: row_texture.glsl. */
vec2 surface_code()
{
#ifdef HAS_INSTANCES
  return vec2(float(-1 - surface_instance), float(surface_triangle));
#else
  ivec2 texel = row_texel(surface_triangle);
  return vec2(float(texel.y + 1), float(texel.x));
#endif
}
