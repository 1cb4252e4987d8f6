/* SPDX-License-Identifier: GPL-3.0-or-later
 * The nearest sheer triangle of each pixel behind the last one and before what is opaque, and what
 * it lets through: one step of depth peeling (C. Everitt, "Interactive Order-Independent
 * Transparency", 2001). */
void main()
{
  /* The same triangle has the same depth at every step. */
  float share = view_depth();
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (share <= texelFetch(last_depth, pixel, 0).r || share >= texelFetch(opaque_depth, pixel, 0).r) {
    discard;
  }
  gl_FragDepth = share;
  visible_triangle = surface_code();
  let_through = vec4(transmission(surface_uv), 1.0);
}
