/* SPDX-License-Identifier: GPL-3.0-or-later
 * Alpha cut-outs: a fragment is there or it is not, the same rule as in the bake. */

#if defined(HAS_CUTOUT) || defined(HAS_SHEER)
int wrapped_texel(int texel, int size, int extension)
{
  if (extension == 0) { /* repeat */
    return texel - size * int(floor(float(texel) / float(size)));
  }
  if (extension == 3) { /* mirror */
    int folded = texel - 2 * size * int(floor(float(texel) / float(2 * size)));
    return folded < size ? folded : 2 * size - 1 - folded;
  }
  return clamp(texel, 0, size - 1);
}
#endif

#ifdef HAS_CUTOUT
float mask_texel(ivec2 texel)
{
  ivec2 size = textureSize(cutout_alpha, 0);
  if (cutout.extension == 2 && (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, size)))) {
    return 0.0; /* clip */
  }
  ivec2 wrapped = ivec2(wrapped_texel(texel.x, size.x, cutout.extension),
                        wrapped_texel(texel.y, size.y, cutout.extension));
  return texelFetch(cutout_alpha, wrapped, 0).r;
}

float mask_alpha(vec2 uv)
{
  vec2 texel = uv * vec2(textureSize(cutout_alpha, 0)) - 0.5;
  ivec2 corner = ivec2(floor(texel));
  vec2 f = texel - vec2(corner);
  float low = mix(mask_texel(corner), mask_texel(corner + ivec2(1, 0)), f.x);
  float high = mix(mask_texel(corner + ivec2(0, 1)), mask_texel(corner + ivec2(1, 1)), f.x);
  return mix(low, high, f.y);
}

void cut_away()
{
  if (mask_alpha(surface_uv) < 0.5) {
    discard;
  }
}
#elif defined(HAS_SHEER) && defined(IS_DITHERED)
/* Sheer surfaces in shadow maps: so many fragments are there as are opaque, spread evenly over the
 * map (J. Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014:
 * interleaved gradient noise). */
void cut_away()
{
  float spread = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  if (spread < dot(transmission(surface_uv), vec3(1.0 / 3.0))) {
    discard;
  }
}
#else
void cut_away() {}
#endif
