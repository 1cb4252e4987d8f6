# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights the view's surfaces: for each light a shadow and one fragment pass.

In: a `SurfaceBuffer`, `Light`s and a `World`. Out: light layers, scene-linear, and their sum.
A picture is a mean over samples: sample k sees each light from one point of it, with the hard
shadow of that point, so that the mean converges to Cycles' soft light.

    session    the one object that all others ask
    edits/     EDITS.json and SURFACES.json
    graph/     what depends on what, and what an edit makes dirty
    layers/    layers, their stages, samples and sum; the picture
    world/     the world behind the scene, and its light
    shadows/   shadow maps and traced rays
    lights/    a light's pass, its shape, what it lights; objects that glow
    filters/   what stands in the beam, and what lights' own nodes emit
    light_points/
               the point or cell of a light that a sample sees
    shading/   what all passes that shade surfaces share

Only modules named `*_pass` import gpu; others draw through them and addon/glsl/.
"""
