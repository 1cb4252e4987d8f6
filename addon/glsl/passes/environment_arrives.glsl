/* SPDX-License-Identifier: GPL-3.0-or-later
 * What arrives along rays that met nothing. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
#ifdef IS_TINTED
  radiance = vec4(texelFetch(ray_open, texel, 0).rgb, 0.0) * texelFetch(ray_arriving, texel, 0);
#else
  radiance = texelFetch(ray_open, texel, 0).r * texelFetch(ray_arriving, texel, 0);
#endif
}
