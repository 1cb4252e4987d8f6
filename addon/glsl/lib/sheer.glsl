/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a sheer surface lets pass straight through, where a fragment of it is. */

int wrapped_texel(int texel, int size, int extension);

vec3 transmission_texel(ivec2 texel)
{
  ivec2 size = textureSize(sheer_transmission, 0);
  if (sheer.extension == 2 && (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size)))) {
    return sheer.outside.rgb; /* clip */
  }
  ivec2 wrapped = ivec2(wrapped_texel(texel.x, size.x, sheer.extension),
                        wrapped_texel(texel.y, size.y, sheer.extension));
  return texelFetch(sheer_transmission, wrapped, 0).rgb;
}

/* Bilinear, as masks are. */
vec3 transmission(vec2 uv)
{
  vec2 texel = uv * vec2(textureSize(sheer_transmission, 0)) - 0.5;
  ivec2 corner = ivec2(floor(texel));
  vec2 f = texel - vec2(corner);
  vec3 low = mix(transmission_texel(corner), transmission_texel(corner + ivec2(1, 0)), f.x);
  vec3 high = mix(transmission_texel(corner + ivec2(0, 1)), transmission_texel(corner + ivec2(1, 1)), f.x);
  return mix(low, high, f.y);
}
