# SPDX-License-Identifier: GPL-3.0-or-later
"""Shading samples that are shaded where visibility samples hit them: of thin, bent and glossy
things, each for one pixel, and of what no cell's middle sees."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.corrmap.bent_surfaces import BentSurfaces
from addon.corrmap.own_hits import ALL_LOOKS, OwnHits, OwnHitsBuilder
from addon.corrmap.pixel_lists import ListBuilder, PixelLists
from addon.corrmap.surface_layout import SurfaceLayout
from addon.corrmap.triangle_codes import TriangleCodes
from addon.scene.geometry import SceneGeometry
from addon.scene.octahedral import to_codes
from tests import synthetic
from tests.corrmap.test_shading_normals import bent
from tests.reference.shading_normal import shading_normals

VISIBILITY = 24
SIZE = (24, 18)
# Metal, and a wall without highlights.
PLAN = ChannelPlan(
    ("depth", "normal"), {"specular_f0": (0.9, 0.9, 0.9)}, ("Metal", "Wall"),
    material_constants={"roughness": ((0.3,), (1.0,))},
)  # fmt: skip


def tube(radius: float, sides: int = 8) -> SceneGeometry:
    """Upright before a wall, smooth."""
    angle = 2.0 * np.pi * np.arange(sides) / sides + 0.1
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    up = np.array([0.1, 0.0, 2.0])
    wall = np.array([[-4.0, 2.0, -4.0], [4.0, 2.0, -4.0], [4.0, 2.0, 4.0], [-4.0, 2.0, 4.0]])
    vertices = np.concatenate([radius * ring - up, radius * ring + up, wall])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    triangles = np.concatenate(
        [
            np.stack([i, j, j + sides], axis=1),
            np.stack([i, j + sides, i + sides], axis=1),
            2 * sides + np.array([[0, 1, 2], [0, 2, 3]]),
        ]
    )
    count = len(triangles)
    normals = np.concatenate([ring, ring, np.tile([0.0, -1.0, 0.0], (4, 1))])
    is_wall = (np.arange(count) >= 2 * sides).astype(np.int32)
    return SceneGeometry(
        vertices=vertices,
        triangles=triangles.astype(np.int32),
        object_id=is_wall,
        material_id=is_wall,
        weight=np.ones(count, dtype=np.float32),
        camera_visible=np.ones(count, dtype=bool),
        shadow_visible=np.ones(count, dtype=bool),
        object_names=("Tube", "Wall"),
        material_names=PLAN.material_names,
        corner_normals=to_codes(normals[triangles]),
    )


def table() -> NDArray[np.float32]:
    """The material table of `PLAN`: no means, and the roughness of both materials."""
    layout = SurfaceLayout(PLAN)
    rows = np.zeros((layout.scale_row, 4, 4), dtype=np.float32)
    rows[layout.constant_row, :, 0] = [1.0, 0.3, 1.0, 1.0]
    return rows


def test_turns_are_the_normals_derivative() -> None:
    geometry = bent(synthetic.room_with_box())
    found = BentSurfaces.of(
        geometry, TriangleCodes.of_all(len(geometry)), SurfaceLayout(PLAN), table()
    )
    assert found is not None
    corner = geometry.vertices[geometry.triangles]
    middle, step = corner.mean(axis=1), 1e-4
    along = corner[:, 1] - corner[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(geometry.normal, along)
    every = np.arange(len(geometry))
    sides = [
        [shading_normals(geometry, every, middle + sign * step * way) for sign in (1.0, -1.0)]
        for way in (along, across)
    ]
    turn = np.sqrt(sum(np.sum((a - b) ** 2, axis=1) for a, b in sides)) / (2.0 * step)
    # Unit normals turn a little more slowly, or faster, than those that are not made unit: the
    # corners lean by up to 50 degrees.
    assert np.all(turn < found.turn(every) / 0.6)
    assert np.all(turn > 0.6 * found.turn(every))


def test_only_what_has_highlights_is_bent() -> None:
    codes = TriangleCodes.of_all(18)
    found = BentSurfaces.of(tube(0.1), codes, SurfaceLayout(PLAN), table())
    assert found is not None
    assert found.widest[1] == pytest.approx(0.09)
    assert np.isinf(found.widest[0])  # nothing is seen there
    dull = SurfaceLayout(replace(PLAN, constants={}))
    assert BentSurfaces.of(tube(0.1), codes, dull, table()) is None
    flat = replace(tube(0.1), corner_normals=None)
    assert BentSurfaces.of(flat, codes, SurfaceLayout(PLAN), table()) is None


def made_lists(
    geometry: SceneGeometry, *, with_bent: bool = True
) -> tuple[PixelLists, list[Any], BentSurfaces]:
    """The lists of a view of the tube, and what its visibility samples see."""
    from addon.corrmap.geometry_buffer import GeometryBuffer
    from addon.corrmap.pixel_list_pass import PixelListPass
    from addon.corrmap.view_looks import ViewLooks
    from addon.corrmap.visible_surface import VisibleSurfacePass
    from addon.glsl.shader import read_texture

    view = synthetic.perspective_view(
        synthetic.looking_at((0.3, -4.0, 0.2), (0.0, 0.0, 0.0)), *SIZE, 0.9
    )
    buffer = GeometryBuffer(geometry, view.origin)
    found = BentSurfaces.of(geometry, buffer.codes, SurfaceLayout(PLAN), table())
    assert found is not None
    looks = ViewLooks(view, VisibleSurfacePass(buffer))
    own = looks.pinhole(0)
    builder = ListBuilder(read_texture(own.position), read_texture(own.normal)[..., :3])
    lists = PixelListPass(looks, found if with_bent else None)
    for k in range(VISIBILITY):
        lists.add(builder, own, k)
    return builder.finish(), [looks.visible(k) for k in range(VISIBILITY)], found


def test_a_thin_tubes_samples_serve_their_pixels_alone(gpu_context: None) -> None:
    from addon.glsl.shader import read_texture

    # Two pixels wide.
    lists, seen, _ = made_lists(tube(0.16))
    hits = of_tube(lists.own_hits)
    assert len(hits) > 500
    pixel = np.repeat(np.arange(len(lists.count)), lists.count)
    served = np.unique(hits.sample)
    further = served[served >= len(lists.count)]
    entries = np.isin(lists.sample, further)
    # One pixel each, of its own cell, as many hits as the sample's weight says.
    assert len(np.unique(lists.sample[entries])) == entries.sum() == len(further)
    at = lists.sample[entries] - len(lists.count)
    np.testing.assert_array_equal(lists.cell[at], pixel[entries])
    times = np.bincount(hits.sample, minlength=lists.sample.max() + 1)
    weight = times[lists.sample[entries]] / VISIBILITY
    np.testing.assert_allclose(lists.weight[entries], weight, rtol=1e-6)
    # Where the pixel itself sees the surface, with the normal there.
    place = np.stack([read_texture(look.position).reshape(-1, 4) for look in seen])
    cell = np.concatenate([np.arange(len(lists.count)), lists.cell])
    distance = np.abs(place[:, cell[hits.sample], :3] - hits.position[:, :3]).max(axis=2)
    assert (distance.min(axis=0) == 0.0).all()
    total = np.bincount(pixel, lists.weight, len(lists.count))
    np.testing.assert_allclose(total[lists.count > 0], 1.0, atol=1e-6)


def of_tube(hits: OwnHits, material: float = 1.0) -> OwnHits:
    """Those on one material."""
    on = hits.position[:, 3] == material
    return OwnHits(hits.sample[on], hits.position[on], hits.normal[on], hits.triangle[on])


def test_what_no_middle_sees_is_known_by_its_hits(gpu_context: None) -> None:
    """The wall's samples in cells whose middles see the tube are shared as ever; each has all the
    hits that it serves, in its own cell."""
    lists, _, _ = made_lists(tube(0.16))
    hits, pixels = of_tube(lists.own_hits, 2.0), len(lists.count)
    assert len(hits) > 50
    assert (hits.sample >= pixels).all()
    shared = np.isin(lists.sample, hits.sample)
    served = np.bincount(lists.sample[shared], lists.weight[shared] * VISIBILITY)
    times = np.bincount(hits.sample, minlength=len(served))
    np.testing.assert_allclose(served, times, atol=1e-3)
    entries = np.bincount(lists.sample[shared])
    assert entries.max() > 1


def test_what_is_wide_is_shared(gpu_context: None) -> None:
    """A tube that fills the picture bends by less within a pixel than its highlight is wide."""
    wide = tube(2.5, sides=64)
    lists, _, _ = made_lists(wide)
    plain, _, _ = made_lists(wide, with_bent=False)
    assert (lists.own_hits.sample >= len(lists.count)).all()
    np.testing.assert_array_equal(lists.own_hits.sample, plain.own_hits.sample)
    np.testing.assert_array_equal(lists.sample, plain.sample)
    np.testing.assert_array_equal(lists.weight, plain.weight)


def test_hits_are_found_by_turns(gpu_context: None) -> None:
    """As the pass that places the samples reads them."""
    from addon.glsl.row_texture import ROW_WIDTH
    from addon.glsl.shader import read_texture

    lists, _, _ = made_lists(tube(0.16))
    rows = -(-len(lists.cell) // lists.width)
    textures = lists.own_hits.textures(lists.width, lists.height + rows)
    first, count = np.moveaxis(read_texture(textures["hit_range"]), -1, 0).astype(int)
    assert count.sum() == len(lists.own_hits)
    sample = int(lists.own_hits.sample[-1])
    row, column = divmod(sample, lists.width)
    mine = lists.own_hits.sample == sample
    assert count[row, column] == mine.sum()
    at = first[row, column] + np.arange(mine.sum())
    position = read_texture(textures["hit_position"])[at // ROW_WIDTH, at % ROW_WIDTH]
    np.testing.assert_array_equal(position, lists.own_hits.position[mine])


def test_with_little_room_the_first_looks_hits_are_kept() -> None:
    builder = OwnHitsBuilder(most=10)
    for look in range(6):
        # Twice, as for each of a view's layers.
        for count in (2, 1):
            builder.add(hits_of(np.arange(count), look), look)
    found = builder.finish()
    assert found.looks == 3
    # The look that went beyond it may be here in part.
    whole = found.position[:, 0] < found.looks
    np.testing.assert_array_equal(found.sample[whole], np.repeat([0, 1], [6, 3]))
    np.testing.assert_array_equal(found.position[whole, 0], [0, 0, 1, 1, 2, 2, 0, 1, 2])
    assert len(found) <= 10
    builder = OwnHitsBuilder(most=10)
    builder.add(hits_of(np.arange(10), 0), 0)
    assert builder.finish().looks == ALL_LOOKS


def hits_of(sample: NDArray[np.int64], look: int) -> OwnHits:
    place = np.full((len(sample), 4), look, dtype=np.float32)
    return OwnHits(sample, place, place[:, :3], place[:, :2])
