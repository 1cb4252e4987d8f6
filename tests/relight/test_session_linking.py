# SPDX-License-Identifier: GPL-3.0-or-later
"""What a session redoes when a light is linked otherwise, and that its pictures show it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.traced_triangles import TrianglesByRay
from addon.glsl.shader import read_texture
from addon.relight.lights.light_edit import changed_parts
from addon.scene.geometry import SceneGeometry
from addon.scene.light import Light
from addon.scene.light_linking import LightLinking, LinkedObjects, ObjectSelection, ObjectWeight
from addon.scene.view import View

from .test_session import MemoryStore, counted_draws, open_session, point_light
from .test_session import room as room  # noqa: PLC0414 - a fixture is exported so

pytestmark = pytest.mark.usefixtures("gpu_context")

# The room is "part 0", the box in it "part 1".
BOX = frozenset(["part 1"])
KEY = point_light("Key", (-1.0, -1.2, 1.5))


def linked(light: Light, **linking: Any) -> Light:
    return replace(light, linking=LightLinking(**linking))


def seen_box(session: Any) -> NDArray[np.bool_]:
    """(2, H, W) where a whole pixel sees the box, and where none of it does."""
    while session._find_shading_samples():
        pass
    lists = session._sampler.lists.lists
    objects = read_texture(session._sampler.sample(0, with_objects=True).objects)[..., 0]
    whole = (lists.count == 0).reshape(objects.shape)
    return np.stack([whole & (objects == 2.0), whole & (objects == 1.0)])


@pytest.mark.parametrize("traced", [False, True])
def test_objects_that_are_asked_for_later(
    room: tuple[SceneGeometry, MemoryStore, View], traced: bool
) -> None:
    """They are those of the triangles that the sample has, however these were found."""
    sampler = open_session(room)._sampler
    if traced:
        by_ray = TrianglesByRay(sampler.geometry_buffer, sampler.local_scene, 0, software=True)
        sampler.local_scene.mesh(sampler.geometry.camera_visible)
        sampler._by_ray = by_ray
    first = sampler.sample(0)
    assert first.objects is None
    # From here on the rasterizer alone would be asked.
    sampler._by_ray = None
    surface = sampler.sample(0, with_objects=True)
    assert surface.position is first.position
    assert surface.triangles is not None
    triangle = surface.triangles.read()
    expected = np.where(triangle >= 0, sampler.geometry.object_id[triangle] + 1, 0)
    assert len(np.unique(expected)) >= 2
    np.testing.assert_array_equal(read_texture(surface.objects)[..., 0], expected)


def test_pictures(room: tuple[SceneGeometry, MemoryStore, View]) -> None:
    session = open_session(room)
    session.set_lights([KEY])
    whole = session.render().layers["Key"]
    box, others = seen_box(session)
    assert box.any()
    assert others.any()
    selection = ObjectSelection((ObjectWeight("part 1", 2.0, 2.0),), 0.5)
    session.set_lights([linked(KEY, selection=selection)])
    weighted = session.render().layers["Key"]
    # Weights that are powers of two change no digit.
    np.testing.assert_array_equal(weighted[box], 2.0 * whole[box])
    np.testing.assert_array_equal(weighted[others], 0.5 * whole[others])
    session.set_lights([linked(KEY, receivers=LinkedObjects(excluded=BOX))])
    excluded = session.render().layers["Key"]
    assert not excluded[box].any()
    np.testing.assert_array_equal(excluded[others], whole[others])
    session.set_lights([linked(KEY, blockers=LinkedObjects(excluded=BOX))])
    unblocked = session.render().layers["Key"]
    lit_now = (unblocked > whole + 0.1 * whole.max()).any(axis=-1)
    assert lit_now[others].any(), "the box casts no shadow any more"
    session.set_lights([KEY])
    np.testing.assert_array_equal(session.render().layers["Key"], whole)


def test_only_what_depends_is_redone(
    room: tuple[SceneGeometry, MemoryStore, View], monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room)
    fill = point_light("Fill", (1.5, 1.0, 1.6))
    session.set_lights([KEY, fill])
    before = session.render().layers
    surfaces = dict(session._sampler._shading._kept)
    assert len(surfaces) == 2
    maps = session._drawing.shadow_bytes
    session.set_lights([linked(KEY, receivers=LinkedObjects(BOX)), fill])
    with counted_draws(session, monkeypatch) as shaded:
        after = session.render().layers
    assert set(shaded) == {"Key"}
    np.testing.assert_array_equal(after["Fill"], before["Fill"])
    assert session._drawing.shadow_bytes == maps
    # The surfaces were not read from the cache again: they only learned which objects they are.
    kept = session._sampler._shading._kept
    assert all(kept[k][0].values is surfaces[k][0].values for k in surfaces)
    assert all(kept[k][0].objects is not None for k in kept)


def test_a_scene_without_links_has_no_objects(
    room: tuple[SceneGeometry, MemoryStore, View],
) -> None:
    session = open_session(room)
    session.set_lights([KEY])
    session.render()
    assert all(surface.objects is None for surface in session._sampler._samples.values())


@pytest.mark.parametrize("traced", [False, True])
def test_each_stage_of_the_picture(
    room: tuple[SceneGeometry, MemoryStore, View], traced: bool
) -> None:
    """Coarse, preview and refined layers alike leave out what is not lit."""
    from addon.relight.session import RelightSession
    from addon.relight.shadows.shadow_frustum import ShadowSettings

    geometry, store, view = room
    shadows = ShadowSettings(method="traced" if traced else "map")
    session: Any = RelightSession(geometry, cast("Any", store), 2, shadows)
    session.set_view(view)
    session.set_world(None)
    session._preview_s = 1.0
    session.set_lights([linked(KEY, receivers=LinkedObjects(excluded=BOX))])
    other: Any = open_session(room)
    box, _ = seen_box(other)
    # A coarse pixel of 4 x 4 shows what its middle sees.
    inner = box.copy()
    for axis in (0, 1):
        for shift in range(-3, 4):
            inner &= np.roll(box, shift, axis)
    assert inner.any()
    stages = 0
    while session.step():
        stages += 1
        picture = read_texture(session.draw_combined())[..., :3]
        assert not picture[inner].any()
    assert stages > 3
    assert picture.any()


def test_what_a_link_changes_of_a_light() -> None:
    """Receivers and weights leave shadow maps as they are."""
    some = LinkedObjects(BOX)
    weights = ObjectSelection((), 0.5)
    assert changed_parts(KEY, linked(KEY, receivers=some)) == ("shape",)
    assert changed_parts(KEY, linked(KEY, selection=weights)) == ("shape",)
    assert changed_parts(KEY, linked(KEY, blockers=some)) == ("shadow casting", "shape")
    assert changed_parts(linked(KEY, blockers=some), linked(KEY, blockers=some)) == ()


def test_glowing_objects_are_linked(room: tuple[SceneGeometry, MemoryStore, View]) -> None:
    """A box that glows for nobody leaves the room dark, and lights it again when that is undone."""
    geometry, store, view = room
    glow = {"emission": ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))}
    plan = replace(store.plan, material_constants=glow)
    session = open_session((geometry, replace(store, plan=plan), view))
    session.set_lights([])
    before = session.render().layers["part 1"]
    assert before.any()
    session.set_emitter_linking({"part 1": LightLinking(LinkedObjects(BOX))})
    # A closed convex thing lights itself by no more than rounding leaves; but along its edges the
    # cache's texels may show another side's normal.
    left = session.render().layers["part 1"].max(axis=-1)
    assert left[seen_box(session).any(axis=0)].max() < 1e-6 * before.max()
    assert left.max() < 0.03 * before.max()
    session.set_emitter_linking({})
    np.testing.assert_array_equal(session.render().layers["part 1"], before)
