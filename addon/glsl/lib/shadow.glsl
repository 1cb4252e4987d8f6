/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reads a shadow map (addon/relight/shadows/shadow_pass.py): an atlas of faces that store the distance
 * to what the light's point sees through each texel's centre.
 *
 * The stored distance is compared with where the same ray meets the receiver's own tangent
 * plane: on a flat receiver both agree to the float's last digits whatever the slope, so no
 * slope-dependent bias is needed. Where that is beyond the receiver itself, as far as the receiver
 * will do: what lies behind it does not hide it. A grazing texel's ray may meet the plane far
 * away, or never. */

/* Rounding: the light's place, the receiver and the interpolated position carry a few float32
 * spacings (6e-8) of their size; at grazing incidence the plane's distance magnifies them. */
const float ROUNDING = 4e-6;

float face_extent(int face)
{
  return shadow.origin[face].w;
}

/* The ray through a texel's centre, not normalized: its length along the face's axis is 1. */
vec3 texel_ray(int face, vec2 texel)
{
  vec2 ndc = (texel + vec2(0.5)) / shadow.resolution * 2.0 - vec2(1.0);
  vec2 across = ndc * face_extent(face);
  return across.x * shadow.right[face].xyz + across.y * shadow.up[face].xyz -
         shadow.back[face].xyz;
}

/* Whether the map's texel shows nothing before the receiver's plane. `receiver` is relative to
 * the map's origin, `slack` in metres. */
float texel_visibility(int face, ivec2 texel, vec3 receiver, vec3 Ng, float slack)
{
  int size = int(shadow.resolution);
  ivec2 inside = clamp(texel, ivec2(0), ivec2(size - 1));
  ivec2 cell = ivec2(face % int(shadow.columns), face / int(shadow.columns)) * size;
  float stored = texelFetch(shadow_map, cell + inside, 0).r;
  float reach;
  float facing;
  float along;
  if (shadow.parallel > 0.5) {
    vec2 ndc = (vec2(inside) + vec2(0.5)) / shadow.resolution * 2.0 - vec2(1.0);
    vec2 across = ndc * face_extent(face);
    vec3 start = across.x * shadow.right[face].xyz + across.y * shadow.up[face].xyz;
    facing = -dot(Ng, shadow.back[face].xyz);
    reach = dot(Ng, receiver - start);
    along = -dot(shadow.back[face].xyz, receiver);
    if (facing >= 0.0) {
      return 0.0; /* the plane looks away from the light */
    }
  }
  else {
    vec3 ray = normalize(texel_ray(face, vec2(inside)));
    facing = dot(Ng, ray);
    reach = dot(Ng, receiver);
    along = length(receiver);
    if (reach >= 0.0) {
      return 0.0;
    }
    if (facing >= 0.0) {
      /* The ray runs along the plane or away from it. */
      return stored >= along - slack ? 1.0 : 0.0;
    }
  }
  float plane = reach / facing;
  float tolerance = ROUNDING * (plane + length(receiver) / -facing);
  return stored >= min(plane - tolerance, along) - slack ? 1.0 : 0.0;
}

/* The share of the 2x2 texels around the receiver that see it. Outside the map: lit. */
float face_visibility(int face, vec2 ndc, vec3 receiver, vec3 Ng, float slack)
{
  vec2 at = (ndc * 0.5 + vec2(0.5)) * shadow.resolution - vec2(0.5);
  ivec2 low = ivec2(floor(at));
  vec2 t = at - vec2(low);
  float bottom = mix(texel_visibility(face, low, receiver, Ng, slack),
                     texel_visibility(face, low + ivec2(1, 0), receiver, Ng, slack),
                     t.x);
  float top = mix(texel_visibility(face, low + ivec2(0, 1), receiver, Ng, slack),
                  texel_visibility(face, low + ivec2(1, 1), receiver, Ng, slack),
                  t.x);
  return mix(bottom, top, t.y);
}

/* How much a face of a touching lamp has to say about a direction from the lamp's centre. */
float face_weight(int face, vec3 from_centre)
{
  float depth = -dot(shadow.back[face].xyz, from_centre);
  if (depth <= 0.0) {
    return 0.0;
  }
  vec2 across = vec2(dot(shadow.right[face].xyz, from_centre),
                     dot(shadow.up[face].xyz, from_centre));
  float x = max(abs(across.x), abs(across.y)) /
            (depth * face_extent(face) * shadow.inner_share);
  /* The eighth power leaves little to any but the nearest, and still has no step. */
  float rest = max(1.0 - x, 0.0);
  rest *= rest;
  rest *= rest;
  return rest * rest;
}

/* What a face's map says of a receiver. */
float lookup(int face, vec3 position, vec3 Ng)
{
  /* Facets of a curved surface leave the tangent plane within a texel; half of its width is
   * as far as they can when they meet at 45 degrees. */
  float texel = face_extent(face) / shadow.resolution; /* at distance 1 */
  vec3 receiver = position - shadow.origin[face].xyz;
  float depth = -dot(shadow.back[face].xyz, receiver);
  if (depth <= 0.0) {
    return 1.0; /* behind a spot, or on the lamp itself */
  }
  vec2 ndc = vec2(dot(shadow.right[face].xyz, receiver), dot(shadow.up[face].xyz, receiver)) /
             (depth * face_extent(face));
  return face_visibility(
      face, clamp(ndc, -shadow.inner_share, shadow.inner_share), receiver, Ng, texel * depth);
}

/* By the smallest cascade that holds the receiver. The largest was fitted to some of the pixels:
 * those that lie beside it are a few texels outside, and see what its border sees. */
float sun_visibility(vec3 position, vec3 Ng)
{
  int last = int(shadow.faces) - 1;
  for (int face = 0; face <= last; face++) {
    vec3 receiver = position - shadow.origin[face].xyz;
    vec2 ndc = vec2(dot(shadow.right[face].xyz, receiver), dot(shadow.up[face].xyz, receiver)) /
               face_extent(face);
    vec2 inside = clamp(ndc, -shadow.inner_share, shadow.inner_share);
    if (face == last || inside == ndc) {
      return face_visibility(face, inside, receiver, Ng, face_extent(face) / shadow.resolution);
    }
  }
  return 1.0;
}

/* What one face says, of a map whose faces look in different directions; outside of it: lit. */
float face_visibility_at(int face, vec3 position, vec3 Ng)
{
  vec3 receiver = position - shadow.origin[face].xyz;
  vec2 ndc = vec2(dot(shadow.right[face].xyz, receiver), dot(shadow.up[face].xyz, receiver)) /
             face_extent(face);
  if (any(greaterThan(abs(ndc), vec2(shadow.inner_share)))) {
    return 1.0;
  }
  return face_visibility(face, ndc, receiver, Ng, face_extent(face) / shadow.resolution);
}

/* Whether the light is on the viewer's side of the surface. */
bool is_before(float NgoL)
{
  return NgoL > 0.0;
}

float visibility(vec3 position, vec3 Ng)
{
  if (shadow.parallel > 0.5) {
    return sun_visibility(position, Ng);
  }
  vec3 from_centre = position - shadow.centre.xyz;
  if (shadow.turned > 0.5) {
    float sum = 0.0;
    float weights = 0.0;
    for (int face = 0; face < int(shadow.faces); face++) {
      float weight = face_weight(face, from_centre);
      if (weight > 0.0) {
        sum += weight * lookup(face, position, Ng);
        weights += weight;
      }
    }
    return weights > 0.0 ? sum / weights : 1.0;
  }
  int face = 0;
  float nearest = -dot(shadow.back[0].xyz, from_centre);
  for (int other = 1; other < int(shadow.faces); other++) {
    float along = -dot(shadow.back[other].xyz, from_centre);
    if (along > nearest) {
      nearest = along;
      face = other;
    }
  }
  return lookup(face, position, Ng);
}
