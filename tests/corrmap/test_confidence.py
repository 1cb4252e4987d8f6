# SPDX-License-Identifier: GPL-3.0-or-later
"""Confidence against its float64 twin, and against what it is to tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.surface_sampler import SurfaceSampler
from addon.scene.view import View
from tests import synthetic
from tests.corrmap.test_added_cameras import sampler_of
from tests.corrmap.test_correspondence import Setup, make_setup
from tests.reference.correspondence import footprints


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup(resolutions=(100, 50))


@pytest.fixture(scope="module")
def sampler(gpu_context: None, setup: Setup) -> SurfaceSampler:
    made = sampler_of(setup, setup.framebuffers, 1 << 30)
    assert isinstance(made, SurfaceSampler)
    made.set_view(setup.view)
    return made


def parallel_view(view: View) -> View:
    """From the same place, of what lies before it."""
    clip_from_camera = np.diag([0.8, 0.8, -0.02, 1.0])
    clip_from_camera[2, 3] = -1.0
    return replace(view, clip_from_camera=clip_from_camera, perspective=False)


def steps(
    view: View, place: NDArray[np.float64], normal: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N, 3) where the rays a ten-thousandth of a pixel right of and above the pixel of a place
    meet its tangent plane, for a whole pixel."""
    tiny = 1e-4
    at = view.project(place)[:, :2]
    found = []
    for axis in np.eye(2):
        origin, direction = view.rays(at + tiny * axis)
        along = ((place - origin) * normal).sum(1) / (direction * normal).sum(1)
        found.append((origin + along[:, None] * direction - place) / tiny)
    return found[0], found[1]


@pytest.mark.parametrize("perspective", [True, False], ids=["perspective", "parallel"])
def test_confidence_equals_its_twin(
    setup: Setup, sampler: SurfaceSampler, perspective: bool
) -> None:
    from addon.glsl.shader import read_texture

    view = setup.view if perspective else parallel_view(setup.view)
    sampler.set_view(view)
    surface = sampler.sample(0)
    shown = sampler.confidence().read().reshape(-1, 4).astype(np.float64)
    place = read_texture(surface.position).astype(np.float64).reshape(-1, 4)[:, :3]
    place += surface.origin
    normal = read_texture(surface.geometric_normal).astype(np.float64).reshape(-1, 4)
    found = sampler.correspondence().read().astype(np.float64).reshape(-1, 4)
    size = np.linalg.norm(place - surface.origin, axis=1)
    expected = np.zeros((len(place), 4))
    expected[normal[:, 3] == -1.0, 0] = 0.2
    expected[normal[:, 3] == -2.0, 0] = 0.1
    right, up = steps(view, place, normal[:, :3])
    for number, framebuffer in enumerate(setup.framebuffers):
        mine = (found[:, 0] == number) & (normal[:, 3] > 0.0)
        camera = framebuffer.camera
        taps = footprints(framebuffer, place[mine], normal[mine, :3], size[mine])
        share = np.minimum((taps.weight * taps.same).sum(1), 1.0)
        here = camera.project(place[mine])[:, :2]
        tiny = 1e-5
        jacobian = np.stack(
            [
                (camera.project(place[mine] + tiny * step[mine])[:, :2] - here) / tiny
                for step in (right, up)
            ],
            axis=-1,
        )
        sharp = np.linalg.svd(camera.resolution * jacobian, compute_uv=False)[:, 1]
        toward = camera.origin - place[mine]
        facing = (toward * normal[mine, :3]).sum(1) / np.linalg.norm(toward, axis=1)
        sharp, facing = np.minimum(sharp, 1.0), np.clip(facing, 0.0, 1.0)
        expected[mine] = np.stack([share * sharp * np.sqrt(facing), share, sharp, facing], 1)
    # As for the map itself: a texel on its bound flips a share.
    error = np.abs(shown - expected).max(axis=1)
    assert np.percentile(error, 99) < 1e-3
    assert np.percentile(error, 95) < 1e-4
    assert shown.min() >= 0.0
    assert shown.max() <= 1.0


def test_confidence_tells_where_the_error_is(setup: Setup, sampler: SurfaceSampler) -> None:
    """The room's colours are a function of the place, so that the error is known."""
    from addon.glsl.shader import read_texture
    from tests.corrmap.test_correspondence import channel_of

    sampler.set_view(setup.view)
    surface = sampler.sample(0)
    trust = sampler.confidence().read()[..., 0].ravel()
    place = read_texture(surface.position).reshape(-1, 4)[:, :3] + surface.origin
    error = (channel_of(surface, "diffuse_color") - setup.color(place)) ** 2
    order = np.argsort(trust, kind="stable")
    fifths = [np.sqrt(error[part].mean()) for part in np.array_split(order, 5)]
    assert fifths[0] > 2.0 * max(fifths[1:])


def test_where_nothing_is_seen_there_is_no_confidence(gpu_context: None) -> None:
    from addon.corrmap.confidence import HEAT_ALPHA, draw_heat_map
    from addon.glsl.shader import read_texture

    setup = make_setup(resolutions=(64, 32))
    away = synthetic.perspective_view(
        synthetic.looking_at((0.0, -40.0, 0.0), (0.0, 0.0, 0.0)), 64, 48, 0.4
    )
    sampler = sampler_of(setup, setup.framebuffers, 1 << 30)
    assert isinstance(sampler, SurfaceSampler)
    sampler.set_view(away)
    confidence = sampler.confidence()
    values = confidence.read()
    seen = read_texture(sampler.sample(0).position)[..., 3] > 0.0
    assert 0.0 < seen.mean() < 1.0
    assert (values[~seen, 0] == -1.0).all()
    # The room's outside is seen by none of the cameras in it.
    assert (values[seen, 0] == 0.0).all()
    heat = read_texture(draw_heat_map(confidence))
    assert (heat[~seen] == 0.0).all()
    # Half precision holds colours to 2^-11.
    from tools.confidence_table import confidence_colors

    assert heat[seen][:, 3] == pytest.approx(HEAT_ALPHA, abs=1e-3)
    from tools.metrics import encode_srgb

    colors = confidence_colors(values)[seen]
    # The slope of the encoding is below 5 where red's green and blue are.
    assert np.abs(encode_srgb(heat[seen][:, :3] / HEAT_ALPHA) - colors).max() < 5e-3


def test_finer_pictures_are_trusted_more(gpu_context: None) -> None:
    means = []
    for resolutions in ((32, 16), (128, 64)):
        setup = make_setup(resolutions=resolutions)
        sampler = sampler_of(setup, setup.framebuffers, 1 << 30)
        assert isinstance(sampler, SurfaceSampler)
        sampler.set_view(setup.view)
        means.append(sampler.confidence().read()[..., 2].mean())
    assert means[1] > 2.0 * means[0]
