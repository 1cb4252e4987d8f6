/* SPDX-License-Identifier: GPL-3.0-or-later
 * A picture in the beam: addon/relight/filters/slide.py. */

vec3 slide_texel(ivec2 texel, ivec2 size)
{
  if (filters.slide_repeat > 0.5) {
    texel = (texel + size) % size;
  }
  return texelFetch(slide_picture, clamp(texel, ivec2(0), size - 1), 0).rgb;
}

vec3 slide_filter(vec3 q)
{
  vec2 p;
  if (!across_beam(q, p)) {
    return vec3(filters.slide_behind);
  }
  vec2 uv = vec2(dot(filters.slide_u.xy, p) + filters.slide_u.z,
                 dot(filters.slide_v.xy, p) + filters.slide_v.z);
  if (filters.slide_repeat > 0.5) {
    uv = fract(uv);
  }
  else if (any(lessThan(uv, vec2(0.0))) || any(greaterThan(uv, vec2(1.0)))) {
    return vec3(filters.slide_outside);
  }
  /* Not the sampler's own filter, whose fractions have eight bits. */
  ivec2 size = textureSize(slide_picture, 0);
  vec2 at = uv * vec2(size) - vec2(0.5);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  vec3 bottom = mix(slide_texel(low, size), slide_texel(low + ivec2(1, 0), size), t.x);
  vec3 top = mix(slide_texel(low + ivec2(0, 1), size), slide_texel(low + ivec2(1, 1), size), t.x);
  return mix(bottom, top, t.y);
}
