/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a light's own nodes emit by direction: addon/relight/filters/profile.py, `LightProfile`. */

const float PROFILE_TURN = 6.28318530717958647692;

/* One all around comes again at its sides; others, and its poles, end. */
vec3 profile_texel(ivec2 texel, ivec2 size)
{
  if (filters.profile_half_width <= 0.0) {
    texel.x = (texel.x + size.x) % size.x;
  }
  return texelFetch(profile_picture, clamp(texel, ivec2(0), size - 1), 0).rgb;
}

/* The picture in a unit direction, bilinear. */
vec3 profile_color(vec3 d)
{
  vec2 uv;
  if (filters.profile_half_width > 0.0) {
    if (d.z >= 0.0) {
      return vec3(0.0);
    }
    uv = clamp(0.5 + 0.5 * d.xy / (-d.z * filters.profile_half_width), 0.0, 1.0);
  }
  else {
    bool pole = d.x == 0.0 && d.z == 0.0;
    uv.x = 0.5 + (pole ? 0.0 : atan(d.x, -d.z)) / PROFILE_TURN;
    /* Not asin(d.y), which has few digits left near the poles. */
    uv.y = 0.5 + atan(d.y, length(d.xz)) / (0.5 * PROFILE_TURN);
  }
  ivec2 size = textureSize(profile_picture, 0);
  vec2 at = uv * vec2(size) - vec2(0.5);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  vec3 bottom = mix(profile_texel(low, size), profile_texel(low + ivec2(1, 0), size), t.x);
  vec3 top = mix(
      profile_texel(low + ivec2(0, 1), size), profile_texel(low + ivec2(1, 1), size), t.x);
  return mix(bottom, top, t.y);
}

vec3 profile_filter(vec3 q)
{
  /* Nodes see the direction from the sampled point of the light, not from its centre. */
  vec3 sampled = light.place.xyz - filters.light_origin.xyz;
  vec3 d = q - vec3(dot(filters.light_x.xyz, sampled),
                    dot(filters.light_y.xyz, sampled),
                    dot(filters.light_z.xyz, sampled));
  float r = length(d);
  if (r <= 0.0) {
    return vec3(0.0);
  }
  vec3 color = profile_color(d / r);
  if (filters.profile_exponent != 0.0) {
    /* Within what float32 holds, however far. */
    color *= clamp(pow(r, filters.profile_exponent), exp2(-100.0), exp2(100.0));
  }
  if (filters.profile_smooth > 0.0) {
    float squared = clamp(r * r, exp2(-100.0), exp2(100.0));
    color *= (1.0 + filters.profile_smooth) * (squared / (filters.profile_smooth + squared));
  }
  return color;
}
