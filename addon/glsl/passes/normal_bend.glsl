/* SPDX-License-Identifier: GPL-3.0-or-later
 * By how much the normals for shading turn within what each sample of the view stands for. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec2 code = texelFetch(visible_triangle, pixel, 0).rg;
  normal_bend = vec4(0.0);
  if (code.x == 0.0) {
    return;
  }
  SeenCorners corners = seen_corners(code);
  vec3 p = texelFetch(visible_position, pixel, 0).xyz;
  normal_bend = pixel_bend(corners, p);
}
