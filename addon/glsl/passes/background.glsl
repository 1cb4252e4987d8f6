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
  ivec2 size = textureSize(world_picture, 0);
  vec2 at = equirect_texel(direction, size);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  vec3 bottom = mix(EQUIRECT_TEXEL(world_picture, size, 0, low),
                    EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(1, 0)),
                    t.x);
  vec3 top = mix(EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(0, 1)),
                 EQUIRECT_TEXEL(world_picture, size, 0, low + ivec2(1, 1)),
                 t.x);
  vec3 seen = mix(bottom, top, t.y);
#else
  vec3 seen = background.color.rgb;
#endif
  radiance = background.opacity * background.weight * vec4(seen * background.color.w, 1.0);
}
