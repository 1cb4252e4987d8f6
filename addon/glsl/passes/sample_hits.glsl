/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where each shading sample is shaded for one sample of the view: where its cell's hit is, if that
 * is on its surface, else at its own place; one that serves a single pixel, at what that hits of it,
 * by turns. Rows above the picture hold the further samples. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  ivec2 cell = texel;
  if (texel.y >= hits.height) {
    cell = ivec2(texelFetch(sample_cell, texel - ivec2(0, hits.height), 0).xy);
  }
  surface_position = texelFetch(sample_position, texel, 0);
  surface_geometric_normal = texelFetch(sample_normal, texel, 0);
  surface_triangle = texelFetch(sample_triangle, texel, 0).xy;
#ifdef HAS_OWN_HITS
  ivec2 range = ivec2(texelFetch(hit_range, texel, 0).xy + vec2(0.5));
  if (range.y > 0) {
#  ifdef OVER
    discard; /* it is written already */
#  endif
    int number = range.x + hits.number % range.y;
    ivec2 hit = row_texel(number);
    surface_position = texelFetch(hit_position, hit, 0);
    surface_geometric_normal.xyz = texelFetch(hit_normal, hit, 0).xyz;
    surface_triangle = texelFetch(hit_triangle, hit, 0).xy;
    return;
  }
#endif
  vec4 p = texelFetch(visible_position, cell, 0);
  vec3 n = texelFetch(visible_normal, cell, 0).xyz;
#ifdef OF_LAYER
  if (p.w == 0.0) {
    discard;
  }
#endif
  bool is_hit = same_surface(surface_position, surface_geometric_normal.xyz, p, n);
#ifdef OVER
  if (!is_hit) {
    discard;
  }
#endif
  vec2 film = vec2(cell) + vec2(0.5);
  if (is_hit) {
    surface_position = p;
    surface_geometric_normal.xyz = n;
    surface_triangle = texelFetch(visible_triangle, cell, 0).xy;
    film += hits.offset;
  }
  if (surface_position.w == 0.0) {
    /* The background lies in a direction. */
    surface_position.xy = film;
  }
}
