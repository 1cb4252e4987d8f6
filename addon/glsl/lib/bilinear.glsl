/* SPDX-License-Identifier: GPL-3.0-or-later
 * Between the nodes of a table. Read with texelFetch and mixed here, so that every driver mixes in
 * full precision. */

/* The mean of the node `low` and of those one to the right and up, at t in [0, 1]. A macro, because
 * a function's parameter can't be a sampler on every back end. */
#define MIXED_NODES(table, low, t) \
  mix(mix(texelFetch(table, low, 0), texelFetch(table, (low) + ivec2(1, 0), 0), (t).x), \
      mix(texelFetch(table, (low) + ivec2(0, 1), 0), \
          texelFetch(table, (low) + ivec2(1, 1), 0), \
          (t).x), \
      (t).y)
