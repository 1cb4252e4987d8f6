/* SPDX-License-Identifier: GPL-3.0-or-later
 * The normal for shading at what each pixel sees, on the viewer's side. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 texel = ivec2(texelFetch(visible_triangle, pixel, 0).rg);
  visible_shading_normal = vec4(0.0);
  if (texel.x == 0) {
    return;
  }
  texel = ivec2(texel.y, texel.x - 1);
  vec3 flat_normal = texelFetch(triangle_plane, texel, 0).xyz;
  vec3 N = corner_normal(texel, texelFetch(visible_position, pixel, 0).xyz, flat_normal);
  bool is_back = dot(texelFetch(visible_normal, pixel, 0).xyz, flat_normal) < 0.0;
  visible_shading_normal = vec4(is_back ? -N : N, 0.0);
}
