/* SPDX-License-Identifier: GPL-3.0-or-later
 * A lobe's light from a whole cell of a light.
 *
 * The cell's corners become slopes of half vectors. As a density of slopes, in units of alpha, GGX
 * is 1 / (pi (1 + s^2)^2) (Walter et al. 2007, eq. 33), and over a polygon Green's theorem gives
 * its integral and its first moment in closed form, from one arc tangent for each edge:
 *
 *   div(s / (2 (1 + s^2))) = 1 / (1 + s^2)^2   and   grad(-1 / (2 (1 + s^2))) = s / (1 + s^2)^2.
 *
 * What else the lobe has, Fresnel's term and masking, changes slowly over a cell; taken at the
 * moment's centre, what is linear of it is exact. Of other lobes, what is within a slope is known
 * (`mass_beyond`), and a few points of each edge are summed: neighbouring cells have the same ones,
 * so that only the light's own outline has any error. Needs light.glsl, bsdf.glsl and angle.glsl, and
 * with HAS_BENDS bend.glsl. */

/* Masses are differences of angles that lost their digits: a thousandth is wrong of this one. Below,
 * a lobe's tail is smooth: its density at the corners and their middle serves, with weights that are
 * right for what is quadratic over squares and disks. */
const float LEAST_MASS = 1e-4;
const float TAIL_OF_CORNERS = 4.0 / 9.0;

/* A cell that is so small beside the lobe, squared, is a disk as well: a tenth of alpha. */
const float SMALL_CELL_SQ = 0.01;

/* The lobe's frame, and its two alphas; those that a cell of the light sees. */
struct Facets {
  vec3 N;
  mat2x3 across;
  vec2 alpha;
#ifdef HAS_BENDS
  bool is_bent;
  vec2 leaning; /* the normals' own part of a slope */
  float denser; /* what the lobe's mass is to be multiplied with for it */
#endif
};

Facets own_facets(Lobe lobe, vec3 N)
{
  /* Below Cycles' limit of a mirror nothing of the lobe's width is seen. */
  float alpha = max(lobe.roughness * lobe.roughness, sqrt(MIRROR_ALPHA_SQ));
  Facets facets;
  facets.N = N;
  facets.alpha = vec2(alpha);
#ifdef HAS_ASPECT
  vec3 Y = cross(N, lobe.tangent);
  float length_sq = dot(Y, Y);
  bool is_stretched = lobe.aspect != 1.0 && length_sq > 0.0;
#  ifdef HAS_DISTRIBUTION
  is_stretched = is_stretched && lobe.distribution < 3.5; /* the papers' models are round */
#  endif
  if (is_stretched) {
    Y *= inversesqrt(length_sq);
    facets.across = mat2x3(cross(Y, N), Y);
    facets.alpha = vec2(alpha / lobe.aspect, alpha * lobe.aspect);
    return facets;
  }
#endif
  facets.across = frame_across(N);
  return facets;
}

/* The slope, over alpha, of the half vector of V and a direction of any length. */
vec2 half_slope(Facets facets, vec3 V, vec3 toward)
{
  vec3 H = toward * inversesqrt(max(dot(toward, toward), 1e-30)) + V;
  return (H * facets.across) / (facets.alpha * dot(H, facets.N));
}

#ifdef HAS_BENDS
/* Of what of the cell is above the surface the slope nearest to the lobe's middle (xy), and the variance
 * of its corners' slopes (z). */
vec3 cell_place(Facets facets, vec3 V, vec3 position)
{
  vec2 sum = vec2(0.0);
  float sum_sq = 0.0;
  float count = 0.0;
  vec2 nearest = vec2(0.0);
  float nearest_sq = 1e30;
  vec2 turns = vec2(0.0);
  vec3 toward = to_corner(CELL_CORNERS - 1, position, facets.N);
  bool last_above = dot(facets.N, toward) > 0.0;
  vec2 last = half_slope(facets, V, toward);
  for (int i = 0; i < CELL_CORNERS; i++) {
    toward = to_corner(i, position, facets.N);
    bool above = dot(facets.N, toward) > 0.0;
    vec2 slope = half_slope(facets, V, toward);
    if (above) {
      sum += slope;
      sum_sq += dot(slope, slope);
      count += 1.0;
    }
    if (above && last_above) {
      vec2 along = slope - last;
      float length_sq = dot(along, along);
      float part = length_sq > 0.0 ? clamp(-dot(last, along) / length_sq, 0.0, 1.0) : 0.0;
      vec2 place = last + part * along;
      if (dot(place, place) < nearest_sq) {
        nearest_sq = dot(place, place);
        nearest = place;
      }
      float turn = last.x * slope.y - last.y * slope.x;
      turns += vec2(float(turn >= 0.0), float(turn <= 0.0));
    }
    last = slope;
    last_above = above;
  }
  if (max(turns.x, turns.y) == float(CELL_CORNERS)) {
    nearest = vec2(0.0); /* it goes around the middle */
  }
  vec2 mean = sum / max(count, 1.0);
  return vec3(nearest, max(sum_sq / max(count, 1.0) - dot(mean, mean), 0.0));
}
#endif

Facets lobe_facets(Lobe lobe, vec3 N, vec3 V, vec3 position)
{
  Facets facets = own_facets(lobe, N);
#ifdef HAS_BENDS
  vec2 bend = bend_of_lobe(facets.across, facets.alpha);
  facets.is_bent = bend != vec2(0.0);
  vec2 grown = 0.5 * bend;
  Growth growing = Growth(grown, grown / (1.0 + grown), 1.0);
#  ifdef HAS_DISTRIBUTION
  if (facets.is_bent && lobe.distribution < 1.5)
#  else
  if (facets.is_bent)
#  endif
  {
    vec3 cell = cell_place(facets, V, position);
    growing = growth(cell.xy, cell.z, bend);
  }
  facets.alpha *= sqrt(1.0 + growing.grown);
  facets.leaning = growing.leaning;
  facets.denser = growing.denser;
#endif
  return facets;
}

/* What a lobe gathers over edges: its mass (x) and first moment (yz), times 2 pi; `radial_part`s; the
 * polygon's doubled area, and of its corners the sums of GGX's density and of themselves. */
struct CellSum {
  vec3 mass;
  vec3 radial;
  float area;
  float density;
  vec2 corners;
  float edges;
};

#ifdef HAS_DISTRIBUTION
/* 2 pi times a lobe's mass in a direction (x), and what of it is beyond the slope s, in units of
 * alpha (y). */
vec2 mass_beyond(Lobe lobe, Facets facets, vec2 s)
{
  if (lobe.distribution < 2.5 || lobe.distribution > 5.5) {
    return vec2(1.0, exp(-dot(s, s))); /* Beckmann's */
  }
  /* A power n of the cosine, cos^(n + 3) ds, with Ashikhmin and Shirley's norm and exponents. */
  vec2 slope = s * facets.alpha;
  float slope_sq = max(dot(slope, slope), 1e-30);
  float alpha_sq = slope_sq / max(dot(s, s), 1e-30);
  vec2 n = max(2.0 / (facets.alpha * facets.alpha) - vec2(1.0), vec2(0.0));
  float exponent = max(2.0 / alpha_sq - 1.0, 1e-6);
  float all = sqrt(n.x * n.y) * facets.alpha.x * facets.alpha.y / (alpha_sq * exponent);
  /* log(1 + x) has no digits left of a small x. */
  float log_sq = slope_sq < 1e-3 ? slope_sq * (1.0 - 0.5 * slope_sq) : log(1.0 + slope_sq);
  return all * vec2(1.0, exp(-0.5 * exponent * log_sq));
}

/* Three of Gauss' points of an edge's angle; z is the angle. */
vec3 radial_part(Lobe lobe, Facets facets, vec2 p, vec2 q)
{
  vec2 along = q - p;
  float length_sq = dot(along, along);
  float turn = p.x * q.y - p.y * q.x;
  if (turn == 0.0 || length_sq <= 0.0) {
    return vec3(0.0);
  }
  /* By angle from the edge's nearest point: the slope there is height / cos. */
  along *= inversesqrt(length_sq);
  vec2 outward = vec2(along.y, -along.x);
  float height = dot(p, outward);
  float size = abs(height);
  vec2 ends = vec2(dot(p, along), dot(q, along));
  float angle = upper_angle(size * (ends.y - ends.x), size * size + ends.x * ends.y);
  float start = upper_angle(abs(ends.x), size);
  start = ends.x < 0.0 ? -start : start;
  vec2 sum = vec2(0.0);
  for (int i = 0; i < 3; i++) {
    float at = start + angle * (0.5 + (float(i) - 1.0) * 0.3872983346);
    float c = max(cos(at), 1e-6);
    vec2 s = height * outward + (size * sin(at) / c) * along;
    sum += (i == 1 ? 4.0 / 9.0 : 2.5 / 9.0) * mass_beyond(lobe, facets, s);
  }
  return vec3(sum, 1.0) * (height < 0.0 ? -angle : angle);
}
#endif

void add_edge(inout CellSum sum, Lobe lobe, Facets facets, vec2 p, vec2 q)
{
  vec2 along = q - p;
  float length_sq = dot(along, along);
  float from_centre = 1.0 + dot(q, q);
  sum.density += 1.0 / (from_centre * from_centre);
  sum.corners += q;
  sum.edges += 1.0;
  if (length_sq <= 0.0) {
    return;
  }
  along *= inversesqrt(length_sq);
  vec2 outward = vec2(along.y, -along.x);
  float height = dot(p, outward);
  float width = sqrt(1.0 + height * height);
  vec2 ends = vec2(dot(p, along), dot(q, along));
  float angle = upper_angle(width * (ends.y - ends.x), width * width + ends.x * ends.y);
  sum.mass += vec3(height, -outward) * (angle / width);
  sum.area += height * (ends.y - ends.x);
#ifdef HAS_DISTRIBUTION
  if (lobe.distribution > 1.5) {
    sum.radial += radial_part(lobe, facets, p, q);
  }
#endif
}

/* The mass (x) and the moment's centre (yz) of what of the cell is above the surface. */
vec3 cell_mass(Lobe lobe, Facets facets, vec3 V, vec3 position)
{
  CellSum sum = CellSum(vec3(0.0), vec3(0.0), 0.0, 0.0, vec2(0.0), 0.0);
  vec3 last = to_corner(CELL_CORNERS - 1, position, facets.N);
  float last_height = dot(facets.N, last);
  vec2 last_slope = half_slope(facets, V, last);
  vec2 leaves = vec2(0.0);
  vec2 enters = vec2(0.0);
  bool is_cut = false;
  for (int i = 0; i < CELL_CORNERS; i++) {
    vec3 next = to_corner(i, position, facets.N);
    float height = dot(facets.N, next);
    vec2 slope = half_slope(facets, V, next);
    if (height > 0.0 || last_height > 0.0) {
      vec2 from = last_slope;
      vec2 to = slope;
      if (height <= 0.0 || last_height <= 0.0) {
        /* Edges of the cell are straight, so they meet the horizon here. */
        vec3 horizon = mix(last, next, last_height / (last_height - height));
        vec2 there = half_slope(facets, V, horizon);
        if (last_height <= 0.0) {
          from = there;
          enters = there;
          is_cut = true;
        }
        else {
          to = there;
          leaves = there;
        }
      }
      add_edge(sum, lobe, facets, from, to);
    }
    last = next;
    last_height = height;
    last_slope = slope;
  }
  if (is_cut) {
    add_edge(sum, lobe, facets, leaves, enters);
  }
  /* Seen from behind its corners go round the other way. */
  vec3 mass = sum.mass * (sum.mass.x < 0.0 ? -0.5 / PI : 0.5 / PI);
  vec3 cell = vec3(mass.x, mass.yz / max(mass.x, 1e-30));
  if (mass.x < LEAST_MASS) {
    /* (Half of the doubled area, and 1 / pi of the density.) */
    float share = 1.0 / max(sum.edges, 1.0);
    cell.yz = sum.corners * share;
    float middle = 1.0 + dot(cell.yz, cell.yz);
    float density = mix(1.0 / (middle * middle), sum.density * share, TAIL_OF_CORNERS);
    cell.x = 0.5 / PI * abs(sum.area) * density;
  }
#ifdef HAS_DISTRIBUTION
  if (lobe.distribution > 1.5) {
    /* All of it where the cell is around the lobe's middle, less what is beyond its edges. */
    float all = abs(sum.radial.z) > PI ? sum.radial.x : 0.0;
    cell.x = 0.5 / PI * abs(all - sum.radial.y);
  }
#endif
  return cell;
}

#ifdef HAS_DISTRIBUTION
/* What a lobe other than GGX has beside its distribution and Fresnel's term, as `specular_lobe`
 * has it; for its mass over slopes. */
float other_shape(Lobe lobe, Alphas a, float NoV, float NoL, float NoH, float LoH)
{
  if (lobe.distribution > 5.5) {
    return min(1.0, 2.0 * NoH / max(LoH, 1e-20) * min(NoV, NoL)) * LoH / (NoH * NoV);
  }
  if (lobe.distribution > 2.5) {
    if (lobe.distribution < 3.5) {
      return NoL / max(NoV, NoL);
    }
    /* Blinn's (n + 8) / (8 pi) for the (n + 1) / (2 pi) of mass_beyond. */
    float alpha_sq = lobe.roughness * lobe.roughness * lobe.roughness * lobe.roughness;
    float n = max(2.0 / max(alpha_sq, MIRROR_ALPHA_SQ) - 2.0, 0.0);
    return NoL * LoH * (n + 8.0) / (n + 1.0);
  }
  return LoH /
         (NoH * NoV * (1.0 + lambda_beckmann(NoV, a.view_sq) + lambda_beckmann(NoL, a.light_sq)));
}
#endif

#ifdef CELL_SPOTS
/* Highlights of less than this share of a spot's radiance don't ask how its cone parts the cell. */
const float LEAST_MASS_IN_CONE = 1e-3;

/* Of what a lobe sees of a cell the share that comes from spots that are open, a bit each; or, of a
 * spot light, the mean of what its cone lets through there. A spot counts as much as the lobe sees
 * of it. */
float highlight_share(
    Lobe lobe, Facets facets, vec3 V, vec3 position, Incidence lit, int open, bool of_cone)
{
  /* A spot stands for its part of the cell: a disk's variance is a quarter of its squared radius, a
   * lobe's about half of alpha's square. */
  float LoH = max(dot(V, normalize(lit.L + V)), 0.05);
  vec2 wide = sqrt(facets.alpha * facets.alpha +
                   0.5 * lit.cell_sq / (float(CELL_SPOTS) * 4.0 * LoH));
  vec2 narrower = facets.alpha / wide;
  vec2 sum = vec2(0.0);
  for (int i = 0; i < CELL_SPOTS; i++) {
    vec3 toward = to_spot(i, position);
    if (dot(facets.N, toward) > 0.0) {
      vec2 s = narrower * half_slope(facets, V, toward);
      float weight = 1.0 / (1.0 + dot(s, s));
      weight *= weight;
#  ifdef HAS_DISTRIBUTION
      if (lobe.distribution > 1.5) {
        weight = exp(-dot(s, s));
      }
#  endif
      float share = float((open >> i) & 1);
#  if LIGHT_TYPE == 1
      share = of_cone ? spot_attenuation(-toward) : share;
#  endif
      sum += weight * vec2(1.0, share);
    }
  }
  if (sum.x > 1e-30) {
    return sum.y / sum.x;
  }
#  if LIGHT_TYPE == 1
  if (of_cone) {
    return spot_attenuation(-lit.L);
  }
#  endif
  return float(bitCount(open)) / float(CELL_SPOTS);
}
#endif

/* The lobe's radiance for light.intensity 1; `facets` are its `lobe_facets` there. */
vec3 highlight(Lobe lobe, Facets facets, vec3 V, vec3 position, Incidence lit, vec4 albedo)
{
  vec3 N = facets.N;
  float NoV = dot(N, V);
  if (NoV <= 0.0) {
    return vec3(0.0);
  }
  bool is_point = lit.cell_sq < SMALL_CELL_SQ * facets.alpha.x * facets.alpha.y;
#ifdef HAS_BENDS
  is_point = is_point && !facets.is_bent;
#endif
#ifdef HAS_DISTRIBUTION
  if (lobe.distribution > 3.5 && lobe.distribution < 4.5) {
    /* Phong's has no half vector. */
    is_point = true;
    lit.cell_sq *= light.overlap;
  }
#endif
  if (is_point) {
    return lit.strength * specular_lobe(lobe, N, V, lit.L, lit.cell_sq, albedo);
  }
  if (lit.radiance <= 0.0) {
    return vec3(0.0);
  }
  vec3 cell = cell_mass(lobe, facets, V, position);
#ifdef HAS_BENDS
  cell.x *= facets.denser;
#endif
  if (!(cell.x > 0.0)) {
    return vec3(0.0);
  }
  vec3 H = normalize(N + facets.across * (facets.alpha * cell.yz));
#ifdef HAS_BENDS
  if (facets.is_bent) {
    /* Of the normals, which are as many from everywhere within the pixel, those have this half
     * vector that lean this way: masked and foreshortened is what lies there. */
    N = normalize(N + facets.across * (facets.leaning * facets.alpha * cell.yz));
    NoV = dot(N, V);
  }
#endif
  float LoH = dot(V, H);
  vec3 L = 2.0 * LoH * H - V;
  float NoL = dot(N, L);
  if (NoV <= 0.0 || LoH <= 0.0 || NoL <= 0.0) {
    return vec3(0.0);
  }
  Alphas a = lobe_alphas(lobe, N, V, L, H);
  float NoH = dot(N, H);
  float attenuation = cell_attenuation(L, lit, cell.x);
#if LIGHT_TYPE == 1 && defined(HAS_TURNED_DISK)
  if (cell.x > LEAST_MASS_IN_CONE) {
    attenuation = highlight_share(lobe, facets, V, position, lit, 0, true);
  }
#endif
  vec3 value = (lit.radiance * attenuation) * lobe_fresnel(lobe, LoH);
  /* No lobe sends more than the light's own radiance, but for Fresnel's term: at grazing views, where
   * one direction says little of a cell, the centre's could be 1e12 times as much. */
#ifdef HAS_DISTRIBUTION
  if (lobe.distribution > 1.5) {
    return value * min(cell.x * other_shape(lobe, a, NoV, NoL, NoH, LoH), 1.0);
  }
#endif
  /* D dL is 4 LoH / NoH times the mass. */
  float visible = 1.0 + lambda_ggx(NoV, a.view_sq) + lambda_ggx(NoL, a.light_sq);
  return value * lobe_multiscatter(lobe, albedo) * min(cell.x * LoH / (NoH * NoV * visible), 1.0);
}

#ifdef SHADOW_HAS_SPOTS
/* The share of a highlight that is not hidden, by the spots of the cell that are open. */
float highlight_open(Lobe lobe, Facets facets, vec3 V, vec3 position, Incidence lit, int open)
{
  if (open == 0 || open == (1 << CELL_SPOTS) - 1 ||
      lit.cell_sq < SMALL_CELL_SQ * facets.alpha.x * facets.alpha.y) {
    return float(bitCount(open)) / float(CELL_SPOTS);
  }
  return highlight_share(lobe, facets, V, position, lit, open, false);
}
#endif
