/* SPDX-License-Identifier: GPL-3.0-or-later
 * Two unit vectors across a unit axis, right-handed with it; Duff et al., Building an Orthonormal
 * Basis, Revisited (2017). */
mat2x3 frame_across(vec3 axis)
{
  float turn = axis.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (turn + axis.z);
  float b = axis.x * axis.y * a;
  return mat2x3(vec3(1.0 + turn * axis.x * axis.x * a, turn * b, -turn * axis.x),
                vec3(b, turn + axis.y * axis.y * a, -axis.y));
}
