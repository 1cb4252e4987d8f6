/* SPDX-License-Identifier: GPL-3.0-or-later
 * What one point of a light sends to a place: formulas of Cycles' lights (src/kernel/light/),
 * with one point of the light standing for all of it. LIGHT_TYPE: 0 point, 1 spot, 2 sun,
 * 3 area. `light` is filled in by addon/relight/light_pass.py. */

struct Incidence {
  vec3 L;         /* unit, towards the light's point */
  float strength; /* times light.intensity is the irradiance of a surface that faces L */
  float cell_sq;  /* squared angular radius of the part of the light that the point stands for */
};

/* Spots: Cycles' spot_light_attenuation. `direction` leaves the light. */
float spot_attenuation(vec3 direction)
{
  vec3 in_light = vec3(dot(light.spot_x.xyz, direction),
                       dot(light.spot_y.xyz, direction),
                       dot(light.spot_z.xyz, direction));
  float x = clamp((-in_light.z / length(in_light) - light.cone.x) * light.cone.y, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/* Area lights: the grid's share that is open at this angle (area_light_spread_attenuation). */
float spread_attenuation(float cosine)
{
  float tangent = sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine;
  return max((light.cone.x - tangent) * light.cone.y, 0.0);
}

Incidence incidence(vec3 position)
{
  Incidence result;
#if LIGHT_TYPE == 2
  result.L = light.place.xyz;
  result.strength = 1.0;
  result.cell_sq = light.cell;
#else
  vec3 to_light = light.place.xyz - position;
  float distance_sq = dot(to_light, to_light);
  if (distance_sq <= 0.0) {
    result.L = vec3(0.0, 0.0, 1.0);
    result.strength = 0.0;
    result.cell_sq = 0.0;
    return result;
  }
  result.L = to_light * inversesqrt(distance_sq);
  result.strength = 1.0 / distance_sq;
  result.cell_sq = light.cell / distance_sq;
#  if LIGHT_TYPE == 3
  float cosine = -dot(light.axis.xyz, result.L);
  if (cosine <= 0.0) {
    result.strength = 0.0;
    return result;
  }
  result.strength *= cosine;
  result.cell_sq *= cosine;
#    ifdef HAS_SPREAD
  result.strength *= spread_attenuation(cosine);
#    endif
#  else
  /* Outside its radius the light's points shine, together, like its centre (a disk turned
   * towards the receiver: on its axis that is 1 / (d^2 + r^2)); inside they surround the
   * receiver, and near one of them 1 / t^2 would have no bound. */
  vec3 to_centre = light.centre.xyz - position;
  float centre_sq = dot(to_centre, to_centre);
  float radius_sq = light.radius_sq;
  bool is_flat = light.cone.z > 0.0;
  if (is_flat) {
    result.strength = 1.0 / (centre_sq + light.disk * radius_sq);
  }
  else if (centre_sq <= radius_sq) {
    result.strength = 1.0 / (radius_sq + light.disk * centre_sq);
    result.cell_sq = light.cell / radius_sq;
  }
  else {
    result.strength *= centre_sq / (centre_sq + light.disk * radius_sq);
  }
#    if LIGHT_TYPE == 1
  result.strength *= spot_attenuation(-result.L);
#    endif
#  endif
#endif
  return result;
}
