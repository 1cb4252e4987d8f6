/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where objects are while the shutter is open (addon/corrmap/pose_table.py): for each, the rows
 * of the transform from the geometry's place to that at the time, and of its inverse. Needs:
 * row_texture.glsl. */

vec4 pose_row(int object, int row)
{
  return texelFetch(pose_table, row_texel(object * 8 + row), 0);
}

vec3 posed(int object, int first_row, vec3 point)
{
  vec4 p = vec4(point, 1.0);
  return vec3(dot(pose_row(object, first_row), p),
              dot(pose_row(object, first_row + 1), p),
              dot(pose_row(object, first_row + 2), p));
}

vec3 moved_point(int object, vec3 point)
{
  return posed(object, 0, point);
}

vec3 reference_point(int object, vec3 point)
{
  return posed(object, 3, point);
}

/* The plane n . x = w of what was moved. */
vec4 moved_plane(int object, vec4 plane)
{
  vec4 moved = plane.x * pose_row(object, 3) + plane.y * pose_row(object, 4) +
               plane.z * pose_row(object, 5);
  return vec4(moved.xyz, plane.w - moved.w);
}
