/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which pixels' hits are on another surface than their own shading sample, or are asked for. */

#ifdef IS_BLURRED
/* Whether a place is moved by half a pixel from where this pixel's sample lies without blur. */
bool is_elsewhere(vec3 place)
{
  vec4 clip = film.clip_from_local * vec4(place, 1.0);
  vec2 at = (0.5 * clip.xy / clip.w + 0.5) * film.size;
  vec2 away = abs(at - gl_FragCoord.xy - film.offset);
  return !(clip.w > 0.0 && max(away.x, away.y) <= 0.5);
}
#endif

#ifdef HAS_LAYERS
/* With sheer layers: what of the light is kept for the pixel's own sample. Of a layer nothing is
 * where there is none. */
void keep(ivec2 pixel, bool same)
{
  kept = vec4(0.0);
  if (layer.is_sheer > 0 && texelFetch(visible_position, pixel, 0).w == 0.0) {
    stray = 0.0;
  }
  else if (same) {
    kept = texelFetch(seen_through, min(pixel, textureSize(seen_through, 0) - 1), 0);
  }
}
#endif

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  bool same = same_surface(texelFetch(sample_position, pixel, 0),
                           texelFetch(sample_normal, pixel, 0).xyz,
                           texelFetch(visible_position, pixel, 0),
                           texelFetch(visible_normal, pixel, 0).xyz);
#ifdef IS_BLURRED
  vec4 hit = texelFetch(visible_position, pixel, 0);
  same = same && (hit.w == 0.0 || !is_elsewhere(hit.xyz));
#endif
#ifdef HAS_ASKED
  same = same && texelFetch(asked_pixels, pixel, 0).r < 0.5;
#endif
  stray = same ? 0.0 : 1.0;
#ifdef HAS_LAYERS
  keep(pixel, same);
#endif
}
