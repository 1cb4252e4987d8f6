/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pixels as weighted lists of shading samples: the indirect framebuffer of J. Ragan-Kelley et al.,
 * "The Lightspeed Automatic Interactive Lighting Preview System" (2007), section 4.1. */
void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  /* All numbers here are whole ones below 2^24, which float32 holds as they are. */
  ivec3 place = ivec3(texelFetch(list_place, pixel, 0).xyz);
  int across = textureSize(list_entries, 0).x;
  int count = place.z;
  if (count == 0) {
    /* All that the pixel sees is on its own sample's surface. */
    radiance = texelFetch(shaded, pixel, 0);
    return;
  }
#ifdef HAS_LAYERS
  /* Weights in colours. Alpha, where it tells what is covered, is what is left of the light from
   * where nothing is. */
  float uncovered = 0.0;
#endif
  int first = place.y;
  int width = textureSize(shaded, 0).x;
  vec4 sum = vec4(0.0);
  for (int i = first; i < first + count; i++) {
    vec4 entry = texelFetch(list_entries, ivec2(i % across, place.x + i / across), 0);
    int number = int(entry.x);
    vec4 part = texelFetch(shaded, ivec2(number % width, number / width), 0);
#ifdef HAS_LAYERS
    sum.rgb += entry.yzw * part.rgb;
    uncovered += dot(entry.yzw, vec3(1.0 / 3.0)) * (layers.cover - part.a);
#else
    sum += entry.y * part;
#endif
  }
#ifdef HAS_LAYERS
  sum.a = layers.cover - uncovered;
#endif
  radiance = sum;
}
