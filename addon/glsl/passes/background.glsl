/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world seen directly where there is no surface; and the picture's alpha. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  if (texelFetch(surface_position, texel, 0).w > 0.0) {
    radiance = vec4(0.0, 0.0, 0.0, background.weight);
    return;
  }
#ifdef HAS_PICTURE
  vec3 direction = normalize(background.corner.xyz + gl_FragCoord.x * background.right.xyz +
                             gl_FragCoord.y * background.up.xyz);
  vec3 seen = picture_at(direction);
#else
  vec3 seen = background.color.rgb;
#endif
  radiance = background.opacity * background.weight * vec4(seen * background.color.w, 1.0);
}
