# SPDX-License-Identifier: GPL-3.0-or-later
"""Every filter of a light against its float64 twin, through the light pass."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.relight.filters.light_filters import LightFilters
from addon.relight.light_points.light_sample import light_sample
from addon.scene.light import Light
from addon.scene.light_controls import (
    NEUTRAL,
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    Slide,
    Superellipse,
)
from tests.reference.light_filters import light_filters, superellipse
from tests.reference.surfaces import surfaces
from tests.synthetic import looking_at

from .drawing import drawn_light

pytestmark = pytest.mark.usefixtures("gpu_context")

Array = NDArray[np.float64]
SIDE = 64


def light_of(kind: Any, controls: LightControls, place: Array | None = None) -> Light:
    world_from_light = looking_at((0.3, -0.2, 2.0), (0.1, 0.4, -1.0)) if place is None else place
    return Light("l", kind, world_from_light, 1.0, np.ones(3), controls=controls)


def through(light: Light, place: Array) -> Array:
    """(H, W, 3) what the light's controls let through to world-space places, as drawn."""
    toward = -light.direction if light.type == "SUN" else light.position - place
    toward = np.broadcast_to(toward, place.shape)
    normal = toward / np.maximum(np.linalg.norm(toward, axis=-1, keepdims=True), 1e-300)
    surface = surfaces(place, normal, eye=(0.0, 0.0, 0.0))
    surface = replace(surface, eye=light.position + normal[0, 0], perspective=True)
    sample = light_sample(light, 0, 1)
    plain = drawn_light(surface, replace(light, controls=NEUTRAL), [sample])[..., :3]
    got = drawn_light(surface, light, [sample])[..., :3]
    assert (plain > 0.0).all()
    assert np.isfinite(got).all()
    return got / plain


def places(light: Light, seed: int = 0, spread: float = 1.5) -> Array:
    """(SIDE, SIDE, 3) before, beside and behind a light, at many distances."""
    rng = np.random.default_rng(seed)
    q = rng.normal(size=(SIDE, SIDE, 3)) * (spread, spread, 1.0)
    # Not quite across: there a picture that repeats is read far out, where float32 is coarse.
    q[..., 2] = -(0.05 + np.abs(q[..., 2])) * rng.choice([1.0, 1.0, 1.0, -1.0], q.shape[:2])
    q *= np.exp(rng.normal(size=(SIDE, SIDE, 1)))
    return (light.position + q @ light.axes).astype(np.float32).astype(np.float64)


PIXELS = np.random.default_rng(1).random((5, 7, 4)).astype(np.float32)
CARD = looking_at((0.2, 0.1, 1.0), (0.0, 0.3, 3.0)) @ np.diag([0.5, 0.7, 0.0, 1.0])
DOORS = Superellipse(0.7, 0.4, 0.2, 0.5, 0.6)
CONTROLS = {
    "doors": LightControls(barn_doors=BarnDoors(DOORS, (0.3, -0.1), 0.4, 0.8)),
    "doors, inverted star": LightControls(
        barn_doors=BarnDoors(Superellipse(1.0, 1.5, 1.0, 0.7, 3.5), invert=True)
    ),
    "doors, hard": LightControls(barn_doors=BarnDoors(Superellipse(0.9, 0.8, roundness=0.01))),
    "doors, edge on one side": LightControls(
        barn_doors=BarnDoors(Superellipse(0.9, 0.8, 0.0, 0.5, 0.5))
    ),
    "distance": LightControls(distance=DistanceRange(0.8, 0.5, 2.0, 1.0)),
    "distance along the axis": LightControls(distance=DistanceRange(0.5, 0.0, 2.0, 0.5, True)),
    "distance, no near end": LightControls(distance=DistanceRange(far=1.0, along_axis=True)),
    "no falloff": LightControls(falloff=Falloff(0.0, 3.0)),
    "steep falloff": LightControls(falloff=Falloff(5.5, 0.5)),
    "cookie": LightControls(slide=Slide(PIXELS, "i", scale=(1.5, 1.2), rotation=0.3)),
    "slide": LightControls(
        slide=Slide(
            PIXELS, "i", "SLIDE", 0.7, (0.8, 0.5), (0.1, 0.2), -1.0, repeat=True, invert=True
        )
    ),
    "cookie without frame": LightControls(slide=Slide(PIXELS, "i", density=0.5, frame=False)),
    "noise": LightControls(noise=Noise(2.5, 3.0, 2.7, 0.6, (0.3, -2.0, 7.0))),
    "noise in space": LightControls(noise=Noise(1.0, 2.0, 4.0, projected=False)),
    "blockers": LightControls(
        blockers=(
            Blocker("a", CARD, Superellipse(1.0, 1.0, 0.3, 0.3, 0.5), 0.8, (1.0, 0.3, 0.1)),
            Blocker("b", np.eye(4), Superellipse(0.4, 0.6, 0.2, 0.0, 2.0), 0.5),
        )
    ),
    "window": LightControls(
        blockers=(Blocker("a", CARD, Superellipse(2.0, 2.0, 1.0, 1.0), invert=True),)
    ),
}  # fmt: skip
CONTROLS["all"] = LightControls(
    barn_doors=CONTROLS["doors"].barn_doors,
    distance=CONTROLS["distance"].distance,
    falloff=CONTROLS["no falloff"].falloff,
    slide=CONTROLS["slide"].slide,
    noise=CONTROLS["noise"].noise,
    blockers=CONTROLS["blockers"].blockers,
)


def assert_alike(got: Array, want: Array, *, has_slide: bool) -> None:
    """Float32 against float64: places are off by 1e-7 of their distance, which the steepest of
    these edges turns into a hundred times as much. A slide's texels have half precision, 2^-11.
    One place in 500 may lie on a hard edge."""
    tolerance = 2.0**-11 if has_slide else 2e-5
    off = np.abs(got - want) / np.maximum(np.abs(want), 1.0)
    wrong = (off > tolerance).any(axis=-1)
    assert wrong.mean() < 2e-3, f"{wrong.sum()} places, up to {off.max():g}"
    assert np.median(off) < 0.25 * tolerance


@pytest.mark.parametrize("kind", ["POINT", "SUN"])
@pytest.mark.parametrize("name", CONTROLS)
def test_filter(name: str, kind: str) -> None:
    light = light_of(kind, CONTROLS[name])
    place = places(light)
    want = light_filters(light, place)
    if not (kind == "SUN" and "falloff" in name):
        assert want.std() > 0.02, "the test shows nothing"
    assert_alike(through(light, place), want, has_slide=CONTROLS[name].slide is not None)


@pytest.mark.parametrize("name", CONTROLS)
def test_only_what_is_used_is_compiled(name: str) -> None:
    used = {each.name for each in LightFilters().of(light_of("POINT", CONTROLS[name]))}
    controls = CONTROLS[name]
    assert used == {
        key
        for key in ("barn_doors", "distance", "falloff", "slide", "noise", "blockers")
        if getattr(controls, key)
    }


def test_neutral_controls_cost_nothing() -> None:
    neutral = LightControls(
        barn_doors=BarnDoors(DOORS, density=0.0),
        distance=DistanceRange(),
        falloff=Falloff(),
        slide=Slide(PIXELS, "i", density=0.0),
        noise=Noise(0.0),
        blockers=(
            Blocker("thin", CARD, DOORS, 0.0),
            Blocker("flat", np.diag([1.0, 0.0, 1.0, 1.0]), DOORS),
        ),
    )
    assert LightFilters().of(light_of("POINT", neutral)) == ()


@pytest.mark.parametrize("roundness", [0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0])
@pytest.mark.parametrize("size", [1e-6, 1e-2, 1.0, 1e3, 1e6])
def test_outlines_of_every_size(size: float, roundness: float) -> None:
    """On and beside the outline, from a flat to a high one, with and without edges."""
    rng = np.random.default_rng(2)
    want, got = [], []
    for edge in (0.0, 0.5 * size):
        outline = Superellipse(size, 0.3 * size, edge, edge, roundness)
        light = light_of(
            "SUN", LightControls(barn_doors=BarnDoors(outline)), np.diag([1.0, 1.0, 1.0, 1.0])
        )
        q = rng.uniform(-1.7, 1.7, (SIDE, SIDE, 3)) * size
        q = q.astype(np.float32).astype(np.float64)
        want.append(superellipse(outline, q[..., :2]))
        got.append(through(light, q)[..., 0])
    # The sizes, the place and the power are off by 1e-7 each; a star's power (1 + r)^10 and the
    # edge between outlines that are 1e-3 apart where it is thin magnify that.
    wrong = np.abs(np.array(got) - want) > 1e-4
    assert wrong.mean() < 2e-3, np.abs(np.array(got) - want).max()


@pytest.mark.parametrize("distance", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_extremes_are_finite(size: float, distance: float) -> None:
    """Everything at once, near, far, tiny and huge; on the light's axis and plane too."""
    outline = Superellipse(size, 1.0 / size, 0.0, size, 20.0)
    card = np.diag([size, 1.0 / size, 0.0, 1.0])
    card[2, 3] = -0.5 * distance
    controls = LightControls(
        barn_doors=BarnDoors(outline, (size, -size), 1.0, 0.5),
        distance=DistanceRange(distance, 0.0, distance, 0.0),
        falloff=Falloff(10.0, size),
        slide=Slide(PIXELS, "i", scale=(size, 1.0), offset=(1e6, 0.0), repeat=True),
        noise=Noise(1.0, size, 15.0, 2.0),
        blockers=(
            Blocker("a", card, outline, 1.0, (0.0, 1.0, 0.5)),
            Blocker("b", np.eye(4), outline),
        ),
    )
    rng = np.random.default_rng(3)
    q = rng.normal(size=(SIDE, SIDE, 3))
    q[0, :, 2] = 0.0
    q[1, :, :2] = 0.0
    q[2, :, 2] *= 1e-12
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    for kind in ("POINT", "SUN", "AREA"):
        light = light_of(kind, controls, np.eye(4))
        before = q * (1.0, 1.0, -np.sign(q[..., 2:]).max() if kind == "AREA" else 1.0)
        surface = surfaces(distance * before, -before)
        lit = drawn_light(surface, light, [light_sample(light, 0, 1)])
        assert np.isfinite(lit).all()
        assert (lit >= 0.0).all()


def test_near_and_far_the_same() -> None:
    """Hard ends at one distance leave what is exactly there."""
    controls = LightControls(distance=DistanceRange(1.0, 0.0, 1.0, 0.0))
    light = light_of("POINT", controls, np.eye(4))
    z = np.linspace(-2.0, -0.125, 16)
    place = np.stack([0 * z, 0 * z, z], axis=-1)[None]
    np.testing.assert_array_equal(through(light, place)[0, :, 0], (z == -1.0).astype(float))


def test_a_point_light_casts_its_cookie_upright() -> None:
    """As the light looks, the picture's right is on its right and its top above."""
    pixels = np.zeros((2, 2, 4), dtype=np.float32)
    pixels[..., 3] = 1.0
    pixels[1, 1, 0] = 1.0
    light = light_of("POINT", LightControls(slide=Slide(pixels, "i", "SLIDE")), np.eye(4))
    place = np.array([[[x, y, -1.0] for x in (-0.25, 0.25)] for y in (-0.25, 0.25)])
    np.testing.assert_allclose(through(light, place)[..., 0], [[0, 0], [0, 1]], atol=1e-6)


def test_filters_follow_their_light() -> None:
    """A moved light's blockers are placed anew; its slide stays on the GPU."""
    filters = LightFilters()
    controls = replace(CONTROLS["all"])
    first = {each.name: each for each in filters.of(light_of("POINT", controls))}
    again = {each.name: each for each in filters.of(light_of("POINT", replace(controls)))}
    assert all(again[name] is first[name] for name in first)
    moved = {each.name: each for each in filters.of(light_of("POINT", controls, CARD + np.eye(4)))}
    assert not np.array_equal(
        moved["blockers"].values["blockers_x"], first["blockers"].values["blockers_x"]
    )
    assert moved["slide"] is first["slide"]
    filters.forget("l")
    assert filters.of(light_of("POINT", controls))[-1] is not first["slide"]
