# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds for every pixel of the view the cached texel to read.

In: `SceneGeometry`, a `View` and the baked `DeepFramebuffer`s. Out: the `CorrespondenceMap`
and, read through it, the view's own `SurfaceBuffer`, which is all that `relight/` shades.
"""
