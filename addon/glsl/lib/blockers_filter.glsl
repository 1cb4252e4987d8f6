/* SPDX-License-Identifier: GPL-3.0-or-later
 * Cards in the beam: addon/relight/filters/blockers.py. */

/* Whether two heights over a plane lie on its two sides; their product may be too small. */
bool on_other_side(float a, float b)
{
  return a > 0.0 ? b < 0.0 : (a < 0.0 && b > 0.0);
}

/* By how much a card covers the segment from the light's centre (of a sun: the ray along its
 * axis) to q; 0 where that does not cross its plane. */
float blocker_cover(int i, vec3 q)
{
  vec4 x = filters.blockers_x[i];
  vec4 y = filters.blockers_y[i];
  vec4 z = filters.blockers_z[i];
  float height = dot(z.xyz, q) + z.w;
  vec2 here = vec2(dot(x.xyz, q) + x.w, dot(y.xyz, q) + y.w);
#if LIGHT_TYPE == 2
  /* Back towards the sun, along +Z of light space. */
  if (!on_other_side(z.z, height)) {
    return 0.0;
  }
  vec2 p = here - (height / z.z) * vec2(x.z, y.z);
#else
  if (!on_other_side(z.w, height)) {
    return 0.0;
  }
  vec2 p = mix(vec2(x.w, y.w), here, z.w / (z.w - height));
#endif
  p = clamp(p, vec2(-BEAM_END), vec2(BEAM_END));
  vec4 outline = filters.blockers_outline[i];
  vec4 shape = filters.blockers_shape[i]; /* roundness, whether it is a window */
  float covered = superellipse(p, outline.xy, outline.zw, shape.x);
  return shape.y > 0.5 ? 1.0 - covered : covered;
}

vec3 blockers_filter(vec3 q)
{
  vec3 through = vec3(1.0);
  int count = int(filters.blockers_count);
  for (int i = 0; i < count; i++) {
    through *= vec3(1.0) - blocker_cover(i, q) * filters.blockers_taken[i].rgb;
  }
  return through;
}
