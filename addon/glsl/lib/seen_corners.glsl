/* SPDX-License-Identifier: GPL-3.0-or-later
 * The corners of a triangle by its code: their unit normals for shading, and how much the second
 * and third count at a place p, xyz . p + w (addon/corrmap/corner_normal_table.py); and the
 * triangle's own normal. */
struct SeenCorners {
  vec3 own;
  vec3 A;
  vec3 B;
  vec3 C;
  vec4 to_b;
  vec4 to_c;
};

#ifdef HAS_INSTANCES
vec4 instance_share(InstanceTurn turn, vec3 gradient, vec3 corner)
{
  return vec4(instance_gradient(turn, gradient), -dot(gradient, corner));
}
#endif

SeenCorners seen_corners(vec2 code)
{
#ifdef HAS_INSTANCES
  if (is_instanced(code)) {
    ivec2 texel = mesh_texel(code);
    int instance = seen_instance(code);
    vec4 ab = texelFetch(mesh_corner_normals_ab, texel, 0);
    vec2 c = texelFetch(mesh_corner_normal_c, texel, 0).rg;
    InstanceTurn turn = instance_turn(instance);
    vec3 corner = instance_offset(instance, turn, texelFetch(mesh_corner, texel, 0).xyz);
    return SeenCorners(
        instance_normal(turn, texelFetch(mesh_plane, texel, 0).xyz),
        instance_normal(turn, octahedral_normal(ab.xy)),
        instance_normal(turn, octahedral_normal(ab.zw)),
        instance_normal(turn, octahedral_normal(c)),
        instance_share(turn, texelFetch(mesh_corner_share_b, texel, 0).xyz, corner),
        instance_share(turn, texelFetch(mesh_corner_share_c, texel, 0).xyz, corner));
  }
#endif
  ivec2 texel = alone_texel(code);
  vec4 ab = texelFetch(corner_normals_ab, texel, 0);
  vec2 c = texelFetch(corner_normal_c, texel, 0).rg;
  return SeenCorners(texelFetch(triangle_plane, texel, 0).xyz,
                     octahedral_normal(ab.xy),
                     octahedral_normal(ab.zw),
                     octahedral_normal(c),
                     texelFetch(corner_share_b, texel, 0),
                     texelFetch(corner_share_c, texel, 0));
}
