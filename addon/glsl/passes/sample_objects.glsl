/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which object each shading sample is on, by its triangle (addon/corrmap/triangle_table.py). */
void main()
{
  vec2 code = texelFetch(surface_triangle, ivec2(gl_FragCoord.xy), 0).xy;
  surface_object = code.x == 0.0 ? 0.0 : seen_ids(code).y;
}
