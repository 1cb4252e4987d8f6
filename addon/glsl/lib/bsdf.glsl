/* SPDX-License-Identifier: GPL-3.0-or-later
 * The lobes of addon/caching/channels.py, as Cycles' Diffuse, Glossy, Metallic, Translucent and
 * Principled BSDF have them. The Fresnel term has two parts that add up to the stored f0 and f90:
 * the dielectric layer's, with the dielectric's own curve, and the rest, with Schlick's. */

/* The mean of Schlick's weight over the cosine-weighted hemisphere: 2 / ((5 + 3) 5 + 2). */
const float SCHLICK_MEAN = 1.0 / 21.0;

/* Cycles sets alpha^2 <= 2e-10 apart as a mirror (bsdf_microfacet.h), which a light without
 * extent can't be seen in. */
const float MIRROR_ALPHA_SQ = 2e-10;

/* Schlick, An Inexpensive BRDF Model for Physically-based Rendering (1994), eq. 15. */
float schlick_weight(float LoH)
{
  float m = clamp(1.0 - LoH, 0.0, 1.0);
  float m2 = m * m;
  return m2 * m2 * m;
}

/* The reflectance of a dielectric boundary at normal incidence to its index of refraction. */
float ior_from_f0(float f0)
{
  float r = sqrt(clamp(f0, 0.0, 0.99));
  return (1.0 + r) / (1.0 - r);
}

/* Fresnel's reflectance of a dielectric, unpolarized, from outside (Walter et al. 2007, eq. 22),
 * rescaled so that it goes from 0 at normal to 1 at grazing incidence. */
float dielectric_weight(float LoH, float f0)
{
  float ior = ior_from_f0(f0);
  float c = clamp(LoH, 0.0, 1.0);
  float g = sqrt(ior * ior - 1.0 + c * c);
  float a = (g - c) / (g + c);
  float b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
  float reflectance = 0.5 * a * a * (1.0 + b * b);
  float start = (ior - 1.0) / (ior + 1.0);
  start *= start;
  return clamp((reflectance - start) / (1.0 - start), 0.0, 1.0);
}

/* The layer's reflectance at normal incidence as if it covered the surface wholly. */
float layer_ratio(vec2 layer)
{
  return layer.y > 0.0 ? clamp(layer.x / layer.y, 0.0, 1.0) : 0.0;
}

/* Linear in what is stored: the layer's own span follows `dielectric`, the rest `schlick`. */
vec3 fresnel_mix(Lobe lobe, float schlick, float dielectric)
{
  float span = lobe.dielectric * (lobe.layer.y - lobe.layer.x);
  return lobe.f0 + (lobe.f90 - lobe.f0) * schlick + vec3(span * (dielectric - schlick));
}

/* What a metal's edge tint takes away; Kutz et al. 2021. */
vec3 edge_tint(Lobe lobe, float LoH)
{
#ifdef HAS_DIP
  float m = clamp(1.0 - LoH, 0.0, 1.0);
  float m3 = m * m * m;
  return lobe.dip * (LoH * m3 * m3);
#else
  return vec3(0.0);
#endif
}

/* Fresnel's term of the whole lobe. */
vec3 lobe_fresnel(Lobe lobe, float LoH)
{
  float ratio = layer_ratio(lobe.layer);
  vec3 F = fresnel_mix(lobe, schlick_weight(LoH), dielectric_weight(LoH, ratio));
  return max(F - edge_tint(lobe, LoH), vec3(0.0));
}

/* Trowbridge-Reitz (GGX) normal distribution; Walter et al. 2007, eq. 33; as its mean over a disk
 * of half vectors' slopes with squared radius `disk_sq`, in closed form. As a density of slopes,
 * a^2 / (pi (a^2 + s^2)^2) is the stereographic projection of a sphere's evenly spread area, under
 * which disks are caps: with the disk's nearest and farthest slope d -+ r the cap's angle is
 * 2 (atan((d + r) / a) - atan((d - r) / a)). The tail stays the narrow lobe's, and in a mirror
 * (a = 0) the disk itself is seen.
 *
 * The sine is taken from a cross product: 1 - NoH^2 has no digits left where a narrow lobe needs
 * them. */
float D_ggx(vec3 N, vec3 H, float alpha_sq, float disk_sq)
{
  vec3 NxH = cross(N, H);
  float NoH = dot(N, H);
  float cos_sq = NoH * NoH;
  /* Both times NoH^2, and without the squares of what may be 1e24: nothing over- or underflows. */
  float x = dot(NxH, NxH) + (alpha_sq - disk_sq) * cos_sq;
  float y = 2.0 * sqrt(disk_sq) * sqrt(alpha_sq) * cos_sq;
  float larger = max(abs(x), y);
  if (larger <= 0.0) {
    return 0.0;
  }
  vec2 ratio = vec2(x, y) / larger;
  float h = larger * length(ratio);
  return x >= 0.0 ? 2.0 * alpha_sq / (PI * h * (h + x)) :
                    0.5 * (1.0 - x / h) / (PI * disk_sq * cos_sq * cos_sq);
}

/* Smith's Lambda for GGX; Heitz, Understanding the Masking-Shadowing Function (2014), eq. 72. */
float lambda_ggx(float cosine, float alpha_sq)
{
  float c2 = cosine * cosine;
  return 0.5 * (sqrt(1.0 + alpha_sq * max(1.0 - c2, 0.0) / c2) - 1.0);
}

/* Beckmann's distribution (Walter et al. 2007, eq. 25). A light's disk of half vectors widens it
 * by the disk's own variance of slopes. */
float D_beckmann(vec3 N, vec3 H, float alpha_sq, float disk_sq)
{
  vec3 NxH = cross(N, H);
  float NoH = dot(N, H);
  float cos_sq = NoH * NoH;
  float wide_sq = alpha_sq + 0.5 * disk_sq;
  float tail = exp(-dot(NxH, NxH) / max(cos_sq * wide_sq, 1e-30));
  /* Where that is not zero, cos_sq is not small either. */
  return tail > 0.0 ? tail / (PI * wide_sq * cos_sq * cos_sq) : 0.0;
}

/* Smith's Lambda for Beckmann, in the rational form of Walter et al. 2007, after eq. 27. */
float lambda_beckmann(float cosine, float alpha_sq)
{
  float tan_sq = max(1.0 / (cosine * cosine) - 1.0, 0.0);
  float a = inversesqrt(max(alpha_sq * tan_sq, 1e-20));
  return a < 1.6 ? (1.0 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a) : 0.0;
}

/* Ashikhmin and Shirley, An Anisotropic Phong BRDF Model (2000), without its diffuse part, with
 * exponent n at H and `norm` sqrt((n_x + 1)(n_y + 1)). An axis' exponent is Cycles'
 * 2 / alpha^2 - 2. Times NoL, without Fresnel. */
float ashikhmin_shirley(vec3 N, vec3 V, vec3 L, vec3 H, float LoH, float n, float norm)
{
  float NoV = dot(N, V);
  float NoL = dot(N, L);
  /* log(NoH^2) = log(1 - sin^2) from the sine, which keeps its digits in a narrow lobe. */
  vec3 NxH = cross(N, H);
  float sine_sq = min(dot(NxH, NxH), 1.0);
  float log_cos = sine_sq < 1e-3 ? -0.5 * sine_sq * (1.0 + 0.5 * sine_sq) :
                                   log(max(dot(N, H), 1e-20));
  float pump = 1.0 / max(1e-6, max(LoH, 1e-6) * max(NoV, NoL));
  return NoL * norm / (8.0 * PI) * exp(n * log_cos) * pump;
}

/* log(1 - x), which keeps its digits for a small x. */
float log_of_one_minus(float x)
{
  return x < 1e-3 ? -x * (1.0 + x * (0.5 + x / 3.0)) : log(max(1.0 - x, 1e-20));
}

/* Phong, Illumination for Computer Generated Pictures (1975), and Blinn, Models of Light Reflection
 * for Computer Synthesized Pictures (1977), times NoL, scaled to reflect no more than they get
 * (Lafortune and Willems 1994; Akenine-Moeller et al., Real-Time Rendering, eq. 7.48). Both have
 * the exponent 2 / alpha^2 - 2; a light's disk makes it blunter. */
float phong_or_blinn(bool is_phong, vec3 N, vec3 V, vec3 L, vec3 H, float alpha_sq, float cell_sq)
{
  float NoL = dot(N, L);
  if (is_phong) {
    float n = max(2.0 / (alpha_sq + 0.5 * cell_sq) - 2.0, 0.0);
    /* 1 - RoL from the distance of the two, which keeps its digits in a narrow lobe. */
    vec3 RmL = 2.0 * dot(N, V) * N - V - L;
    return NoL * (n + 2.0) / (2.0 * PI) * exp(n * log_of_one_minus(0.5 * dot(RmL, RmL)));
  }
  float n = max(2.0 / (alpha_sq + 0.125 * cell_sq) - 2.0, 0.0);
  vec3 NxH = cross(N, H);
  return NoL * (n + 8.0) / (8.0 * PI) * exp(0.5 * n * log_of_one_minus(dot(NxH, NxH)));
}

/* Cook and Torrance, A Reflectance Model for Computer Graphics (1982), times NoL, without Fresnel:
 * Beckmann's facets, masked by V-shaped grooves; with the 4 of Walter et al. 2007 for their pi. */
float cook_torrance(
    vec3 N, vec3 V, vec3 L, vec3 H, float LoH, float alpha_sq, float disk_sq)
{
  float NoV = dot(N, V);
  float groove = 2.0 * dot(N, H) / max(LoH, 1e-20);
  float G = min(1.0, groove * min(NoV, dot(N, L)));
  return D_beckmann(N, H, alpha_sq, disk_sq) * G / (4.0 * NoV);
}

bool bounces_between_facets(Lobe lobe)
{
#ifdef HAS_DISTRIBUTION
  return lobe.distribution < 0.5;
#else
  return true;
#endif
}

/* What Cycles adds for light that bounces between facets (microfacet_ggx_preserve_energy),
 * after Kulla and Conty, Revisiting Physically Based Shading at Imageworks (2017). */
vec3 multiscatter_of(vec3 Fss, vec4 albedo)
{
  float missing = (1.0 - albedo.x) / albedo.x;
  vec3 Fms = Fss * albedo.w / (vec3(1.0) - Fss * (1.0 - albedo.w));
  return vec3(1.0) + Fms * missing;
}

/* The mean of Fresnel's term over all directions. */
vec3 mean_reflectance(vec3 f0, vec3 f90, vec3 dip)
{
  /* Fresnel's mean for a dielectric is about 3 % above Schlick's at an index of 1.5 and this
   * term is of second order, so Schlick's mean serves both. That of the dip is 1/126 of it. */
  return clamp(f0 + (f90 - f0) * SCHLICK_MEAN - dip / 126.0, vec3(0.0), vec3(1.0));
}

vec3 multiscatter(vec3 f0, vec3 f90, vec3 dip, vec4 albedo)
{
  return multiscatter_of(mean_reflectance(f0, f90, dip), albedo);
}

vec3 lobe_multiscatter(Lobe lobe, vec4 albedo)
{
  if (!bounces_between_facets(lobe)) {
    return vec3(1.0);
  }
  /* Of the lobe by itself, whatever its share in the material. */
  float whole = 1.0 / max(lobe.specular_share, 1e-6);
#ifdef HAS_DIP
  vec3 Fss = mean_reflectance(lobe.f0 * whole, lobe.f90 * whole, lobe.dip * whole);
#else
  vec3 Fss = mean_reflectance(lobe.f0 * whole, lobe.f90 * whole, vec3(0.0));
#endif
  float layer = lobe.dielectric * whole;
  if (layer <= 0.0 || layer >= 0.999) {
    return multiscatter_of(Fss, albedo);
  }
  /* Part of it is a dielectric, and what is left a metal: light bounces in each by itself. */
  vec3 layer_Fss = mean_reflectance(vec3(lobe.layer.x), vec3(lobe.layer.y), vec3(0.0));
  vec3 of_layer = min(layer * layer_Fss, Fss);
  vec3 of_metal = Fss - of_layer;
  return (of_layer * multiscatter_of(layer_Fss, albedo) +
          of_metal * multiscatter_of(min(of_metal / (1.0 - layer), vec3(1.0)), albedo)) /
         max(Fss, vec3(1e-20));
}

/* Schlick's and the dielectric's share of the split sum, of the layer of a lobe. */
vec2 grazing_albedo(Lobe lobe, float mu, vec4 albedo)
{
  float dielectric = albedo.y;
  if (lobe.layer.y > 0.0) {
    dielectric = dielectric_albedo(mu, lobe.roughness, layer_ratio(lobe.layer)) * albedo.x;
  }
  return vec2(albedo.y, dielectric);
}

/* The directional albedo of the specular lobe, bounces between facets included. */
vec3 specular_albedo(Lobe lobe, float mu, vec4 albedo)
{
  vec2 grazing = grazing_albedo(lobe, mu, albedo);
  vec3 single = lobe.f0 * (albedo.x - grazing.x) + lobe.f90 * grazing.x +
                vec3(lobe.dielectric * (lobe.layer.y - lobe.layer.x) * (grazing.y - grazing.x)) -
                edge_tint(lobe, mu) * albedo.x;
  return max(single, vec3(0.0)) * lobe_multiscatter(lobe, albedo);
}

/* The share of light that the dielectric layer lets through to the diffuse base and back. */
float layer_transmission(Lobe lobe, float mu, vec4 albedo)
{
  vec2 grazing = grazing_albedo(lobe, mu, albedo);
  float single = lobe.layer.x * (albedo.x - grazing.y) + lobe.layer.y * grazing.y;
  float kept = single * multiscatter(vec3(lobe.layer.x), vec3(lobe.layer.y), vec3(0.0), albedo).x;
  return clamp(1.0 - kept, 0.0, 1.0);
}

/* The shading normal, turned towards the geometric one until the mirrored view direction clears
 * the surface, as Cycles does for specular lobes (maybe_ensure_valid_specular_reflection).
 * With a = angle(N, Ng) in their plane and V there at angle phi and length r, the mirrored
 * direction's height is r cos(2 a - phi); Cycles asks for min(0.9 NgoV, 0.01). */
vec3 specular_normal(vec3 N, vec3 Ng, vec3 V)
{
  float NgoV = dot(Ng, V);
  float threshold = min(0.9 * NgoV, 0.01);
  float height = 2.0 * dot(N, V) * dot(N, Ng) - NgoV;
  vec3 side = N - dot(N, Ng) * Ng;
  float length_sq = dot(side, side);
  if (NgoV <= 0.0 || height >= threshold || length_sq <= 0.0) {
    return N;
  }
  vec3 X = side * inversesqrt(length_sq);
  vec2 in_plane = vec2(dot(V, X), NgoV);
  float r = length(in_plane);
  float angle = 0.5 * (atan(in_plane.x, in_plane.y) + acos(clamp(threshold / r, -1.0, 1.0)));
  return sin(angle) * X + cos(angle) * Ng;
}

/* Squared alpha of a lobe as the directions see it: of an anisotropic one, what an isotropic lobe
 * would need for the same slope of H, and for the same masking of V and L (Heitz 2014, eq. 80).
 * `stretch` is that of H over the product of both axes' alphas, by which the densities differ. */
struct Alphas {
  float half_sq;
  float view_sq;
  float light_sq;
  float stretch;
};

Alphas lobe_alphas(Lobe lobe, vec3 N, vec3 V, vec3 L, vec3 H)
{
  float alpha = lobe.roughness * lobe.roughness;
  float alpha_sq = alpha * alpha;
  Alphas a = Alphas(alpha_sq, alpha_sq, alpha_sq, 1.0);
#ifdef HAS_ASPECT
  vec3 Y = cross(N, lobe.tangent);
  float length_sq = dot(Y, Y);
  if (lobe.aspect == 1.0 || length_sq <= 0.0) {
    return a;
  }
  Y *= inversesqrt(length_sq);
  vec3 X = cross(Y, N);
  float wide = 1.0 / (lobe.aspect * lobe.aspect);
  vec2 axes = vec2(wide, 1.0 / wide); /* of alpha_x^2 and alpha_y^2, over alpha^2 */
  vec2 h = vec2(dot(H, X), dot(H, Y));
  vec2 v = vec2(dot(V, X), dot(V, Y));
  vec2 l = vec2(dot(L, X), dot(L, Y));
  h *= h;
  v *= v;
  l *= l;
  float sum_h = h.x + h.y;
  a.stretch = sum_h > 0.0 ? sum_h / dot(h, axes.yx) : 1.0; /* 1 / axes = axes.yx */
  a.half_sq *= a.stretch;
  a.view_sq *= v.x + v.y > 0.0 ? dot(v, axes) / (v.x + v.y) : 1.0;
  a.light_sq *= l.x + l.y > 0.0 ? dot(l, axes) / (l.x + l.y) : 1.0;
#endif
  return a;
}

/* The microfacet lobe with Fresnel, times NoL. `cell_sq` is the squared angular radius of the part
 * of the light that L stands for. */
vec3 specular_lobe(Lobe lobe, vec3 N, vec3 V, vec3 L, float cell_sq, vec4 albedo)
{
  float NoV = dot(N, V);
  float NoL = dot(N, L);
  float alpha = lobe.roughness * lobe.roughness;
  float alpha_sq = alpha * alpha;
  if (NoV <= 0.0 || NoL <= 0.0 || (alpha_sq <= MIRROR_ALPHA_SQ && cell_sq <= 0.0)) {
    return vec3(0.0);
  }
  vec3 half_vector = L + V;
  float half_length = length(half_vector);
  if (half_length <= 0.0) {
    return vec3(0.0);
  }
  vec3 H = half_vector / half_length;
  /* The same as dot(L, H), which has no digits left where L and V are almost opposite. */
  float LoH = 0.5 * half_length;
  /* Walter et al. 2007, eq. 14: solid angles shrink by 4 LoH from L to H. */
  float disk_sq = cell_sq / (4.0 * LoH);
  vec3 F = lobe_fresnel(lobe, LoH);
  Alphas a = lobe_alphas(lobe, N, V, L, H);
#ifdef HAS_DISTRIBUTION
  if (lobe.distribution > 5.5) {
    return F * cook_torrance(N, V, L, H, LoH, alpha_sq, disk_sq);
  }
  if (lobe.distribution > 3.5) {
    return F * phong_or_blinn(lobe.distribution < 4.5, N, V, L, H, alpha_sq, cell_sq);
  }
  if (lobe.distribution > 2.5) {
    float wide = 0.5 * disk_sq;
    float n = 2.0 / (a.half_sq + wide) - 2.0;
    /* Of the axes' exponents n_x and n_y, sqrt((n_x + 1)(n_y + 1)). */
    float ratio_sq = lobe.aspect * lobe.aspect;
    float norm = sqrt(max(2.0 / (alpha_sq / ratio_sq + wide) - 1.0, 0.0) *
                      max(2.0 / (alpha_sq * ratio_sq + wide) - 1.0, 0.0));
    return F * ashikhmin_shirley(N, V, L, H, LoH, n, norm);
  }
  if (lobe.distribution > 1.5) {
    float masked = 1.0 + lambda_beckmann(NoV, a.view_sq) + lambda_beckmann(NoL, a.light_sq);
    return F * (a.stretch * D_beckmann(N, H, a.half_sq, disk_sq) / (4.0 * NoV * masked));
  }
#endif
  float visible = 1.0 + lambda_ggx(NoV, a.view_sq) + lambda_ggx(NoL, a.light_sq);
  /* D G F / (4 NoV NoL) * NoL */
  return F * lobe_multiscatter(lobe, albedo) *
         (a.stretch * D_ggx(N, H, a.half_sq, disk_sq) / (4.0 * NoV * visible));
}
