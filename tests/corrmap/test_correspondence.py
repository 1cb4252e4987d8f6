# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU's correspondence map against its float64 twin, and against the scene itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from addon.corrmap.surface_buffer import SurfaceBuffer
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from tests import synthetic
from tests.reference import correspondence as twin

STORED = ("depth", "material_id", "normal", "diffuse_color")


@dataclass(frozen=True)
class Setup:
    geometry: SceneGeometry
    view: View
    framebuffers: list[DeepFramebuffer]
    scale: float
    offset: NDArray[np.float64]

    def color(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """A smooth pattern whose slope is at most 1.5 per room unit."""
        return np.asarray(0.5 + 0.5 * np.sin(3.0 * (points - self.offset) / self.scale))


@dataclass(frozen=True)
class Drawn:
    position: NDArray[np.float64]
    normal: NDArray[np.float64]
    found: NDArray[np.float64]
    surface: SurfaceBuffer
    diffuse: NDArray[np.float64]
    source: NDArray[np.float64]


def make_setup(
    scale: float = 1.0,
    offset: Sequence[float] = (0.0, 0.0, 0.0),
    size: tuple[int, int] = (160, 120),
    resolutions: tuple[int, int] = (128, 64),
) -> Setup:
    moved = np.array(offset, dtype=np.float64)
    geometry = synthetic.room_with_box(scale, moved)
    place = moved + scale * np.array([-1.5, -1.6, 0.9])
    target = moved + scale * np.array([0.3, 0.2, -0.6])
    view = synthetic.perspective_view(
        synthetic.looking_at(place, target), *size, 1.2, near=0.01 * scale, far=100.0 * scale
    )
    cameras = [
        *synthetic.cube_cameras(moved + scale * np.array([-1.2, -1.0, 1.0]), resolutions[0]),
        *synthetic.cube_cameras(
            moved + scale * np.array([1.0, 1.2, -0.2]), resolutions[1], first_id=6
        ),
    ]
    setup = Setup(geometry, view, [], scale, moved)
    tracer = synthetic.Tracer(geometry)
    setup.framebuffers.extend(
        synthetic.trace_framebuffer(geometry, tracer, camera, setup.color) for camera in cameras
    )
    return setup


def draw(setup: Setup) -> Drawn:
    from addon.corrmap.correspondence import CorrespondencePass, GatherPass
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    origin = setup.view.origin
    plan = ChannelPlan(STORED, {}, ("one", "two"))
    pages = upload_tiles(setup.framebuffers, plan, drop=False)
    visible = VisibleSurfacePass(GeometryBuffer(setup.geometry, origin)).draw(setup.view)
    found = CorrespondencePass(pages, origin).draw(visible)
    surface = GatherPass(pages, origin).draw(visible, found)
    return Drawn(
        position=read_texture(visible.position).astype(np.float64).reshape(-1, 4),
        normal=read_texture(visible.normal).astype(np.float64).reshape(-1, 4)[:, :3],
        found=found.read().astype(np.float64).reshape(-1, 4),
        surface=surface,
        diffuse=channel_of(surface, "diffuse_color"),
        source=read_texture(surface.geometric_normal).astype(np.float64).reshape(-1, 4)[:, 3],
    )


def channel_of(surface: SurfaceBuffer, name: str) -> NDArray[np.float64]:
    """(N, components) of a channel that varies."""
    from addon.glsl.shader import read_texture

    planes = np.concatenate([read_texture(texture) for texture in surface.values], axis=-1)
    places = [i for i, (channel, _) in enumerate(surface.layout.values) if channel == name]
    return planes[..., places].astype(np.float64).reshape(-1, len(places))


def pixel_centres(view: View) -> NDArray[np.float64]:
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    return np.stack([x, y], axis=-1).reshape(-1, 2)


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup()


@pytest.fixture(scope="module")
def drawn(gpu_context: None, setup: Setup) -> Drawn:
    return draw(setup)


def test_the_visible_surface_is_what_a_ray_hits(setup: Setup, drawn: Drawn) -> None:
    origins, directions = setup.view.rays(pixel_centres(setup.view))
    triangle, where = synthetic.Tracer(setup.geometry).hit(origins, directions)
    error = np.linalg.norm(drawn.position[:, :3] + setup.view.origin - where, axis=1)
    # Rasterizers snap vertices to 1/256 pixel: an edge may go to the neighbour triangle.
    same = drawn.position[:, 3] == setup.geometry.material_id[triangle] + 1
    assert same.mean() > 0.999
    # Interpolation rounds barycentrics and coordinates: some spacings of the room's size.
    assert np.percentile(error[same], 99.5) < 32 * np.spacing(np.float32(4.0))


def test_normals_face_the_viewer(setup: Setup, drawn: Drawn) -> None:
    assert ((drawn.normal * drawn.position[:, :3]).sum(1) < 0.0).all()
    assert np.allclose(np.linalg.norm(drawn.normal, axis=1), 1.0, atol=1e-6)


def test_the_map_equals_its_twin(setup: Setup, drawn: Drawn) -> None:
    points = drawn.position[:, :3] + setup.view.origin
    expected = twin.correspondence(setup.framebuffers, points, drawn.normal, setup.view.origin)
    same = drawn.found[:, 0] == expected[:, 0]
    # Where two cameras score alike, or a texel lies on its bound, rounding decides.
    assert same.mean() > 0.998
    seen = same & (expected[:, 0] >= 0)
    assert seen.mean() > 0.98
    # (u, v) are of order one; some roundings of them.
    assert np.abs(drawn.found - expected)[seen][:, 1:3].max() < 1e-6
    ratio = drawn.found[seen, 3] / expected[seen, 3]
    # A share of the footprint flips in whole bilinear weights where a texel is on its bound.
    assert np.percentile(np.abs(ratio - 1.0), 99) < 1e-4


def test_gathering_equals_its_twin(setup: Setup, drawn: Drawn) -> None:
    points = drawn.position[:, :3] + setup.view.origin
    material = np.rint(drawn.position[:, 3]).astype(np.int64)
    expected = twin.gather(
        setup.framebuffers, drawn.found, points, drawn.normal,
        material=material, origin=setup.view.origin, channel="diffuse_color",
    )  # fmt: skip
    seen = drawn.found[:, 0] >= 0
    assert np.isfinite(expected[seen]).all()
    error = np.abs(drawn.diffuse - expected)[seen].max(axis=1)
    # The pages hold the root of the colour in steps of 1/255: half a step, doubled by squaring.
    assert np.percentile(error, 99.5) < 1.0 / 255.0


def test_what_is_read_is_the_scene(setup: Setup, drawn: Drawn) -> None:
    points = drawn.position[:, :3] + setup.view.origin
    error = np.abs(drawn.diffuse - setup.color(points)).max(axis=1)
    seen = drawn.source > 0.0
    assert seen.mean() > 0.98
    # Bilinear interpolation of a sine of wave number 3 over texels of up to 6/64 errs by
    # k^2 h^2 / 8 = 1 %; beside a silhouette, fewer than four texels err to first order.
    assert np.percentile(error[seen], 95) < 0.01
    assert np.percentile(error[seen], 99.5) < 0.1


def test_every_hole_gets_a_plausible_value(drawn: Drawn) -> None:
    holes = drawn.found[:, 0] < 0
    assert 0 < holes.mean() < 0.02
    assert np.isfinite(drawn.diffuse).all()
    assert (drawn.source[holes] <= 0.0).all()
    assert (drawn.diffuse[holes].max(axis=1) > 0.0).all()


def test_coverage_counts_the_holes(drawn: Drawn) -> None:
    from addon.corrmap.correspondence import measure_coverage

    coverage = measure_coverage(drawn.surface)
    assert coverage.surface_pixels == len(drawn.found)
    assert coverage.hole_fraction == pytest.approx((drawn.found[:, 0] < 0).mean(), abs=1e-3)
    assert coverage.open_fraction <= coverage.hole_fraction


@pytest.mark.parametrize(
    ("scale", "offset"),
    [(1e-3, (0.0, 0.0, 0.0)), (1e5, (0.0, 0.0, 0.0)), (1.0, (1e6, -1e6, 1e6))],
)
def test_scale_and_place_do_not_matter(
    gpu_context: None, drawn: Drawn, scale: float, offset: tuple[float, float, float]
) -> None:
    moved = draw(make_setup(scale, offset))
    # Doubles hold a millionth of a micrometre a million metres out; only ties may flip.
    assert (moved.found[:, 0] == drawn.found[:, 0]).mean() > 0.998
    # A step of the pages' colour.
    assert np.percentile(np.abs(moved.diffuse - drawn.diffuse), 99) < 2.0 / 255.0


def test_a_sheet_is_not_read_from_its_other_side(gpu_context: None) -> None:
    sheet = (
        np.array([[-2.0, 0, -2], [2.0, 0, -2], [2.0, 0, 2], [-2.0, 0, 2]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    geometry = synthetic.geometry_of([sheet])
    tracer = synthetic.Tracer(geometry)
    view = synthetic.perspective_view(synthetic.looking_at((0, -3, 0), (0, 0, 0)), 32, 32, 0.8)
    framebuffers = [
        synthetic.trace_framebuffer(
            geometry, tracer, camera, partial(np.full_like, fill_value=tone)
        )
        for y, tone, first in ((2.0, 0.25, 0), (-6.0, 0.75, 6))
        for camera in synthetic.cube_cameras((0.3, y, 0.2), 64, first_id=first)
    ]
    result = draw(Setup(geometry, view, framebuffers, 1.0, np.zeros(3)))
    # The nearer cameras are behind the sheet and would win by distance.
    # A step of the pages' colour.
    assert np.allclose(result.diffuse, 0.75, atol=1.0 / 255.0)


def test_dropped_blocks_are_not_offered(gpu_context: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lookup of blocks equals that of the pictures themselves, with nothing where they were
    dropped; also where pictures end within a block."""
    from addon.corrmap import tile_pages
    from addon.corrmap.tile_layout import BLOCK

    setup = make_setup(resolutions=(100, 50))
    random = np.random.default_rng(2)
    sides = [framebuffer.camera.resolution for framebuffer in setup.framebuffers]
    kept = [random.random((-(-side // BLOCK),) * 2) < 0.6 for side in sides]
    monkeypatch.setattr(tile_pages, "kept_blocks", lambda *_args, **_options: kept)
    drawn = draw(setup)
    for framebuffer, blocks in zip(setup.framebuffers, kept, strict=True):
        side = framebuffer.camera.resolution
        texels = blocks.repeat(BLOCK, axis=0).repeat(BLOCK, axis=1)[:side, :side]
        framebuffer.channels["depth"][~texels] = 0.0
    points = drawn.position[:, :3] + setup.view.origin
    expected = twin.correspondence(setup.framebuffers, points, drawn.normal, setup.view.origin)
    same = drawn.found[:, 0] == expected[:, 0]
    # As where nothing is dropped.
    assert same.mean() > 0.998
    seen = same & (expected[:, 0] >= 0)
    assert 0.3 < seen.mean() < 0.9
    assert np.abs(drawn.found - expected)[seen][:, 1:3].max() < 1e-6
    material = np.rint(drawn.position[:, 3]).astype(np.int64)
    color = twin.gather(
        setup.framebuffers, drawn.found, points, drawn.normal,
        material=material, origin=setup.view.origin, channel="diffuse_color",
    )  # fmt: skip
    error = np.abs(drawn.diffuse - color)[seen].max(axis=1)
    assert np.percentile(error, 99.5) < 1.0 / 255.0
