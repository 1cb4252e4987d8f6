/* SPDX-License-Identifier: GPL-3.0-or-later
 * The code of a rasterized fragment's triangle (addon/corrmap/triangle_codes.py): two numbers, each
 * exact in float32 however many triangles there are. */
vec2 surface_code()
{
#ifdef HAS_INSTANCES
  return vec2(float(-1 - surface_instance), float(surface_triangle));
#else
  return vec2(float((surface_triangle >> 12) + 1), float(surface_triangle & 4095));
#endif
}
