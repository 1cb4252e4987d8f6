/* SPDX-License-Identifier: GPL-3.0-or-later
 * What a tile of the view sees, bounded: a box for its points, a cone for its normals. Needs:
 * tolerances.glsl. */

/* The box's axes are the cone's axis, the way along the surface toward the eye, and a third across
 * both: a flat tile's box has no thickness, and a grazing one's is long one way. Points are
 * bounded by their parts along the axes, low to high. */
struct TileBounds {
  vec3 axes[3];
  vec3 low;
  vec3 high;
  /* Of the greatest angle between the first axis and a normal. */
  float cosine;
};

/* A number that is greater than every score, and no infinity, which some drivers do not keep. */
const float ABOVE_SCORES = 3.0e38;

/* Points are sums of three products, each rounded, and so is the place of what they are held
 * against; a bound is some more operations from there. */
const float BOUND_ROUNDING = 8.0 * FLOAT_SPACING;
