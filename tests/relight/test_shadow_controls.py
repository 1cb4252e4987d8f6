# SPDX-License-Identifier: GPL-3.0-or-later
"""Cheated shadows and weights: against the float64 twin, and in a session."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.geometry_buffer import GeometryBuffer
from addon.relight.light_points.light_sample import light_sample
from addon.relight.shadows.shadow_frustum import ShadowSettings, shadow_frustum
from addon.relight.shadows.shadow_light import shadow_light
from addon.relight.shadows.shadow_pass import ShadowPass
from addon.scene.light import Light
from addon.scene.light_controls import (
    NEUTRAL,
    BarnDoors,
    LightControls,
    ShadowControls,
    Superellipse,
)
from addon.scene.light_profile import LightProfile
from tests.reference import light_pass as twin
from tests.reference.surfaces import random_surfaces
from tests.synthetic import box, geometry_of, looking_at

from .drawing import drawn_light
from .test_passes import assert_close
from .test_session import make_store, open_session

pytestmark = pytest.mark.usefixtures("gpu_context")

COLOR = np.array([1.0, 0.7, 0.2])
FILLED = ShadowControls(color=(0.1, 0.2, 0.5), density=0.7)
CONTROLS = {
    "filled": LightControls(shadow=FILLED),
    "filled, with highlights": LightControls(shadow=replace(FILLED, hide_highlights=False)),
    "thin": LightControls(shadow=ShadowControls(density=0.4)),
    "none": LightControls(shadow=ShadowControls(density=0.0, hide_highlights=False)),
    "weights": LightControls(diffuse=0.3, specular=2.5),
    "ambient": LightControls(ambient=0.6, diffuse=0.0),
    "all": LightControls(
        barn_doors=BarnDoors(Superellipse(0.5, 0.4, 0.4, 0.4)),
        shadow=FILLED,
        ambient=0.2,
        specular=0.5,
    ),
}


@pytest.mark.parametrize(("name", "lobes"), [*((name, 1) for name in CONTROLS), ("all", 2)])
def test_light_pass(name: str, lobes: int) -> None:
    surface = random_surfaces(4, lobes=lobes)
    place = looking_at((1.0, -1.5, 3.0), (0.0, 0.0, 0.0))
    place[:3, 3] += surface.origin
    plain = Light("l", "POINT", place, 100.0, COLOR)
    light = replace(plain, controls=CONTROLS[name])
    geometry = geometry_of([box((0.5, -0.8, 1.5), 0.8)])
    geometry = replace(geometry, vertices=geometry.vertices + surface.origin)
    sample = light_sample(plain, 0, 1)
    settings = ShadowSettings(cube_resolution=128)
    shadow = ShadowPass(GeometryBuffer(geometry, surface.origin), settings).draw(
        plain, sample, geometry.bounds, np.empty((0, 3))
    )
    both = [drawn_light(surface, plain, [sample], shadow=s)[..., :3] for s in (shadow, None)]
    front = twin.light_layer(surface, plain, sample, np.ones(both[0].shape[:2]))
    with np.errstate(invalid="ignore", divide="ignore"):
        seen = np.where(front[..., 0] > 0.0, both[0][..., 0] / front[..., 0], 0.0)
    # Shares are quarters mixed by position; what rounding adds is left for the comparison below.
    assert 0.1 < (seen < 0.01).mean() < 0.9
    got = drawn_light(surface, light, [sample], shadow=shadow)[..., :3]
    want = twin.light_layer(surface, light, sample, np.clip(seen, 0.0, 1.0))
    assert_close(got, want)
    assert_close(
        drawn_light(surface, light, [sample])[..., :3], twin.light_layer(surface, light, sample)
    )


def test_no_highlight_in_a_filled_shadow() -> None:
    """Behind a wall, only the diffuse lobe is filled."""
    surface = random_surfaces(4)
    place = looking_at((0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (0, 1, 0))
    place[:3, 3] += surface.origin
    geometry = geometry_of([box((0.0, 0.0, 2.9), 0.15)])
    geometry = replace(geometry, vertices=geometry.vertices + surface.origin)
    shown = {}
    for hide in (True, False):
        controls = LightControls(shadow=replace(FILLED, hide_highlights=hide), diffuse=0.0)
        light = Light("l", "SPOT", place, 100.0, COLOR, spot_size=0.5, controls=controls)
        sample = light_sample(light, 0, 1)
        shadow = ShadowPass(GeometryBuffer(geometry, surface.origin), ShadowSettings(256, 256))
        drawn = shadow.draw(light, sample, geometry.bounds, np.empty((0, 3)))
        shown[hide] = drawn_light(surface, light, [sample], shadow=drawn)[..., :3]
    assert not shown[True].any()
    assert shown[False].any()


LIGHTS: dict[str, dict[str, Any]] = {
    "POINT": {"shadow_soft_size": 0.3},
    "SPOT": {"shadow_soft_size": 0.2, "spot_size": 0.9},
    "AREA": {"size": 0.4, "size_y": 0.2, "shape": "RECTANGLE"},
    "SUN": {"angle": 0.1},
}


def light_of(kind: Any, shadow: ShadowControls, **more: Any) -> Light:
    place = looking_at((-0.8, 0.6, 1.5), (0.2, 0.1, -1.0))
    controls = LightControls(shadow=shadow)
    return Light("l", kind, place, 10.0, np.ones(3), controls=controls, **LIGHTS[kind], **more)


@pytest.mark.parametrize("kind", LIGHTS)
def test_shadow_light(kind: str) -> None:
    assert shadow_light(light := light_of(kind, ShadowControls(density=0.3))) is light
    hard = shadow_light(light_of(kind, ShadowControls(softness=0.0)))
    centre = light_sample(hard, 0, 1).position
    for k in range(8):
        np.testing.assert_allclose(light_sample(hard, k, 8).position, centre, atol=1e-12)
    soft = shadow_light(light_of(kind, ShadowControls(softness=3.0)))
    plain = light_of(kind, ShadowControls())
    for k in range(8):
        far = light_sample(soft, k, 8).position - centre
        near = light_sample(plain, k, 8).position - centre
        # A sun's disk is curved: half its radius squared, a third of the chord's own share.
        np.testing.assert_allclose(far, 3.0 * near, atol=0.02 if kind == "SUN" else 1e-9)
    offset = np.array([0.5, -0.2, 0.1])
    moved = shadow_light(light_of(kind, ShadowControls(offset=tuple(offset))))
    moved_look = LightControls(shadow=ShadowControls(offset=tuple(offset)))
    want = centre + offset
    want = want / np.linalg.norm(want) if kind == "SUN" else want
    np.testing.assert_allclose(light_sample(moved, 0, 1).position, want, atol=1e-12)
    # What it shines on from elsewhere says nothing of what it shines on.
    profile = LightProfile(np.zeros((1, 1, 3), dtype=np.float32))
    assert shadow_light(replace(light, controls=moved_look, profile=profile)).profile is None
    frustum = shadow_frustum(
        moved, light_sample(moved, 0, 1), np.array([[-1.0] * 3, [1.0] * 3]), np.zeros((1, 3)),
        ShadowSettings(64, 64),
    )  # fmt: skip
    assert len(frustum.face_from_world) == (1 if kind == "SUN" else 6)


@pytest.fixture(scope="module")
def room() -> Any:
    from tests import synthetic

    floor = np.array([[-2.0, -2, -1], [2.0, -2, -1], [2.0, 2, -1], [-2.0, 2, -1]])
    geometry = geometry_of([(floor, np.array([[0, 1, 2], [0, 2, 3]])), box((0.2, 0.1, -0.2), 0.6)])
    store = make_store(geometry, synthetic.cube_cameras((-1.2, -1.0, 1.0), 128))
    view = synthetic.perspective_view(looking_at((-1.5, -1.6, 0.9), (0.3, 0.2, -0.6)), 64, 48, 1.2)
    return geometry, store, view


def layer(session: Any, light: Light) -> NDArray[np.float32]:
    session.set_lights([light])
    picture: NDArray[np.float32] = session.render().layers["l"][..., 0]
    return picture


@pytest.mark.parametrize(
    ("kind", "method"),
    [*((kind, "map") for kind in LIGHTS), *((kind, "traced") for kind in LIGHTS)],
)
def test_shadows_move_alone(room: Any, kind: str, method: Any) -> None:
    """Where a moved shadow lies is where it lies of a light that is moved."""
    session = open_session(room, 1)
    session.set_shadows(ShadowSettings(method=method))
    offset = (0.5, 0.3, 0.1)
    cheated = light_of(kind, ShadowControls(offset=offset))
    there = replace(
        shadow_light(cheated), controls=NEUTRAL, type="SUN" if kind == "SUN" else "POINT"
    )
    seen = [
        layer(session, light) / np.maximum(layer(session, replace(light, use_shadow=False)), 1e-9)
        for light in (cheated, there)
    ]
    both = (layer(session, replace(cheated, use_shadow=False)) > 1e-4) & (
        layer(session, replace(there, use_shadow=False)) > 1e-4
    )
    assert both.sum() > 200
    unmoved = light_of(kind, ShadowControls())
    without = layer(session, unmoved) / np.maximum(
        layer(session, replace(unmoved, use_shadow=False)), 1e-9
    )
    # A sun's map is as wide as what is seen, in texels of another turn: its edges may differ.
    alike = np.abs(seen[0] - seen[1])[both] < 1e-3
    assert alike.mean() > 0.97
    assert (np.abs(without - seen[0])[both] > 0.5).mean() > 0.02, "the shadow did not move"


def test_softness_is_of_the_shadow_alone(room: Any) -> None:
    """A hard shadow of a soft light: no penumbra, and the same light where all of it is seen."""
    session = open_session(room, 8)
    soft, hard = (light_of("POINT", ShadowControls(softness=s)) for s in (1.0, 0.0))
    free = layer(session, replace(soft, use_shadow=False))
    shares = [layer(session, light) / np.maximum(free, 1e-9) for light in (soft, hard)]
    seen = free > 1e-4
    penumbra = [((s > 0.05) & (s < 0.95) & seen).sum() for s in shares]
    # Edges cross pixels, and the pixels' own samples are a mean of them.
    assert penumbra[1] < 0.5 * penumbra[0]
    full = seen & (shares[0] > 0.999)
    # The eight points are of eight of the soft shadow's, that may all just miss a corner.
    assert (np.abs(shares[1][full] - 1.0) < 1e-3).mean() > 0.995


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("method", ["map", "traced"])
def test_extremes_are_finite(room: Any, kind: str, method: Any) -> None:
    session = open_session(room, 1)
    session.set_shadows(ShadowSettings(method=method))
    for shadow in (
        ShadowControls(softness=1e3),
        ShadowControls(softness=0.0, offset=(1e6, 0.0, 1e6)),
        ShadowControls(offset=(1e-7, 0.0, 0.0)),
        ShadowControls(color=(1e6, 0.0, 1e-9), density=0.5),
    ):
        lit = layer(session, light_of(kind, shadow))
        assert np.isfinite(lit).all()
        assert (lit >= 0.0).all()
        assert lit.any()
