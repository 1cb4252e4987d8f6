/* SPDX-License-Identifier: GPL-3.0-or-later
 * What sheer layers let through of a shaded picture behind them. Where `part.cover` is 1 alpha tells
 * what is covered, by the layers too, and else nothing. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 seen = pixel * part.stride + ivec2(part.stride / 2);
  vec3 share = texelFetch(through, min(seen, textureSize(through, 0) - 1), 0).rgb;
  vec4 behind = texelFetch(shaded, pixel, 0);
  float mean = dot(share, vec3(1.0 / 3.0));
  radiance = vec4(share * behind.rgb, part.cover - mean * (part.cover - behind.a));
}
