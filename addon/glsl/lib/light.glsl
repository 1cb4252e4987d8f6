/* SPDX-License-Identifier: GPL-3.0-or-later
 * What one point of a light sends to a place: formulas of Cycles' lights (src/kernel/light/),
 * with one point of the light standing for all of it. LIGHT_TYPE: 0 point, 1 spot, 2 sun,
 * 3 area, 4 glowing mesh. `light` is filled in by addon/relight/lights/light_pass.py. */

struct Incidence {
  vec3 L;         /* unit, towards the light's point */
  float strength; /* times light.intensity is the irradiance of a surface that faces L */
  float cell_sq;  /* squared angular radius of the part of the light that the point stands for */
#ifdef HAS_EXTENT
  float radiance; /* times light.intensity is that of the light's cell; 0 from behind */
#endif
};

/* No place is lit more strongly than by a lamp of one watt per steradian at 1e-10 m, however its
 * filters amplify it, and none shines more than 1e29 times as bright as a light's intensity is: the
 * narrowest lobe that any surface has, at grazing view, is 6e13; and layers are multiplied with up
 * to 3e8 for a lamp of 1e9 W. More than that float32 does not hold. */
const float MOST_STRENGTH = 1e20;
const float MOST_RADIANCE = 1e29;

/* Spots: Cycles' spot_light_attenuation. `direction` leaves the light. Both cosines are counted
 * from one, and by sines: float32's cosines near one are 6e-8 apart, a cone of 0.04 degrees. */
float spot_attenuation(vec3 direction)
{
  vec3 in_light = vec3(dot(light.spot_x.xyz, direction),
                       dot(light.spot_y.xyz, direction),
                       dot(light.spot_z.xyz, direction));
  float sine_sq = dot(in_light.xy, in_light.xy) / dot(in_light, in_light);
  float cosine = -in_light.z / length(in_light);
  float one_minus_cosine = cosine > 0.0 ? sine_sq / (1.0 + cosine) : 1.0 - cosine;
  float x = clamp((light.cone.x - one_minus_cosine) * light.cone.y, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/* Area lights: the grid's share that is open at this angle (area_light_spread_attenuation). */
float spread_attenuation(vec3 L, float cosine)
{
  float tangent = length(cross(light.axis.xyz, L)) / cosine;
  return max((light.cone.x - tangent) * light.cone.y, 0.0);
}

#ifdef HAS_TURNED_DISK
/* The disk's offset (metres, on the disk across the light's axis) on the disk across the way to a
 * receiver, in whose unit direction from the centre `axis` points: mirrored in the middle between. */
vec3 turned_offset(vec3 offset, vec3 axis)
{
  vec3 halfway = axis + light.axis.xyz;
  float halfway_sq = dot(halfway, halfway);
  return halfway_sq > 0.0 ? offset - 2.0 * dot(offset, halfway) / halfway_sq * halfway : offset;
}

/* The way to a lamp's point as each receiver sees it (point_light_sample, spot_light_sample): on the
 * disk that is turned towards it, or in the cone of directions that meet the lamp's ball. `offset` is
 * the point's from the centre on the disk across the light's axis. `strength` is as in Incidence; for
 * a ball its radiance times the solid angle. */
vec3 turned_way(vec3 offset, vec3 position, out float strength)
{
  vec3 from_centre = position - light.centre.xyz;
  float centre_sq = dot(from_centre, from_centre);
  strength = 0.0;
  if (centre_sq <= 0.0) {
    return vec3(0.0);
  }
  vec3 axis = from_centre * inversesqrt(centre_sq);
  offset = turned_offset(offset, axis);
  if (light.disk > 0.5) {
    vec3 way = offset - from_centre;
    float t_sq = dot(way, way);
    strength = t_sq > 0.0 ? sqrt(centre_sq) / (t_sq * sqrt(t_sq)) : 0.0;
    return way;
  }
  float radius_sq = light.radius_sq;
  float sin_sq = radius_sq / centre_sq;
  bool outside = sin_sq < 1.0;
  float widest = outside ? sin_sq / (1.0 + sqrt(1.0 - sin_sq)) : 2.0;
  float offset_sq = dot(offset, offset);
  float one_minus_cos = min(widest * offset_sq / radius_sq, 2.0);
  float cosine = 1.0 - one_minus_cos;
  vec3 direction = -cosine * axis;
  if (offset_sq > 0.0) {
    direction += sqrt(one_minus_cos * (2.0 - one_minus_cos)) * inversesqrt(offset_sq) * offset;
  }
  /* Where it meets the ball: the nearer of two places from outside, the only one from inside. */
  float along = sqrt(centre_sq) * cosine;
  float half_chord = sqrt(max(radius_sq - centre_sq * one_minus_cos * (2.0 - one_minus_cos), 0.0));
  strength = 2.0 * widest / radius_sq;
  float reach = outside ? along - half_chord : along + half_chord;
  return max(reach, 1e-7 * sqrt(radius_sq)) * direction;
}

#if LIGHT_TYPE == 1
/* How much of the cell a spot's cone lets through: of its first four spots, one in each quarter. */
float cell_cone(vec3 position)
{
  float sum = 0.0;
  for (int i = 0; i < 4; i++) {
    float strength;
    sum += spot_attenuation(-turned_way(light.spots[i].xyz, position, strength));
  }
  return 0.25 * sum;
}
#endif

/* Whether a receiver is inside a spherical lamp, which then is all about it. */
bool is_inside_lamp(vec3 position)
{
  vec3 from_centre = position - light.centre.xyz;
  return light.disk < 0.5 && dot(from_centre, from_centre) <= light.radius_sq;
}
#endif

/* From a place to the light's point there: metres; of a sun a unit direction. */
vec3 way_to_light(vec3 position)
{
#if LIGHT_TYPE == 2
  return light.place.xyz;
#elif defined(HAS_TURNED_DISK)
  float strength;
  return turned_way(light.place.xyz, position, strength);
#else
  return light.place.xyz - position;
#endif
}

#ifdef HAS_EXTENT
/* From a receiver to a corner of the light's cell, of any length. A lamp's is on a disk that is
 * turned towards the receiver; one that is inside a sphere sees it all about N. */
vec3 to_corner(int index, vec3 position, vec3 N)
{
#  if LIGHT_TYPE == 2
  return light.corners[index].xyz;
#  elif LIGHT_TYPE == 3
  return light.corners[index].xyz - position;
#  elif defined(HAS_TURNED_DISK)
  if (is_inside_lamp(position)) {
    float angle = 2.0 * PI * float(index) / float(CELL_CORNERS);
    return N + 1e4 * (frame_across(N) * vec2(cos(angle), sin(angle)));
  }
  float strength;
  return turned_way(light.corners[index].xyz, position, strength);
#  else
  vec3 axis = light.centre.xyz - position;
  float centre_sq = dot(axis, axis);
  float radius_sq = light.radius_sq;
  if (light.disk < 0.5) {
    if (centre_sq <= radius_sq) {
      axis = N;
      radius_sq = 1e8;
    }
    else {
      /* The sphere's outline: sin = r / d. */
      radius_sq *= centre_sq / (centre_sq - radius_sq);
    }
  }
  mat2x3 across = frame_across(axis * inversesqrt(max(dot(axis, axis), 1e-30)));
  return axis + sqrt(radius_sq) * (across * light.corners[index].xy);
#  endif
}

/* From a receiver to a spot in the light's cell, of any length. */
vec3 to_spot(int index, vec3 position)
{
#  if LIGHT_TYPE == 2
  return light.spots[index].xyz;
#  elif defined(HAS_TURNED_DISK)
  float strength;
  return turned_way(light.spots[index].xyz, position, strength);
#  else
  return light.spots[index].xyz - position;
#  endif
}

/* Of samples on the light, the share that is above a surface: a lobe sees all of a lamp that is
 * above in each of those, and nothing in the others. */
float share_above(vec3 position, vec3 Ng)
{
#  if LIGHT_TYPE < 2 && !defined(HAS_TURNED_DISK)
  vec3 axis = light.centre.xyz - position;
  float centre_sq = dot(axis, axis);
  float height = dot(axis, Ng);
  float radius_sq = light.radius_sq;
  if (light.disk < 0.5) {
    if (centre_sq <= radius_sq) {
      return 1.0;
    }
    radius_sq *= centre_sq / (centre_sq - radius_sq);
  }
  float half_height_sq = radius_sq * max(1.0 - height * height / max(centre_sq, 1e-30), 0.0);
  float x = clamp(height * inversesqrt(max(half_height_sq, 1e-30)), -1.0, 1.0);
  return 0.5 + (asin(x) + x * sqrt(1.0 - x * x)) / PI;
#  else
  return 1.0;
#  endif
}

/* How bright the light is from a direction within its cell, of its brightest. Where all of a spot is
 * its cell and only a part of the lamp shines on a place, the sample's own point tells, but for what
 * (`mass`) of a narrow lobe sees no other part than L's. */
float cell_attenuation(vec3 L, Incidence lit, float mass)
{
#  if LIGHT_TYPE == 1 && defined(HAS_TURNED_DISK)
  return spot_attenuation(-L);
#  elif LIGHT_TYPE == 1
  return mix(spot_attenuation(-lit.L), spot_attenuation(-L), min(mass, 1.0));
#  elif LIGHT_TYPE == 3 && defined(HAS_SPREAD)
  return spread_attenuation(L, max(-dot(light.axis.xyz, L), 1e-6));
#  else
  return 1.0;
#  endif
}
#endif

Incidence incidence(vec3 position)
{
  Incidence result;
#ifdef HAS_EXTENT
  result.radiance = light.radiance;
#endif
#if LIGHT_TYPE == 2
  result.L = light.place.xyz;
  result.strength = 1.0;
  result.cell_sq = light.cell;
#else
#  ifdef HAS_TURNED_DISK
  float turned_strength;
  vec3 to_light = turned_way(light.place.xyz, position, turned_strength);
#  else
  vec3 to_light = light.place.xyz - position;
#  endif
  float distance_sq = dot(to_light, to_light);
  if (distance_sq <= 0.0) {
    result.L = vec3(0.0, 0.0, 1.0);
    result.strength = 0.0;
    result.cell_sq = 0.0;
#  ifdef HAS_EXTENT
    result.radiance = 0.0;
#  endif
    return result;
  }
  result.L = to_light * inversesqrt(distance_sq);
  result.strength = 1.0 / distance_sq;
  result.cell_sq = light.cell / distance_sq;
#  if LIGHT_TYPE == 3
  float cosine = -dot(light.axis.xyz, result.L);
  if (cosine <= 0.0) {
    result.strength = 0.0;
#    ifdef HAS_EXTENT
    result.radiance = 0.0;
#    endif
    return result;
  }
  result.strength *= cosine;
  result.cell_sq *= cosine;
#    ifdef HAS_SPREAD
  result.strength *= spread_attenuation(result.L, cosine);
#    endif
#  elif LIGHT_TYPE == 4
  /* Both sides shine. The point stands for a disk of the light's surface, `radius_sq`: nearer
   * than that disk is wide, its light grows no more, where 1 / t^2 would have no bound. */
  float cosine = abs(dot(light.axis.xyz, result.L));
  result.strength = cosine / max(distance_sq, light.radius_sq);
  result.cell_sq *= cosine;
#  elif defined(HAS_TURNED_DISK)
  result.strength = turned_strength;
#    ifdef HAS_EXTENT
  if (is_inside_lamp(position)) {
    /* Each sample sees all of it. */
    result.radiance *= light.cell / light.radius_sq;
  }
#    endif
#    if LIGHT_TYPE == 1
  result.strength *= cell_cone(position);
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
  result.strength = min(result.strength, MOST_STRENGTH);
#endif
  return result;
}
