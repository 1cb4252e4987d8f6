# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights the view's surfaces: for each light a shadow and one fragment pass.

In: a `SurfaceBuffer`, `Light`s and a `World`. Out: light layers, scene-linear, and their sum.
A picture is a mean over samples: sample k sees each light from one point of it, with the hard
shadow of that point, so that the mean converges to Cycles' soft light. By what they are about:

    session, picture           the one object that all others ask, and what it gives
    frame_graph, frame_passes  what depends on what; light_edit: which parts of a light changed
    layer_*, light_mix         layers, their stages, samples and sum (sum_pass, blend_pass, fence)
    light_*, mesh_lights       a light's points and cells, its pass, and what it lights
    *_filter(s), barn_doors, distance, slide, noise, blockers, profile
                               what stands in the beam, and what lights' own nodes emit
    shadow*, traced_shadow     shadow maps and traced rays
    world_*, environment*      the world behind the scene, and its light
    edits, control_edits, surface_edits_file
                               EDITS.json and SURFACES.json

Only modules named `*_pass` import gpu; others draw through them and addon/glsl/.
"""
