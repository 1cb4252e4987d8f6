# SPDX-License-Identifier: GPL-3.0-or-later
"""What small holes are filled with: of neighbours on their surface, the texels of that surface."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan
from addon.scene.view import View
from tests import synthetic
from tests.corrmap.test_correspondence import STORED, channel_of
from tests.reference import correspondence as twin

pytestmark = pytest.mark.usefixtures("gpu_context")

Array = NDArray[np.float64]

WALL, PLATE = 1, 2
# Far enough aside that the caching camera sees less of the wall than the view, and near enough that
# it is one or two pixels less.
ASIDE = (0.02, 0.06)


@dataclass(frozen=True)
class Filled:
    """(H, W, …) of what was gathered, and of what was seen; `cells` of the rows at the end."""

    color: Array
    kind: NDArray[np.int64]
    position: Array
    normal: Array
    found: Array
    cells: NDArray[np.int64]


def colors(points: Array) -> Array:
    """A white wall and a red plate before it."""
    return np.where(points[:, 1:2] < -0.5, [[1.0, 0.0, 0.0]], [[1.0, 1.0, 1.0]])


def patterns(points: Array) -> Array:
    return np.asarray(0.5 + 0.4 * np.sin(2.0 * points))


def pictures(paint: Any) -> tuple[Any, list[DeepFramebuffer]]:
    def square(y: float, size: float) -> tuple[Array, NDArray[np.int64]]:
        corners = [[-size, y, -size], [size, y, -size], [size, y, size], [-size, y, size]]
        return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]])

    geometry = replace(
        synthetic.geometry_of([square(0.0, 4.0), square(-1.0, 0.5)]),
        material_id=np.array([0, 0, 1, 1], np.int32),
        material_names=("Wall", "Plate"),
    )
    tracer = synthetic.Tracer(geometry)
    return geometry, [
        synthetic.trace_framebuffer(geometry, tracer, camera, paint)
        for camera in synthetic.cube_cameras((0.0, -3.0, 0.0), 256)
    ]


def looking_from(aside: float) -> View:
    at = synthetic.looking_at((aside, -3.0, 0.0), (aside, 0.0, 0.0))
    return synthetic.perspective_view(at, 320, 240, 0.9)


def gathered(
    scene: tuple[Any, list[DeepFramebuffer]], view: View, *, further: bool = False
) -> Filled:
    """The picture, with rows of further samples of shuffled cells above it if that is asked."""
    from addon.corrmap.correspondence import CorrespondencePass, GatherPass
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.tile_pages import upload_tiles
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture, texture_from_array

    geometry, framebuffers = scene
    pages = upload_tiles(framebuffers, ChannelPlan(STORED, {}, geometry.material_names), drop=False)
    visible = VisibleSurfacePass(GeometryBuffer(geometry, view.origin)).draw(view)
    search = CorrespondencePass(pages, view.origin)
    cells, texture = np.zeros((0, 2), dtype=np.int64), None
    if further:
        cells, visible = with_further(visible, search.draw(visible).read())
        texture = texture_from_array(cells.astype(np.float32).reshape(-1, view.width, 2), "RG32F")
    found = search.draw(visible)
    surface = GatherPass(pages, view.origin).draw(visible, found, cells=texture)
    position = read_texture(visible.position).astype(np.float64)
    return Filled(
        color=channel_of(surface, "diffuse_color").reshape(*position.shape[:2], 3),
        kind=np.rint(np.minimum(read_texture(surface.geometric_normal)[..., 3], 1.0)).astype(int),
        position=position,
        normal=read_texture(visible.normal)[..., :3].astype(np.float64),
        found=found.read().astype(np.float64),
        cells=cells,
    )


def with_further(visible: Any, found: NDArray[np.float32]) -> tuple[NDArray[np.int64], Any]:
    """The cells of eight rows of further samples, half of them holes, in no order; and the picture
    with these rows."""
    from addon.glsl.shader import read_texture, texture_from_array

    width = visible.position.width
    holes = np.flatnonzero(found[..., 0].ravel() < 0.0)
    rng = np.random.default_rng(5)
    half = rng.choice(holes, 4 * width), rng.integers(0, found[..., 0].size, 4 * width)
    pixel = rng.permutation(np.concatenate(half))
    whole = {}
    formats: dict[str, Any] = {"position": "RGBA32F", "normal": "RGBA32F", "triangles": "RG32F"}
    for name, texture_format in formats.items():
        picture = read_texture(getattr(visible, name))
        rows = picture.reshape(-1, picture.shape[-1])[pixel].reshape(8, width, -1)
        whole[name] = texture_from_array(np.concatenate([picture, rows]), texture_format)
    return np.stack([pixel % width, pixel // width], axis=1), replace(visible, **whole)


@pytest.mark.parametrize("aside", ASIDE)
def test_what_hides_a_hole_does_not_show_in_it(aside: float) -> None:
    """The texels beside the plate's edge are the plate's, those of the wall's last pixels too."""
    drawn = gathered(pictures(colors), looking_from(aside))
    wall = drawn.position[..., 3] == WALL
    holes = wall & (drawn.kind == -1)
    assert holes.sum() > 40
    # A step of the pages' colour.
    assert drawn.color[holes].min() > 1.0 - 1.0 / 255.0
    plate = drawn.position[..., 3] == PLATE
    assert drawn.color[plate & (drawn.kind != 0), 1:].max() < 1.0 / 255.0


@pytest.mark.parametrize("further", [False, True])
def test_holes_are_filled_as_by_their_twin(*, further: bool) -> None:
    """In the picture, and of samples in rows above it whose cells lie anywhere."""
    scene, view = pictures(patterns), looking_from(0.06)
    drawn = gathered(scene, view, further=further)
    color, kind = twin.fill(
        scene[1], drawn.found, drawn.position[..., :3] + view.origin, drawn.normal,
        material=np.rint(drawn.position[..., 3]).astype(np.int64), origin=view.origin,
        channel="diffuse_color", cells=drawn.cells,
    )  # fmt: skip
    holes = drawn.found[..., 0] < 0.0
    for rows in (np.s_[: view.height], np.s_[view.height :])[: 1 + further]:
        some = holes[rows]
        assert some.sum() > 100
        same = drawn.kind[rows][some] == kind[rows][some]
        # Two texels of a footprint that are as sure as each other, or on a bound: rounding decides.
        assert same.mean() > 0.98
        filled = (drawn.kind[rows][some] == -1) & same
        assert filled.sum() > 100
        error = np.abs(drawn.color[rows][some] - color[rows][some])[filled].max(axis=1)
        # The pages hold the root of the colour in steps of 1/255: half a step, doubled by squaring.
        assert np.percentile(error, 95) < 1.0 / 255.0
        assert error.mean() < 1.0 / 255.0
