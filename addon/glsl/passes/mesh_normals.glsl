/* SPDX-License-Identifier: GPL-3.0-or-later
 * Normals that the mesh gives, in surfaces whose other values were found elsewhere;
 * `write_mesh_normals` is made by addon/corrmap/surface_layout.py. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  int column = int(texelFetch(surface_position, texel, 0).w + 0.5);
  write_mesh_normals(texel, column, texelFetch(surface_shading_normal, texel, 0).xyz);
}
