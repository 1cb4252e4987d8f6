/* SPDX-License-Identifier: GPL-3.0-or-later
 * Where each shading sample is shaded for one sample of the view: where its cell's hit is, if that
 * is on its surface, else at its own place; one whose hits are kept, at these by turns. Rows above the picture hold the further samples. */
void main()
{
  ivec2 texel = ivec2(gl_FragCoord.xy);
  ivec2 cell = texel;
  if (texel.y >= hits.height) {
    cell = ivec2(texelFetch(sample_cell, texel - ivec2(0, hits.height), 0).xy);
  }
  vec4 own_position = texelFetch(sample_position, texel, 0);
  vec4 own_normal = texelFetch(sample_normal, texel, 0);
  surface_position = own_position;
  surface_geometric_normal = own_normal;
  surface_triangle = texelFetch(sample_triangle, texel, 0).xy;
#ifdef HAS_OWN_HITS
  ivec2 range = ivec2(texelFetch(hit_range, texel, 0).xy);
  if (range.y > 0) {
    /* Later visibility samples' hits were not kept. Those that were come twice; then hits are looked
     * for as of samples that have none of their own. */
    bool is_kept = hits.number / 2 < hits.looks;
#  ifdef OVER
    if (is_kept) {
      discard; /* it is written already */
    }
#  else
    ivec2 hit = row_texel(range.x + hits.number % range.y);
    surface_position = texelFetch(hit_position, hit, 0);
    surface_geometric_normal.xyz = texelFetch(hit_normal, hit, 0).xyz;
    surface_triangle = texelFetch(hit_triangle, hit, 0).xy;
    if (is_kept) {
      return;
    }
#  endif
  }
#endif
  vec4 p = texelFetch(visible_position, cell, 0);
  vec3 n = texelFetch(visible_normal, cell, 0).xyz;
#ifdef OF_LAYER
  if (p.w == 0.0) {
    discard;
  }
#endif
  bool is_hit = same_surface(own_position, own_normal.xyz, p, n);
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
