/* SPDX-License-Identifier: GPL-3.0-or-later
 * The table of addon/corrmap/material_table.py: a column for each material. */

vec4 material_value(int column, int row)
{
  return texelFetch(material_table, ivec2(column, row), 0);
}
