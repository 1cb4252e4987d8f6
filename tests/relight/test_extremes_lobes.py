# SPDX-License-Identifier: GPL-3.0-or-later
"""Every lobe from a mirror to chalk, seen and lit down to 1e-7 above the surface, and almost
against the light, against the float64 twin within the bound of `extremes`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from tests.reference import light_pass as twin
from tests.reference.surfaces import Surfaces

from .extremes import Array, Lamps, around, exact, held, unit

pytestmark = pytest.mark.usefixtures("gpu_context")

SIZE = 24
LIGHT = Light("l", "POINT", np.eye(4), 4.0 * np.pi, np.ones(3))
SAMPLE = light_sample(LIGHT, 0, 1)
DISTRIBUTIONS = (
    "multiscatter GGX", "GGX", "Beckmann", "Ashikhmin-Shirley", "Phong", "Blinn", "Cook-Torrance",
)  # fmt: skip


def opposite(seed: int) -> Array:
    """(SIZE, SIZE, 3) directions of places that are lit from almost behind, seen from the eye."""
    rng = np.random.default_rng(seed)
    eye = unit(np.array([0.3, -0.5, 0.8]))
    off = 10.0 ** rng.uniform(-6.0, -1.0, (SIZE, SIZE, 1))
    return unit(eye + off * rng.normal(size=(SIZE, SIZE, 3)))


SURFACES = {
    "all around": around(3, SIZE, distances=np.ones(1)),
    "against the light": around(4, SIZE, distances=np.ones(1), toward=opposite(4)),
    "with the light": around(5, SIZE, distances=np.ones(1), toward=-opposite(5)),
}


def with_fields(surface: Surfaces, **fields: Any) -> Surfaces:
    shape = surface.position.shape[:2]
    channels = {
        name: exact(np.broadcast_to(np.asarray(value, dtype=np.float64), (*shape, np.size(value))))
        if np.ndim(value) < 3
        else exact(value)
        for name, value in fields.items()
    }
    return replace(surface, channels={**surface.channels, **channels})


def check(surface: Surfaces, edges: float = 0.0) -> Array:
    rule = held(lambda moved: twin.light_layer(moved, LIGHT, SAMPLE), surface)
    got = Lamps(surface).drawn(LIGHT, SAMPLE)
    rule.assert_holds(got, edges=edges)
    return got


@pytest.mark.parametrize("name", SURFACES)
def test_distributions(name: str) -> None:
    """All in one picture, stretched and round. A rounding turns the exponential of a narrow lobe's
    tail into several times as much, which a dozen draws may miss: in one pixel in 300."""
    surface = SURFACES[name]
    rng = np.random.default_rng(1)
    one = (SIZE, SIZE, 1)
    N = surface.geometric_normal[..., :3]
    got = check(
        with_fields(
            surface,
            distribution=rng.integers(0, len(DISTRIBUTIONS), one).astype(np.float64),
            aspect=rng.choice([1.0, 0.1, 10.0], one),
            tangent=unit(np.cross(N, rng.normal(size=N.shape))),
            specular_share=1.0 - 0.9 * rng.random(one),
        ),
        edges=1.0 / 300.0,
    )
    assert got.any()


@pytest.mark.parametrize("name", SURFACES)
def test_diffuse_bases(name: str) -> None:
    """Rough, Minnaert's, translucent and with sheen."""
    surface = SURFACES[name]
    rng = np.random.default_rng(2)
    one = (SIZE, SIZE, 1)
    got = check(
        with_fields(
            surface,
            diffuse_roughness=rng.choice([0.0, 1e-4, 0.5, 1.0], one),
            diffuse_model=rng.integers(0, 2, one).astype(np.float64),
            diffuse_share=1.0 - 0.9 * rng.random(one),
            translucent_color=rng.random((SIZE, SIZE, 3)),
            sheen_color=rng.random((SIZE, SIZE, 3)),
            sheen_roughness=rng.choice([0.0, 0.1, 0.5, 1.0], one),
        )
    )
    assert got.any()


@pytest.mark.parametrize("name", SURFACES)
def test_weights_by_the_view(name: str) -> None:
    """Fresnel, facing, a coat's and a sheen's albedo, of no and of every reflectance."""
    surface = SURFACES[name]
    rng = np.random.default_rng(3)
    one = (SIZE, SIZE, 1)
    got = check(
        with_fields(
            surface,
            view_base=rng.random(one),
            view_slope=rng.random(one),
            view_curve=rng.integers(0, 5, one).astype(np.float64),
            view_parameter=rng.choice([0.0, 1e-4, 0.04, 0.9], one),
            view_roughness=rng.choice([0.0, 0.1, 1.0], one),
            sheen_color=rng.random((SIZE, SIZE, 3)),
        )
    )
    assert got.any()


@pytest.mark.parametrize("factor", [1e-9, 1e9])
def test_colours_of_every_size(factor: float) -> None:
    """A lobe's light goes with its colour, however dark or bright."""
    surface = SURFACES["all around"]
    plain = surface.without("specular_f0", "specular_f90", "layer_f0", "layer_f90", "dielectric")
    bright = replace(
        plain,
        channels={
            **plain.channels, "diffuse_color": exact(plain.channels["diffuse_color"] * factor)
        },
    )  # fmt: skip
    check(bright)
