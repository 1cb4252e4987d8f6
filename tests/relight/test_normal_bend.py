# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights of surfaces whose normals turn within what a sample stands for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from addon.relight.light_points.light_sample import light_sample
from tests.reference import light_pass as twin
from tests.reference.surfaces import Surfaces, random_surfaces

from .drawing import drawn_light
from .test_passes import LIGHTS, OF_CELLS, assert_close


def bent(surface: Surfaces) -> Surfaces:
    """By up to half a radian, some by much less than their lobes are wide, some along one
    direction only."""
    rng = np.random.default_rng(6)
    shape = surface.hit.shape
    way = np.cross(surface.channel("normal"), rng.normal(size=(*shape, 3)))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    size = 10.0 ** rng.uniform(-5.0, -0.3, (*shape, 1))
    across = size * rng.random((*shape, 1)) * (rng.random((*shape, 1)) < 0.5)
    bend = np.concatenate([size * way, across], axis=-1)
    return replace(surface, bend=bend.astype(np.float32).astype(np.float64))


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("name", ["spot, soft", "sun, wide", "area, spread"])
def test_light_pass(name: str, lobes: int) -> None:
    surface = bent(random_surfaces(9, lobes=lobes))
    sample = light_sample(LIGHTS[name], 2, 7)
    got = drawn_light(surface, LIGHTS[name], [sample])[..., :3]
    assert_close(got, twin.light_layer(surface, LIGHTS[name], sample), *OF_CELLS)
    flat = twin.light_layer(replace(surface, bend=None), LIGHTS[name], sample)
    # Most of what is seen is diffuse, and most bends are small: but not for nothing.
    assert (np.abs(got - flat) > 0.1 * flat.max(axis=-1, keepdims=True)).any(axis=-1).mean() > 0.01
