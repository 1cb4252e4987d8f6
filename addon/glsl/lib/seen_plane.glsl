/* SPDX-License-Identifier: GPL-3.0-or-later
 * The plane of a triangle by its code, in local space. */

/* Its unit normal n, and n . x of each of its points x. */
vec4 seen_plane(vec2 code)
{
#ifdef HAS_INSTANCES
  if (is_instanced(code)) {
    int instance = seen_instance(code);
    InstanceTurn turn = instance_turn(instance);
    vec3 n = texelFetch(mesh_plane, mesh_texel(code), 0).xyz;
    vec3 corner = texelFetch(mesh_corner, mesh_texel(code), 0).xyz;
    /* A plane's product with a point is the same in both spaces. */
    vec4 plane = vec4(
        instance_gradient(turn, n), dot(n, instance_offset(instance, turn, corner)));
    return plane * inversesqrt(dot(plane.xyz, plane.xyz));
  }
#endif
  return texelFetch(triangle_plane, alone_texel(code), 0);
}
