/* SPDX-License-Identifier: GPL-3.0-or-later
 * The normal for shading at what each pixel sees, on the viewer's side. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 code = texelFetch(visible_triangle, pixel, 0).rg;
  visible_shading_normal = vec4(0.0);
  if (code.x == 0.0) {
    return;
  }
  SeenCorners corners = seen_corners(code);
  vec3 p = texelFetch(visible_position, pixel, 0).xyz;
  vec3 N = corner_normal(corners, p);
  bool is_back = dot(texelFetch(visible_normal, pixel, 0).xyz, corners.own) < 0.0;
  visible_shading_normal = vec4(is_back ? -N : N, 0.0);
}
