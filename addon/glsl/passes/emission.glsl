/* SPDX-License-Identifier: GPL-3.0-or-later
 * What surfaces send out by themselves. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  radiance = vec4(0.0);
  if (texelFetch(surface_position, texel, 0).w > 0.0) {
    radiance = scale.factor * texelFetch(surface_emission, texel, 0);
  }
}
