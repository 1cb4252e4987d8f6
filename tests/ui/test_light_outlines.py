# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines that show a light's controls lie where the light ends."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from addon.scene.depsgraph_reader import viewport_depsgraph
from addon.scene.light_controls import Superellipse
from addon.scene.light_reader import read_lights
from addon.ui.light_outlines import light_lines, outline_points
from tests.reference.light_filters import light_filters, superellipse


@pytest.mark.parametrize("roundness", [0.01, 0.2, 1.0, 2.0, 5.0])
def test_points_are_on_the_outline(extension: None, roundness: float) -> None:
    doors: Any = bpy.data.objects["Light"].data.relume.barn_doors
    doors.width, doors.height, doors.roundness = 2.0, 0.5, roundness
    points = outline_points(doors)
    outline = Superellipse(2.0, 0.5, roundness=roundness)
    # A star's arms are so thin that rounding leaves them; 0.999 of the way is inside.
    inside, outside = superellipse(outline, 0.999 * points), superellipse(outline, 1.001 * points)
    assert inside.mean() > 0.99
    assert outside.mean() < 0.01
    np.testing.assert_allclose(points[0], points[-1], atol=1e-9)


@pytest.mark.parametrize("kind", ["SPOT", "SUN"])
def test_lines_are_where_the_light_ends(extension: None, kind: str) -> None:
    obj: Any = bpy.data.objects["Light"]
    obj.data.type = kind
    obj.scale = (2.0, 0.5, 1.5)
    doors = obj.data.relume.barn_doors
    doors.use, doors.shear, doors.rotation = True, (0.3, -0.2), 0.7
    card = bpy.data.objects.new("Card", None)
    card.location, card.rotation_euler, card.scale = (1, 2, 3), (0.3, 0.2, 0.1), (0.5, 0.2, 1)
    bpy.context.scene.collection.objects.link(card)
    obj.data.relume.blockers.add().object = card
    bpy.context.view_layer.update()
    lines = [points for points, _ in light_lines(obj)]
    # The doors (a sun's at two depths), their four edges, and the card.
    assert len(lines) == (7 if kind == "SUN" else 6)
    obj.data.relume.blockers[0].use = False
    bpy.context.view_layer.update()
    (light,) = read_lights(viewport_depsgraph(bpy.context.scene))
    opening = lines[1] if kind == "SUN" else lines[0]
    middle = opening[:-1].mean(axis=0)
    for share, want in ((0.98, 1.0), (1.02, 0.0)):
        seen = light_filters(light, middle + share * (opening - middle))
        np.testing.assert_array_equal(seen, want)
    np.testing.assert_allclose(lines[-1].mean(axis=0)[2], 3.0, atol=0.02)
