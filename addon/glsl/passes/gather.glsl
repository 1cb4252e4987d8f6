/* SPDX-License-Identifier: GPL-3.0-or-later
 * Reads the cache through the correspondence map, and fills what it left open. Texels of
 * another surface or material never bleed in. */

/* Texels blended so far. */
CachedSurface blended;
float blended_weight = 0.0;

void add_texel(int camera, ivec3 texel, float weight)
{
#ifdef HAS_SCALE_SHIFTS
  scale_shift = int(camera_picture(camera).z);
#endif
  add_surface(blended, read_cached(texel), weight);
  blended_weight += weight;
}

/* The texels of a footprint, and how surely each shows a local point p with normal n; of texels of
 * this material that face as n does alone, if there are any: at a border between materials or faces
 * the own one may fall between the texels. */
vec4 own_weights(int camera, Footprint footprint, vec3 p, vec3 n, float material, out ivec3 texel[4])
{
  vec3 q = camera_from_local(camera, p);
  vec3 n_camera = camera_axes(camera, n);
  vec4 weight = visible_weights(camera, footprint, q, n_camera, length(p) + length(q));
  vec4 own = weight;
  for (int i = 0; i < 4; i++) {
    texel[i] = page_texel(footprint.places[i], footprint.texel[i]);
    if (texel[i].z < 0) {
      weight[i] = 0.0;
      own[i] = 0.0;
      continue;
    }
    CachedSurface seen = read_identity(texel[i]);
    bool facing = dot(seen.normal, n) > SAME_FACING * length(seen.normal);
    if (abs(seen.material_id - material) > 0.5 || !facing) {
      own[i] = 0.0;
    }
  }
  return dot(own, vec4(1.0)) > 0.0 ? own : weight;
}

/* The cached surface at a correspondence; false when not even one texel fits. */
bool add_correspondence(vec4 found, vec3 p, vec3 n, float material)
{
  int camera = int(found.x);
  ivec3 texel[4];
  vec4 weight = own_weights(camera, bilinear_footprint(camera, found.yz), p, n, material, texel);
  for (int i = 0; i < 4; i++) {
    if (weight[i] > 0.0) {
      add_texel(camera, texel[i], weight[i]);
    }
  }
  return blended_weight > 0.0;
}

/* One- and two-pixel holes (paper III.3): the neighbours of the same material, the nearer the
 * heavier; on the same surface, else also beside it, as leaves lie. Of each the texel that shows its
 * place the most surely: what hides the hole may lie in the others. Which of the two it was: -1, -2,
 * or 0 where there are none. One loop with one place where a texel is read: where branches are not
 * skipped, as in software, all that is written down is run once for pixels that are no holes. */
float add_neighbours(ivec2 pixel, vec3 p, vec3 n, float material)
{
  ivec2 last = textureSize(correspondence, 0) - 1;
#ifdef HAS_CELLS
  /* Above the picture are samples of any of its cells; their neighbours are about these. */
  last.y -= textureSize(sample_cell, 0).y;
  if (pixel.y > last.y) {
    pixel = ivec2(texelFetch(sample_cell, pixel - ivec2(0, last.y + 1), 0).xy);
  }
#endif
  float origin = -1.0;
  for (int i = 0; i < 50; i++) {
    if (i == 25) {
      if (blended_weight > 0.0) {
        break;
      }
      origin = -2.0;
    }
    int place = i % 25;
    ivec2 away = ivec2(place % 5, place / 5) - 2;
    ivec2 other = pixel + away;
    if (other != clamp(other, ivec2(0), last)) {
      continue;
    }
    vec4 found = texelFetch(correspondence, other, 0);
    vec4 position = texelFetch(visible_position, other, 0);
    if (found.x < 0.0 || position.w != material) {
      continue;
    }
    vec3 apart = position.xyz - p;
    /* On the same surface, or one that bends by less than 30 degrees. */
    if (i < 25 && abs(dot(n, apart)) > 0.5 * length(apart)) {
      continue;
    }
    vec3 facing = texelFetch(visible_normal, other, 0).xyz;
    int camera = int(found.x);
    Footprint footprint = bilinear_footprint(camera, found.yz);
    ivec3 texel[4];
    vec4 weight = own_weights(camera, footprint, position.xyz, facing, material, texel);
    int surest = 0;
    for (int k = 1; k < 4; k++) {
      surest = weight[k] > weight[surest] ? k : surest;
    }
    if (weight[surest] > 0.0) {
      int squared = away.x * away.x + away.y * away.y;
      add_texel(camera, texel[surest], 1.0 / float(max(squared, 1)));
    }
  }
  return blended_weight > 0.0 ? origin : 0.0;
}

void main()
{
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 position = texelFetch(visible_position, pixel, 0);
  surface_geometric_normal = vec4(0.0);
  clear_surface(blended);
  write_values(blended, 0, vec3(0.0));
  if (position.w == 0.0) {
    return;
  }
  vec3 n = texelFetch(visible_normal, pixel, 0).xyz;
  float material = position.w;
  vec4 found = texelFetch(correspondence, pixel, 0);
  /* w tells how the pixel came by its values: > 0 the score, -1 neighbours on its surface, -2
   * neighbours beside it, 0 its material. */
  float origin = 0.0;
  if (found.x >= 0.0 && add_correspondence(found, position.xyz, n, material)) {
    origin = found.w;
  }
  else {
    origin = add_neighbours(pixel, position.xyz, n, material);
    if (origin == -2.0) {
      /* Those lie otherwise in space. */
      forget_directions(blended);
    }
  }
  surface_geometric_normal = vec4(n, origin);
#ifdef HAS_CORNER_NORMALS
  vec3 N = texelFetch(visible_shading_normal, pixel, 0).xyz;
#else
  vec3 N = n;
#endif
  if (blended_weight > 0.0) {
    CachedSurface mean;
    clear_surface(mean);
    add_surface(mean, blended, 1.0 / blended_weight);
    /* Opposite normals may cancel; the mesh's own is then the best there is. */
    write_values(mean, int(material), N);
  }
  else {
    write_means(int(material), N);
  }
}
