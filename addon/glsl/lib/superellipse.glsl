/* SPDX-License-Identifier: GPL-3.0-or-later
 * Soft superellipses (Pellacini and Vidimce, Cinematic Lighting, GPU Gems 10, listing 10-2),
 * without the powers that overflow there. */

/* How far the outline |x / size.x|^(2 / roundness) + |y / size.y|^(2 / roundness) = 1 reaches
 * beyond p on the ray from the centre through it: 1 on the outline, 0 where it has no size. The
 * larger term is taken out of the sum, so that no power is more than 2^(roundness / 2). p is not
 * 0, and `p.x` and `p.y` are not negative. */
float superellipse_reach(vec2 p, vec2 size, float roundness)
{
  float x = p.x * size.y;
  float y = p.y * size.x;
  float larger = max(x, y);
  float area = size.x * size.y;
  if (area <= 0.0) {
    return 0.0;
  }
  if (larger <= 0.0) {
    return BEAM_END; /* too near the middle for a product */
  }
  float ratio = min(x, y) / larger;
  float power = ratio > 0.0 ? pow(ratio, 2.0 / roundness) : 0.0;
  return area / (larger * pow(1.0 + power, 0.5 * roundness));
}

/* 1 within the inner outline, 0 beyond the outer one, and a smoothstep along each ray between. */
float superellipse(vec2 p, vec2 inner, vec2 outer, float roundness)
{
  vec2 at = abs(p);
  if (at.x + at.y <= 0.0) {
    return outer.x * outer.y > 0.0 ? 1.0 : 0.0;
  }
  float near = superellipse_reach(at, inner, roundness);
  if (near >= 1.0) {
    return 1.0;
  }
  float far = superellipse_reach(at, outer, roundness);
  if (far <= 1.0) {
    return 0.0;
  }
  float t = (1.0 - near) / (far - near);
  return 1.0 - t * t * (3.0 - 2.0 * t);
}
