# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras that are added to a cache on the GPU are as if they had always been there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from addon.camplace.camera import CachingCamera
from addon.scene.geometry import Sheer
from tests import synthetic
from tests.corrmap.test_correspondence import STORED, Setup, channel_of, make_setup

PLAN = ChannelPlan(STORED, {}, ("one", "two"))
# Far less than what the rooms' pictures take: blocks come and go.
SMALL = 200_000


@dataclass(frozen=True)
class Shown:
    found: NDArray[np.float32]
    diffuse: NDArray[np.float64]
    bytes: int


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup(resolutions=(100, 50))


def sampler_of(setup: Setup, framebuffers: Sequence[DeepFramebuffer], budget: int) -> object:
    from addon.corrmap.surface_sampler import SurfaceSampler

    return SurfaceSampler(setup.geometry, framebuffers, PLAN, cache_budget=budget, drop=False)


def show(setup: Setup, sampler: object) -> Shown:
    from addon.corrmap.surface_sampler import SurfaceSampler

    assert isinstance(sampler, SurfaceSampler)
    sampler.set_view(setup.view)
    diffuse = channel_of(sampler.sample(0), "diffuse_color")
    return Shown(sampler.correspondence().read(), diffuse, sampler.pages.gpu_bytes)


@pytest.mark.parametrize("budget", [1 << 30, SMALL])
def test_added_cameras_are_chosen_as_the_caches_own(
    gpu_context: None, setup: Setup, budget: int
) -> None:
    own, later = setup.framebuffers[:6], setup.framebuffers[6:]
    sampler = sampler_of(setup, own, budget)
    alone = show(setup, sampler)
    sampler.set_added(later)  # type: ignore[attr-defined]
    together = show(setup, sampler)
    whole = show(setup, sampler_of(setup, setup.framebuffers, budget))
    assert not np.array_equal(alone.found, together.found)
    assert np.array_equal(together.found, whole.found)
    # Steps of either table's scales: a half of 1/255 of the root each.
    assert np.abs(together.diffuse - whole.diffuse).max() < 2.0 / 255.0
    # Others in their place, fewer and more; and none.
    for some in (later[:2], later, later[:1]):
        sampler.set_added(some)  # type: ignore[attr-defined]
        expected = show(setup, sampler_of(setup, [*own, *some], budget))
        assert np.array_equal(show(setup, sampler).found, expected.found)
    sampler.set_added(())  # type: ignore[attr-defined]
    again = show(setup, sampler)
    assert np.array_equal(again.found, alone.found)
    assert np.array_equal(again.diffuse, alone.diffuse)


def brighter(framebuffer: DeepFramebuffer, factor: float) -> DeepFramebuffer:
    channels = dict(framebuffer.channels)
    channels["diffuse_color"] = channels["diffuse_color"] * np.float32(factor)
    return DeepFramebuffer(framebuffer.camera, channels)


@pytest.mark.parametrize("factor", [3.0, 0.01, 1e5])
def test_added_texels_keep_their_values_whatever_the_caches_scales_are(
    gpu_context: None, setup: Setup, factor: float
) -> None:
    """Ones brighter than all that the cache has, much darker ones, and ones that need more
    precision than its texels have."""
    own = setup.framebuffers[:6]
    later = [brighter(framebuffer, factor) for framebuffer in setup.framebuffers[6:]]
    sampler = sampler_of(setup, own, 1 << 30)
    sampler.set_added(later)  # type: ignore[attr-defined]
    together = show(setup, sampler)
    mine = together.found.reshape(-1, 4)[:, 0] >= 6
    assert 0.1 < mine.mean() < 0.9
    alone = show(setup, sampler_of(setup, setup.framebuffers, 1 << 30)).diffuse
    error = np.abs(together.diffuse - factor * alone)[mine].max(axis=1)
    # Half a step of the root of the scale, which is of the brightest, for both; less where the
    # channel is float32.
    assert np.percentile(error, 99) < factor * 2.0 / 255.0
    rest = together.found.reshape(-1, 4)[:, 0].astype(int)
    unchanged = (rest >= 0) & (rest < 6)
    assert np.abs(together.diffuse - alone)[unchanged].max() < 2.0 / 255.0


def test_a_material_that_only_added_cameras_see_has_their_mean(
    gpu_context: None, setup: Setup
) -> None:
    from addon.corrmap.surface_sampler import SurfaceSampler

    def without_box(framebuffer: DeepFramebuffer) -> DeepFramebuffer:
        box = framebuffer.channels["material_id"] == 2.0
        channels = {n: np.where(box, np.float32(0), v) for n, v in framebuffer.channels.items()}
        return DeepFramebuffer(framebuffer.camera, channels)

    sampler = sampler_of(setup, [without_box(f) for f in setup.framebuffers[:6]], 1 << 30)
    assert isinstance(sampler, SurfaceSampler)
    sampler.set_added(setup.framebuffers[6:])
    from addon.glsl.shader import read_texture

    rows = read_texture(sampler.pages.material_table)
    box = [f.channels["diffuse_color"][f.channels["material_id"][..., 0] == 2.0]
           for f in setup.framebuffers[6:]]  # fmt: skip
    mean = np.concatenate(box).mean(axis=0)
    places = [i for i, (n, _) in enumerate(sampler.layout.values) if n == "diffuse_color"]
    assert rows[:, 2].reshape(-1)[places] == pytest.approx(mean, rel=1e-4)


def test_a_camera_at_the_view_closes_its_holes(gpu_context: None, setup: Setup) -> None:
    from addon.camplace.hole_cameras import hole_cameras
    from addon.corrmap.surface_sampler import SurfaceSampler

    own = setup.framebuffers[:3]
    sampler = sampler_of(setup, own, 1 << 30)
    assert isinstance(sampler, SurfaceSampler)
    sampler.set_view(setup.view)
    before = sampler.coverage()
    assert before.open_fraction > 0.05
    cameras = hole_cameras(setup.view, sampler.hole_points(), first_id=50).cameras
    tracer = synthetic.Tracer(setup.geometry)
    sampler.set_added(
        [synthetic.trace_framebuffer(setup.geometry, tracer, c, setup.color) for c in cameras]
    )
    sampler.set_view(setup.view)
    # What is left are samples beside a silhouette.
    assert sampler.coverage().hole_fraction < 1e-3
    assert sampler.coverage().open_fraction < 1e-4
    # Other samples of the pixels, too.
    for index in (1, 5):
        from addon.corrmap.correspondence import measure_coverage

        assert measure_coverage(sampler.sample(index)).hole_fraction < 2e-3


def test_a_camera_at_the_view_sharpens_what_is_soft(gpu_context: None) -> None:
    """A wall that fills the view, which a caching camera sees with half a texel to a pixel on the
    left, and one beside it with two of them on the right."""
    from addon.camplace.hole_cameras import hole_cameras
    from addon.corrmap.surface_sampler import SurfaceSampler

    quad = np.array([[-4.0, 0, -4], [4.0, 0, -4], [4.0, 0, 4], [-4.0, 0, 4]])
    geometry = synthetic.geometry_of([(quad, np.array([[0, 1, 2], [0, 2, 3]]))])
    geometry = replace(geometry, material_id=np.zeros_like(geometry.material_id))
    # 64 pixels over 4 metres.
    view = synthetic.perspective_view(
        synthetic.looking_at((0, -4, 0), (0, 0, 0)), 64, 64, 2.0 * np.arctan(0.5)
    )
    coarse, fine = (
        CachingCamera(
            number, synthetic.looking_at((x, -4, 0), (x, 0, 0)), 2.0 * np.arctan(0.5),
            0.1, 10.0, resolution, "PERSPECTIVE", number,
        )
        for number, (x, resolution) in enumerate([(-1.9, 32), (2.0, 128)])
    )  # fmt: skip
    setup = Setup(geometry, view, [], 1.0, np.zeros(3))
    tracer = synthetic.Tracer(geometry)

    def baked(cameras: Sequence[CachingCamera]) -> list[DeepFramebuffer]:
        return [synthetic.trace_framebuffer(geometry, tracer, c, setup.color) for c in cameras]

    sampler = sampler_of(setup, baked([coarse, fine]), 1 << 30)
    assert isinstance(sampler, SurfaceSampler)
    sampler.set_view(view)
    points = sampler.hole_points(and_soft=True)
    assert not points.is_hole.any()
    assert sampler.hole_points().is_soft is None
    # A texel of the fine camera's, and of the coarse one's that it ends beside.
    left, right = points.seen[:, 0] < -0.2, points.seen[:, 0] > 0.2
    assert points.is_soft is not None
    assert points.is_soft[left].all()
    assert not points.is_soft[right].any()
    assert points.soft_fraction == pytest.approx(0.5, abs=0.05)
    (camera,) = hole_cameras(view, points, first_id=2).cameras
    # It looks at the left half of the picture only.
    assert camera.project(np.array([1.5, 0.0, 0.0]))[0] > 1.0
    sampler.set_added(baked([camera]))
    sampler.set_view(view)
    assert sampler.hole_points(and_soft=True).soft_fraction == 0.0
    assert hole_cameras(view, sampler.hole_points(and_soft=True)).cameras == ()
    # A hole is not soft too.
    half = sampler_of(setup, baked([coarse]), 1 << 30)
    assert isinstance(half, SurfaceSampler)
    half.set_view(view)
    open_points = half.hole_points(and_soft=True)
    assert open_points.is_hole[right].any()
    assert open_points.is_soft is not None
    assert not (open_points.is_soft & open_points.is_hole).any()


def test_neighbours_of_the_same_material_beside_the_surface_fill_small_holes(
    gpu_context: None,
) -> None:
    """As leaves lie: each at an angle of its own. The normal stays the pixel's own."""
    from addon.glsl.shader import read_texture

    quad = np.array([[-2.0, 0, -2], [2.0, 0, -2], [2.0, 0, 2], [-2.0, 0, 2]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    # A thread leans before a sheet, a pixel and a half wide.
    thread = quad * [0.02, 0.0, 1.0] + [0.0, -1.0, 0.0] + quad[:, 2:] * [0.0, 0.2, 0.0]
    geometry = synthetic.geometry_of([(quad, faces), (thread, faces)])
    geometry = replace(geometry, material_id=np.zeros_like(geometry.material_id))
    view = synthetic.perspective_view(synthetic.looking_at((0, -4, 0), (0, 0, 0)), 64, 64, 0.8)
    tracer = synthetic.Tracer(geometry)
    cameras = synthetic.cube_cameras((0.0, -0.5, 0.0), 64)
    setup = Setup(geometry, view, [], 1.0, np.zeros(3))
    # From behind the thread none of its front is seen.
    setup.framebuffers.extend(
        synthetic.trace_framebuffer(geometry, tracer, camera, setup.color) for camera in cameras
    )
    sampler = sampler_of(setup, setup.framebuffers, 1 << 30)
    sampler.set_view(view)  # type: ignore[attr-defined]
    surface = sampler.sample(0)  # type: ignore[attr-defined]
    origin = read_texture(surface.geometric_normal)
    beside = origin[..., 3] == -2.0
    assert beside.sum() > 20
    depth = read_texture(surface.position)[..., 1]
    assert (depth[beside] < 3.5).all()
    flat = channel_of(surface, "normal")[beside.ravel()]
    assert np.abs(flat - origin[..., :3][beside]).max() < 1e-3


@pytest.mark.parametrize("others", [0, 1])
def test_masks_of_new_materials_are_theirs_alone(
    gpu_context: None, setup: Setup, others: int
) -> None:
    """Materials that the cache does not know share a number: no mask may be that of them all."""
    from addon.corrmap.surface_sampler import SurfaceSampler

    names = ("one", "new 1", "new 2")[: 2 + others]
    clear = np.full((1, 1, 3), 0.5, dtype=np.float32)
    outside = np.zeros(3, dtype=np.float32)
    sheers = tuple(Sheer(i, clear, "REPEAT", outside) for i in (0, 1))
    geometry = replace(setup.geometry, material_names=names, sheers=sheers)
    shown = SurfaceSampler(
        geometry, setup.framebuffers[:1], PLAN, cache_budget=1 << 30, drop=False
    ).geometry
    named = [shown.material_names[each.material_id] for each in shown.sheers]
    assert named == ["one", ""][: 2 - others]
