/* SPDX-License-Identifier: GPL-3.0-or-later
 * Confidence as colours to lay over the picture: red for none, over yellow, to blue for all (three
 * colours of ColorBrewer's RdYlBu, which the colour-blind tell apart). Scene-linear, as viewports take
 * them, from sRGB (IEC 61966-2-1); premultiplied by alpha. */
void main()
{
  float trust = texelFetch(confidence, ivec2(gl_FragCoord.xy), 0).r;
  const vec3 NONE = vec3(0.843, 0.098, 0.110);
  const vec3 HALF = vec3(1.000, 0.900, 0.550);
  const vec3 ALL = vec3(0.173, 0.482, 0.714);
  vec3 color = trust < 0.5 ? mix(NONE, HALF, 2.0 * trust) : mix(HALF, ALL, 2.0 * trust - 1.0);
  color = mix(color / 12.92, pow((color + 0.055) / 1.055, vec3(2.4)), step(0.04045, color));
  heat = trust < 0.0 ? vec4(0.0) : vec4(color, 1.0) * HEAT_ALPHA;
}
