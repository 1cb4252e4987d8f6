/* SPDX-License-Identifier: GPL-3.0-or-later
 * By how much the normals for shading turn within what each sample of the view stands for. */

/* A part of a pixel is at most so many times as long on a surface that is seen edge-on: nothing is
 * seen of what is farther round. */
const float LONGEST = 20.0;

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 texel = ivec2(texelFetch(visible_triangle, pixel, 0).rg);
  normal_bend = vec4(0.0);
  if (texel.x == 0) {
    return;
  }
  texel = ivec2(texel.y, texel.x - 1);
  vec3 p = texelFetch(visible_position, pixel, 0).xyz;
  vec3 n = texelFetch(triangle_plane, texel, 0).xyz;
  vec3 V = look.eye.xyz - p * look.eye.w;
  float deviation = look.deviation * mix(1.0, length(V), look.eye.w);
  V = normalize(V);
  /* As wide as seen, and longer along the view. */
  vec3 side = cross(n, V);
  float sine_sq = dot(side, side);
  side = sine_sq > 1e-12 ? side * inversesqrt(sine_sq) : frame_across(n)[0];
  vec3 along = cross(side, n) / max(abs(dot(n, V)), 1.0 / LONGEST);
  normal_bend = corner_bend(texel, p, deviation * side, deviation * along);
}
