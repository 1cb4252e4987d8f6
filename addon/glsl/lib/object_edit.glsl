/* SPDX-License-Identifier: GPL-3.0-or-later
 * The edits of objects: rows of addon/corrmap/surface_edit_table.py, as many columns wide as the
 * table. */

/* Of the object that a pixel sees. */
SurfaceEdit read_object_edit(ivec2 texel, int row)
{
  int object = int(texelFetch(surface_object, texel, 0).r + 0.5) - 1;
  int width = textureSize(material_table, 0).x;
  return read_edit(object % width, row + EDIT_ROWS * (object / width));
}
