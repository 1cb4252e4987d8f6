/* SPDX-License-Identifier: GPL-3.0-or-later
 * The diffuse base of a lobe. Needs angle.glsl. */

#ifdef HAS_ROUGH_DIFFUSE
/* The integral that gives the albedo of Fujii's improved Oren-Nayar model, as Cycles has it
 * (bsdf_oren_nayar.h): E(mu) = pi a + b G(mu). Its (1 - s^3) / mu, of the sine s, is
 * mu (1 + s + s^2) / (1 + s), which has its digits at grazing angles too. */
float oren_nayar_G(float mu)
{
  float sine = sqrt(max(1.0 - mu * mu, 0.0));
  float theta = upper_angle(sine, mu);
  return sine * (theta - 2.0 / 3.0 - sine * mu) +
         2.0 / 3.0 * sine * mu * (1.0 + sine + sine * sine) / (1.0 + sine);
}

/* Fujii's model with the light that bounces between facets after OpenPBR, without the colour and
 * times NoL. The bounces' colour is that of the base by itself, whatever its share in the material. */
vec3 oren_nayar(Lobe lobe, vec3 V, vec3 L, float NoL)
{
  float sigma = clamp(lobe.diffuse_roughness, 0.0, 1.0);
  float a = 1.0 / (PI + sigma * (0.5 * PI - 2.0 / 3.0));
  float b = sigma * a;
  float NoV = max(dot(lobe.N, V), 0.0);
  float t = dot(L, V) - NoL * NoV;
  if (t > 0.0) {
    t /= max(NoL, NoV) + 1e-37;
  }
  vec3 albedo = clamp(lobe.diffuse_color / max(lobe.diffuse_share, 1e-6), vec3(0.0), vec3(1.0));
  float E_mean = a * PI + (2.0 * PI - 5.6) / 3.0 * b;
  vec3 bounced = albedo * albedo * (E_mean / (PI * (1.0 - E_mean))) /
                 (vec3(1.0) - albedo * (1.0 - E_mean));
  float E_view = a * PI + b * oren_nayar_G(NoV);
  float E_light = a * PI + b * oren_nayar_G(NoL);
  return NoL * (vec3(a + b * t) + bounced * ((1.0 - E_view) * (1.0 - E_light)));
}
#endif

#ifdef HAS_DIFFUSE_MODEL
/* Minnaert, The reciprocity principle in lunar photometry (1941), times NoL, with the factor that
 * keeps the albedo at normal view: (k + 1) / (2 pi). With k below 1 it has a pole at grazing view,
 * which starts at a hundredth. */
float minnaert(Lobe lobe, vec3 V, float NoL)
{
  float k = lobe.diffuse_roughness;
  float NoV = max(dot(lobe.N, V), 0.01);
  return NoL > 0.0 ? (k + 1.0) / (2.0 * PI) * pow(NoL * NoV, k - 1.0) * NoL : 0.0;
}
#endif

/* The diffuse base times NoL, without its layer. */
vec3 diffuse_base(Lobe lobe, vec3 V, vec3 L)
{
  float NoL = max(dot(lobe.N, L), 0.0);
#ifdef HAS_DIFFUSE_MODEL
  if (lobe.diffuse_model > 0.5) {
    return lobe.diffuse_color * minnaert(lobe, V, NoL);
  }
#endif
#ifdef HAS_ROUGH_DIFFUSE
  if (lobe.diffuse_roughness > 1e-5) { /* Cycles' own threshold */
    return lobe.diffuse_color * oren_nayar(lobe, V, L, NoL);
  }
#endif
  return lobe.diffuse_color * (NoL / PI);
}

/* Whether the diffuse base sends light evenly, whatever the viewer's place. */
bool is_lambert(Lobe lobe)
{
#ifdef HAS_DIFFUSE_MODEL
  if (lobe.diffuse_model > 0.5) {
    return false;
  }
#endif
#ifdef HAS_ROUGH_DIFFUSE
  if (lobe.diffuse_roughness > 1e-5) {
    return false;
  }
#endif
  return true;
}
