/* SPDX-License-Identifier: GPL-3.0-or-later
 * The weight of a lobe by the angle of view: ViewCurve in addon/caching/channels.py. */

float view_weight(Lobe lobe, vec3 V)
{
  float weight = lobe.view_base;
  if (lobe.view_slope == 0.0) {
    return weight;
  }
  float NoV = clamp(abs(dot(lobe.N, V)), 0.0, 1.0);
  float f0 = lobe.view_parameter;
  float curve = 0.0;
#ifdef HAS_SHEEN
  if (lobe.view_curve > 3.5) {
    return weight + lobe.view_slope * sheen_shape(NoV, lobe.view_roughness).x;
  }
#endif
  if (lobe.view_curve > 2.5) {
    /* What a coat reflects: Cycles' albedo of it, by which it dims what is under it. */
    curve = f0 + (1.0 - f0) * dielectric_albedo(NoV, lobe.view_roughness, f0);
  }
  else if (lobe.view_curve > 1.5) {
    /* Layer Weight's Facing. */
    curve = 1.0 - pow(max(NoV, 1e-20), lobe.view_parameter);
  }
  else if (lobe.view_curve > 0.5) {
    curve = f0 + (1.0 - f0) * dielectric_weight(NoV, f0);
  }
  return weight + lobe.view_slope * curve;
}
