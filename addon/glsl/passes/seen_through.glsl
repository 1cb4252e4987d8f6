/* SPDX-License-Identifier: GPL-3.0-or-later
 * What reaches the viewer from behind one more sheer layer; where there is none, alpha is 0. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 layer = texelFetch(let_through, pixel, 0);
  vec3 before = texelFetch(through_before, min(pixel, textureSize(through_before, 0) - 1), 0).rgb;
  through = vec4(layer.a > 0.0 ? before * layer.rgb : before, 1.0);
}
