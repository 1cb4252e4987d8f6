# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights the view's surfaces: for each light a shadow and one fragment pass.

In: a `SurfaceBuffer`, `Light`s and a `World`. Out: light layers, scene-linear, and their sum.
A picture is a mean over samples: sample k sees each light from one point of it (`light_sample`),
with the hard shadow of that point (`shadow_pass`), so that the mean converges to Cycles' soft
light. Only the modules named `*_pass` import gpu.
"""
