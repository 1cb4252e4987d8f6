/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where the instances of repeated meshes are (addon/corrmap/instance_table.py): for each, rows of the
 * turn and stretch from mesh to local space, rows of its inverse, and local space's origin in mesh
 * space with 1 + object id. Beside the rows stands what rounding left of that origin. Needs:
 * row_texture.glsl. */

vec4 instance_row(int instance, int row)
{
  return texelFetch(instance_table, row_texel(instance * 8 + row), 0);
}

/* A point of the mesh in local space. Both differences are rounded relative to themselves, so that
 * what lies near the origin is exact however far from it the mesh begins. */
vec3 instance_point(int instance, vec3 point)
{
  vec4 x = instance_row(instance, 0);
  vec4 y = instance_row(instance, 1);
  vec4 z = instance_row(instance, 2);
  vec3 p = (point - instance_row(instance, 6).xyz) - vec3(x.w, y.w, z.w);
  return vec3(dot(x.xyz, p), dot(y.xyz, p), dot(z.xyz, p));
}

/* The inverse, which turns what stands on surfaces into local space. */
struct InstanceTurn {
  vec4 x;
  vec4 y;
  vec4 z;
};

InstanceTurn instance_turn(int instance)
{
  return InstanceTurn(
      instance_row(instance, 3), instance_row(instance, 4), instance_row(instance, 5));
}

/* In local space, a gradient in mesh space. */
vec3 instance_gradient(InstanceTurn turn, vec3 gradient)
{
  return gradient.x * turn.x.xyz + gradient.y * turn.y.xyz + gradient.z * turn.z.xyz;
}

vec3 instance_normal(InstanceTurn turn, vec3 normal)
{
  return normalize(instance_gradient(turn, normal));
}

/* From local space's origin to a point of the mesh, in mesh space. */
vec3 instance_offset(int instance, InstanceTurn turn, vec3 point)
{
  return (point - instance_row(instance, 6).xyz) - vec3(turn.x.w, turn.y.w, turn.z.w);
}

/* 1 + object id. */
float instance_object(int instance)
{
  return instance_row(instance, 6).w;
}
