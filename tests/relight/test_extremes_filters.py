# SPDX-License-Identifier: GPL-3.0-or-later
"""Every filter of a light with sizes and distances from 1e-6 m to 1e6 m, against its float64 twin:
exact for places that are a few roundings of float32 off (`extremes`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

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
from addon.scene.light_profile import LightProfile
from tests.reference.light_filters import light_filters
from tests.reference.light_profile import profile
from tests.reference.surfaces import Surfaces, surfaces
from tests.synthetic import looking_at

from .extremes import INPUT, RESULT, SPACING, Array, Lamps, exact, unit

pytestmark = pytest.mark.usefixtures("gpu_context")

PLACE = looking_at((0.0, 0.0, 0.0), (0.2, 0.3, -1.0))
SIDE = 32
SHAPE = (SIDE, SIDE)
SIZES = [1e-6, 1e-3, 1.0, 1e3, 1e6]
ROUNDNESSES = [0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0]
PIXELS = np.random.default_rng(1).random((5, 7, 4)).astype(np.float32)
# No place is lit more strongly (light.glsl).
MOST_STRENGTH = 1e20

_lamps: dict[str, Lamps] = {}


def light_of(kind: Any, controls: LightControls = NEUTRAL, **more: Any) -> Light:
    return Light("l", kind, PLACE, 4.0 * np.pi, np.ones(3), controls=controls, **more)


def facing(light: Light, place: Array) -> Surfaces:
    toward = -light.direction if light.type == "SUN" else -place
    return surfaces(place, unit(np.broadcast_to(toward, place.shape)), eye=(0.0, 0.0, 0.0))


def through(light: Light, place: Array) -> Array:
    """(SIDE, SIDE, 3) what the controls let through, as drawn."""
    surface = replace(facing(light, place), eye=unit(np.ones(3)), perspective=False)
    lamps = _lamps.setdefault("all", Lamps(surface))
    lamps.show(surface)
    sample = light_sample(light, 0, 1)
    plain = lamps.drawn(replace(light, controls=NEUTRAL, profile=None), sample)
    got = lamps.drawn(light, sample)
    assert (plain > 0.0).all()
    assert np.isfinite(got).all()
    return got / plain


def check(
    light: Light,
    place: Array,
    *,
    twin: Callable[[Light, Array], Array] = light_filters,
    reach: float = 0.0,
    own: Array | float = 0.0,
    edges: float = 0.0,
) -> Array:
    """Hold a light's filters to their twin.

    Args:
        light: at the local origin.
        place: (SIDE, SIDE, 3) exact in float32.
        twin: of the filters.
        reach: metres to whatever else is placed in the beam, rounded as well.
        own: relative errors of what the filter itself has from the driver.
        edges: share of places that may lie on a step.
    """
    want = twin(light, place)
    rng = np.random.default_rng(5)
    size = INPUT * (np.linalg.norm(place, axis=-1, keepdims=True) + reach)
    # Half of the draws with the full error, half within: what is thin may lie between.
    signs = [draw_signs(rng, place.shape, k % 2 == 0) for k in range(24)]
    moved = [np.abs(twin(light, place + size * sign) - want) for sign in signs]
    bound = 2.0 * np.max(moved, axis=0) + (RESULT + own) * np.maximum(want, 1.0)
    got = through(light, place)
    strength = 1.0 if light.type == "SUN" else 1.0 / np.sum(place**2, axis=-1, keepdims=True)
    kept = want * strength < 0.9 * MOST_STRENGTH
    off = np.where(kept, np.abs(got - want), 0.0)
    wrong = (off > bound).any(axis=-1)
    worst = np.unravel_index(np.argmax(off / bound), off.shape)
    assert wrong.mean() <= edges, (
        f"{wrong.sum()} places; at {worst}: {got[worst]:g} instead of {want[worst]:g}, allowed "
        f"{bound[worst]:g}"
    )
    return got


def draw_signs(rng: np.random.Generator, shape: tuple[int, ...], full: bool) -> Array:
    if full:
        return rng.choice([-1.0, 1.0], shape).astype(np.float64)
    return rng.uniform(-1.0, 1.0, shape)


def before(light: Light, across: Array, size: float = 1.0) -> Array:
    """Places whose (SIDE, SIDE, 2) places across the beam are these, at all distances; of a sun
    up to a hundred times the size of what stands in its beam."""
    rng = np.random.default_rng(0)
    depth = 10.0 ** rng.uniform(-6.0, 6.0, (*SHAPE, 1))
    if light.type == "SUN":
        depth = size * depth ** (1.0 / 3.0)
    beside = across if light.type == "SUN" else across * depth
    # Nothing is farther than 1e6 m.
    shrink = np.minimum(1e6 / np.abs(beside).max(axis=-1, keepdims=True), 1.0)
    if light.type == "SUN":
        shrink = np.ones_like(shrink)
    local = np.concatenate([beside, -depth], axis=-1) * shrink
    return exact(local @ light.axes)


@pytest.mark.parametrize("roundness", ROUNDNESSES)
@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_barn_doors(kind: str, roundness: float) -> None:
    """Of every size; a step is met by a few places, and the thin ends of a star by some more."""
    rng = np.random.default_rng(2)
    for size in SIZES:
        for edge in (0.0, 0.5 * size):
            outline = Superellipse(size, 0.3 * size, edge, edge, roundness)
            doors = BarnDoors(
                outline, (0.1 * size, -0.1 * size) if kind == "POINT" else (0, 0), 0.4
            )
            light = light_of(kind, LightControls(barn_doors=doors))
            at = (
                size * rng.uniform(-1.7, 1.7, (*SHAPE, 2)) * 10.0 ** rng.uniform(-4, 0, (*SHAPE, 2))
            )
            got = check(light, before(light, at, size), edges=0.01)
            if roundness <= 5.0 and size < 1e6:
                assert got.std() > 0.01, "the test shows nothing"


@pytest.mark.parametrize("along", [False, True])
@pytest.mark.parametrize("edge", [0.0, 1e-3, 10.0])
def test_distances(edge: float, along: bool) -> None:
    """Near and far at one place and apart; surfaces on them, before and beyond."""
    rng = np.random.default_rng(3)
    for near in SIZES:
        for far in (near, 2.0 * near):
            ends = DistanceRange(near, edge * near, far, edge * near, along)
            light = light_of("POINT", LightControls(distance=ends))
            away = near * rng.choice(
                [0.1, 0.5, 0.999, 1.0, 1.001, 1.7, 2.0, 3.0, 20.0], (*SHAPE, 1)
            )
            local = unit(np.append(rng.normal(size=(*SHAPE, 2)), -np.ones((*SHAPE, 1)), axis=-1))
            # On a step of no width lies a ninth of the places at most, twice where both are.
            step = 0.0 if edge else 0.25
            check(light, exact(away * local @ light.axes), edges=step)


@pytest.mark.parametrize("exponent", [-4.0, 0.0, 1.0, 3.0, 10.0])
def test_falloffs(exponent: float) -> None:
    """log2 and exp2 have, by Vulkan's rules, 3 and 3 + 2 |x| units in the last place, and log2
    2^-21 about one; the power takes the logarithm's with it."""
    rng = np.random.default_rng(4)
    for reference in SIZES:
        light = light_of("POINT", LightControls(falloff=Falloff(exponent, reference)))
        away = 10.0 ** rng.uniform(-6.0, 6.0, (*SHAPE, 1))
        place = exact(away * unit(rng.normal(size=(*SHAPE, 3))))
        stops = np.abs(np.log2(away / reference))
        power = abs(2.0 - exponent)
        of_log = power * (3.0 * SPACING * stops + 2.0**-21)
        check(light, place, own=of_log + (4.0 + 3.0 * power * stops) * SPACING)


@pytest.mark.parametrize("repeat", [False, True])
@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_slides(kind: str, repeat: bool) -> None:
    """Texels have half precision; its frame is a step, as is where a repeated one begins anew."""
    rng = np.random.default_rng(6)
    for size in SIZES:
        slide = Slide(PIXELS, "i", "SLIDE", 0.9, (size, 0.5 * size), rotation=0.3, repeat=repeat)
        light = light_of(kind, LightControls(slide=slide))
        at = size * rng.uniform(-1.0, 1.0, (*SHAPE, 2))
        got = check(light, before(light, at, size), own=2.0**-11, edges=0.01)
        if size < 1e6:
            assert got.std() > 0.01


@pytest.mark.parametrize("projected", [False, True])
def test_noise(projected: bool) -> None:
    """As far as float32 tells one patch from the next; farther out it only has to be finite."""
    rng = np.random.default_rng(7)
    away = 10.0 ** rng.uniform(-6.0, 6.0, (*SHAPE, 1))
    for scale in SIZES:
        noise = Noise(1.0, scale, 3.5, 0.7, (0.3, -2.0, 7.0), projected=projected)
        light = light_of("POINT", LightControls(noise=noise))
        near = np.minimum(away, 1e3 / scale) if not projected else away
        place = exact(near * unit(rng.normal(size=(*SHAPE, 3))))
        # Beside the place its sum with the offset is rounded, of eight octaves' scale.
        if projected and scale > 1e3:
            assert np.isfinite(through(light, place)).all()
        else:
            check(light, place, own=64.0 * SPACING * 8.0)
        assert np.isfinite(through(light, exact(place * 1e6 / away.max()))).all()


@pytest.mark.parametrize("roundness", [0.01, 1.0, 20.0])
@pytest.mark.parametrize("kind", ["POINT", "SUN"])
def test_blockers(kind: str, roundness: float) -> None:
    """Cards and windows in the middle between the light and what it lights."""
    rng = np.random.default_rng(8)
    for size in SIZES:
        card = looking_at((0.0, 0.0, 0.0), (0.2, 0.3, -1.0)) @ np.diag([0.5, 0.7, 1.0, 1.0])
        card[:3, :3] *= size
        card[:3, 3] = -size * light_of(kind).axes[2]
        outline = Superellipse(1.0, 0.6, 0.3, 0.3, roundness)
        both = (
            Blocker("a", card, outline, 0.8, (1.0, 0.3, 0.1)),
            Blocker("b", card, replace(outline, width=3.0, height=3.0), 1.0, invert=True),
        )
        light = light_of(kind, LightControls(blockers=both))
        local = np.append(rng.normal(size=(*SHAPE, 2)), -2.0 * np.ones((*SHAPE, 1)), axis=-1)
        got = check(light, exact(size * local @ light.axes), reach=size, edges=0.01)
        if roundness < 20.0:  # such a star has no area to speak of
            assert got.std() > 0.01


@pytest.mark.parametrize("half_width", [0.0, 0.01, 100.0])
def test_profiles(half_width: float) -> None:
    """All around, near its poles and seam too; Vulkan lets atan be off by 4096 units in the last
    place, of at most pi: so much of a texel's slope is added."""
    rng = np.random.default_rng(9)
    texels = rng.random((9, 12, 3)).astype(np.float32)
    for exponent, smooth in ((0.0, 0.0), (1.0, 0.0), (2.0, 0.5)):
        own = LightProfile(texels, half_width, exponent, smooth)
        light = light_of("POINT", profile=own)
        local = unit(rng.normal(size=(*SHAPE, 3)) * 10.0 ** rng.uniform(-5, 0, (*SHAPE, 3)))
        place = exact(local @ light.axes * 10.0 ** rng.uniform(-6.0, 6.0, (*SHAPE, 1)))
        white = replace(light, profile=replace(own, pixels=np.ones_like(texels)))
        gain = profile(white, place, np.zeros(3))
        around = 0.0 if half_width else 4096.0 * 0.5 * SPACING * 12.0
        # pow is exp2 of a log2: see the falloff.
        away = np.abs(np.log2(np.linalg.norm(place, axis=-1, keepdims=True)))
        power = exponent * (3.0 * SPACING * away + 2.0**-21) + 3.0 * exponent * away * SPACING
        check(
            light,
            place,
            twin=lambda one, at: profile(one, at, np.zeros(3)),
            own=(around + power + 4.0 * SPACING) * np.maximum(gain, 1.0),
            edges=0.01 if half_width else 0.0,
        )
