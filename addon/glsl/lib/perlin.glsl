/* SPDX-License-Identifier: GPL-3.0-or-later
 * Blender's Noise Texture in 3D: K. Perlin, Improving Noise (2002), on a hash by B. Jenkins
 * (lookup3, http://burtleburtle.net/bob/c/lookup3.c), with Cycles' scales (src/kernel/svm/noise.h
 * and fractal_noise.h). */

uint rotated_left(uint x, uint bits)
{
  return (x << bits) | (x >> (32u - bits));
}

/* lookup3's `final` of three words. */
uint lattice_hash(ivec3 cell)
{
  const uint start = 0xdeadbeefu + (3u << 2u) + 13u;
  uint a = start + uint(cell.x);
  uint b = start + uint(cell.y);
  uint c = start + uint(cell.z);
  c = (c ^ b) - rotated_left(b, 14u);
  a = (a ^ c) - rotated_left(c, 11u);
  b = (b ^ a) - rotated_left(a, 25u);
  c = (c ^ b) - rotated_left(b, 16u);
  a = (a ^ c) - rotated_left(c, 4u);
  b = (b ^ a) - rotated_left(a, 14u);
  return (c ^ b) - rotated_left(b, 24u);
}

/* A slope out of twelve directions, at p from a lattice point. */
float lattice_slope(ivec3 cell, vec3 p)
{
  uint h = lattice_hash(cell) & 15u;
  float u = h < 8u ? p.x : p.y;
  float v = h < 4u ? p.y : (h == 12u || h == 14u ? p.x : p.z);
  return ((h & 1u) != 0u ? -u : u) + ((h & 2u) != 0u ? -v : v);
}

float perlin(vec3 p)
{
  vec3 low = floor(p);
  ivec3 cell = ivec3(low);
  vec3 f = p - low;
  vec3 s = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
  float corner[8];
  for (int i = 0; i < 8; i++) {
    ivec3 step = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    corner[i] = lattice_slope(cell + step, f - vec3(step));
  }
  float near = mix(mix(corner[0], corner[1], s.x), mix(corner[2], corner[3], s.x), s.y);
  float far = mix(mix(corner[4], corner[5], s.x), mix(corner[6], corner[7], s.x), s.y);
  return mix(near, far, s.z);
}

/* About -1 to 1. Repeats after 100,000 units, and lies between the lattice points far out. */
float signed_noise(vec3 p)
{
  vec3 between = 0.5 * vec3(greaterThanEqual(abs(p), vec3(1e6)));
  return 0.982 * perlin(p - 1e5 * trunc(p / 1e5) + between);
}

/* Factor of a normalized fBM of lacunarity 2, about 0 to 1. */
float noise_texture(vec3 p, float detail, float roughness)
{
  float sum = 0.0;
  float amplitude = 1.0;
  float most = 0.0;
  float rest = detail - floor(detail);
  int octaves = int(detail) + 1;
  for (int i = 0; i < octaves; i++) {
    sum += amplitude * signed_noise(p);
    most += amplitude;
    amplitude *= roughness;
    p *= 2.0;
  }
  float result = sum / most;
  if (rest > 0.0) {
    float next = (sum + amplitude * signed_noise(p)) / (most + amplitude);
    result = mix(result, next, rest);
  }
  return 0.5 * result + 0.5;
}
