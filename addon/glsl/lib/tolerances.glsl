/* SPDX-License-Identifier: GPL-3.0-or-later
 * Every tolerance of the shaders, with its reason. None is a length. */

/* Spacing of float32 numbers just above one. */
const float FLOAT_SPACING = 1.1920929e-7;

/* A position went through a matrix product or two in float32: three products and three sums
 * each, every one rounded by at most half a spacing of the largest term. */
const float POSITION_ROUNDING = 8.0 * FLOAT_SPACING;

/* How far a cached texel may lie from the tangent plane of the pixel's point and still be the
 * same surface, in widths of a texel seen head on. On a plane the distance is zero wherever
 * the texel lies; half a width admits surfaces that curve or bend by up to about 25 degrees
 * from one texel to the next, and keeps apart whatever is further. */
const float SAME_SURFACE_TEXELS = 0.5;

/* A caching camera sees a point when at least this share of the bilinear footprint lies on the
 * point's own surface. Near a silhouette a quarter (one of four texels) is what is left. */
const float VISIBLE_SHARE = 0.2;

/* A cached shading normal belongs to the pixel's own surface when its cosine to the triangle's
 * normal is above this: smooth shading and bump maps stay well inside, and the other side of a
 * right-angled edge outside. Where nothing better is near, other texels are read all the same. */
const float SAME_FACING = 0.2;
