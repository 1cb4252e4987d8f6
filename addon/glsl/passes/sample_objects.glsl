/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which object each shading sample is on, by its triangle (addon/corrmap/triangle_table.py). */
void main()
{
  ivec2 triangle = ivec2(texelFetch(surface_triangle, ivec2(gl_FragCoord.xy), 0).xy);
  surface_object = 0.0;
  if (triangle.x > 0) {
    surface_object = texelFetch(triangle_ids, ivec2(triangle.y, triangle.x - 1), 0).y;
  }
}
