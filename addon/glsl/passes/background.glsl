/* SPDX-License-Identifier: GPL-3.0-or-later
 * The world seen directly where there is no surface; and the picture's alpha. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy) * background.stride + ivec2(background.stride / 2);
  texel = min(texel, textureSize(surface_position, 0) - 1);
  if (texelFetch(surface_position, texel, 0).w > 0.0) {
    radiance = vec4(0.0, 0.0, 0.0, background.weight);
    return;
  }
#ifdef HAS_PICTURE
#  ifdef HAS_ATLAS
  /* Written by sample_hits.glsl. */
  vec2 film = texelFetch(surface_position, texel, 0).xy;
#  else
  vec2 film = vec2(texel) + vec2(0.5);
#  endif
  vec3 direction = normalize(background.corner.xyz + film.x * background.right.xyz +
                             film.y * background.up.xyz);
  vec3 seen = picture_at(direction);
#else
  vec3 seen = background.color.rgb;
#endif
  radiance = background.opacity * background.weight * vec4(seen * background.color.w, 1.0);
}
