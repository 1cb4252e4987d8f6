# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures made of shared shading samples beside pictures that shade every sample."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap.same_surface import same_surface
from addon.corrmap.shading_samples import GATHERED
from addon.glsl.shader import read_texture
from addon.relight.session import VISIBILITY_SAMPLES
from addon.relight.world.world_pass import WorldTextures
from addon.scene.exposure import Exposure
from addon.scene.geometry import SceneGeometry
from addon.scene.lens import Lens
from addon.scene.light_linking import LightLinking, LinkedObjects
from addon.scene.view import View
from addon.scene.world import World
from tests import synthetic

from .test_session import MemoryStore, counted_draws, point_light
from .test_session import room as room  # noqa: PLC0414 - a fixture is exported so

pytestmark = pytest.mark.usefixtures("gpu_context")

Room = tuple[SceneGeometry, MemoryStore, View]
VISIBILITY = 32
KEY = replace(point_light("Key", (-1.0, -1.2, 1.5)), shadow_soft_size=0.3)


def open_session(room: Room, samples: int, visibility: int | None, view: View | None = None) -> Any:
    from addon.relight.session import RelightSession

    geometry, store, own = room
    session = RelightSession(geometry, cast("Any", store), samples, visibility=visibility)
    session.set_world(None)
    session.set_view(own if view is None else view)
    return session


def listed(session: Any) -> NDArray[np.bool_]:
    """(H, W) the pixels that have a list."""
    lists = session._sampler.lists.lists
    return np.asarray((lists.count > 0).reshape(lists.height, lists.width))


def alike(session: Any, count: int) -> NDArray[np.bool_]:
    """(H, W) where some samples of the view read the same from the cache."""
    samples = [session._sampler.sample(k).values for k in range(count)]
    values = np.stack([np.stack([read_texture(t) for t in sample]) for sample in samples])
    return np.asarray((np.ptp(values, axis=0) <= 1e-6).all(axis=(0, 3)))


def test_nothing_is_lost_where_nothing_is_shared(room: Room) -> None:
    """Brute force to float precision away from edges, and nearer the truth than it at edges."""
    brute, shared = (open_session(room, 8, v) for v in (0, VISIBILITY))
    for session in (brute, shared):
        session.set_lights([KEY])
    want, got = brute.render(), shared.render()
    edges = listed(shared)
    assert 0.02 < edges.mean() < 0.3
    # Beside an edge the cache's texels may show the other side of it to some of the hits.
    plain = ~edges & alike(brute, GATHERED)
    assert plain.mean() > 0.85 * (~edges).mean()
    # Means of eight: eight float32 roundings.
    np.testing.assert_allclose(got.combined[plain], want.combined[plain], rtol=2e-6, atol=1e-9)
    np.testing.assert_array_equal(got.combined[..., 3], 1.0)
    # The light's points are those of eight samples; with more, only edges get better.
    small = replace(KEY, shadow_soft_size=0.0)
    truth = open_session(room, 128, 0)
    for session in (brute, shared, truth):
        session.set_lights([small])
    exact = truth.render().combined[edges]
    error = [
        float(np.sqrt(np.mean((session.render().combined[edges] - exact) ** 2)))
        for session in (brute, shared)
    ]
    assert error[1] < 0.6 * error[0]


def test_shading_samples_hardly_outnumber_pixels(room: Room) -> None:
    session = open_session(room, 2, 64)
    session.set_lights([KEY])
    session.render()
    textures = session._sampler.lists
    assert 1.0 <= textures.lists.samples_per_pixel < 1.15
    assert textures.lists.visibility == 64


def test_a_light_edit_shades_and_finds_nothing_else(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = open_session(room, 3, VISIBILITY)
    session.set_lights([KEY])
    first = session.render().combined
    lists = session._sampler.lists
    moved = replace(KEY, world_from_light=KEY.world_from_light @ np.diag([1.0, 1.0, 1.0, 1.0]))
    moved.world_from_light[0, 3] += 0.5
    session.set_lights([moved])
    with counted_draws(session, monkeypatch) as shaded:
        session.render()
    assert shaded == ["Key"] * 3
    assert session._sampler.lists is lists
    session.set_lights([KEY])
    np.testing.assert_array_equal(session.render().combined, first)


def test_the_first_pictures_do_not_wait_for_the_lists(room: Room) -> None:
    session = open_session(room, 4, VISIBILITY)
    session.set_lights([KEY])
    plain = open_session(room, 1, 0)
    plain.set_lights([KEY])
    while not session.shown_stride:
        assert session._sampler.lists is None
        assert session.step()
    np.testing.assert_array_equal(read_texture(session.draw_combined()), plain.render().combined)
    steps = 0
    while session._sampler.lists is None:
        assert session.samples_done == 0
        assert session.step()
        # What is shown stays.
        assert session.shown_stride == 1
        steps += 1
    # One visibility sample at a time, so that an edit waits for no more than that.
    assert steps >= VISIBILITY
    while session.step():
        pass
    whole = open_session(room, 4, VISIBILITY)
    whole.set_lights([KEY])
    np.testing.assert_array_equal(session.render().combined, whole.render().combined)


def test_progress_never_goes_back(room: Room) -> None:
    session = open_session(room, 3, VISIBILITY)
    session.set_lights([KEY])
    told: list[float] = []
    session.render(lambda fraction, _: told.append(fraction))
    assert len(told) > VISIBILITY + 3
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_a_single_sample_has_no_lists(room: Room) -> None:
    session = open_session(room, 1, VISIBILITY)
    session.set_lights([KEY])
    session.render()
    while session.step():
        pass
    assert session._sampler.lists is None
    assert session.warnings == ()


def test_pictures_that_are_too_large_for_lists_say_so(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are the mean of whole pictures, one for each sample of the lights."""
    brute = open_session(room, 3, 0)
    large = open_session(room, 3, VISIBILITY)
    for session in (brute, large):
        session.set_lights([KEY])
    height, width = (brute._view.height, brute._view.width)
    with monkeypatch.context() as patch:
        patch.setattr("addon.corrmap.shading_samples._MOST", 2 * width * height)
        np.testing.assert_array_equal(large.render().combined, brute.render().combined)
        (said,) = large.warnings
    assert f"{width}x{height} pixels" in said
    assert "render a region" in said
    assert brute.warnings == ()
    # Another view may have its lists.
    large.set_view(replace(brute._view, name="Another"))
    large.set_view(brute._view.region(0, 0, width // 2, height))
    assert large.warnings == ()
    large.render()
    assert large.warnings == ()


def test_lists_that_are_cut_short_say_so(room: Room, monkeypatch: pytest.MonkeyPatch) -> None:
    session = open_session(room, 2, VISIBILITY)
    session.set_lights([KEY])
    monkeypatch.setattr("addon.corrmap.shading_samples._MOST_ENTRIES", 1)
    session.render()
    count = session._sampler.lists.lists.visibility
    assert 1 < count < VISIBILITY
    (said,) = session.warnings
    assert f"{count} instead of {VISIBILITY}" in said


@pytest.mark.parametrize("name", ["_MOST_ENTRIES", "_MOST"])
def test_lists_shorter_than_the_lights_samples_are_not_made(
    room: Room, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Out of focus all visibility samples of a pixel are others, and lists soon too long; or there
    are more samples than can be told apart. Shading each of the lights' samples by itself sees
    more then."""
    _, _, view = room
    blurred = replace(view, lens=Lens(radius=0.2, focus_distance=4.0))
    pixels = view.width * view.height
    # Room for a few visibility samples; for a sample of each pixel and five more.
    room_for = {"_MOST_ENTRIES": 2 * pixels, "_MOST": pixels + 5}[name]
    monkeypatch.setattr(f"addon.corrmap.shading_samples.{name}", room_for)
    monkeypatch.setattr("addon.corrmap.surface_sampler.fits_lists", lambda *_: True)
    short, brute = (open_session(room, 16, v, blurred) for v in (VISIBILITY, 0))
    for session in (short, brute):
        session.set_lights([KEY])
    np.testing.assert_array_equal(short.render().combined, brute.render().combined)
    assert short._sampler.lists is None
    (said,) = short.warnings
    assert f"16 instead of {VISIBILITY}" in said
    # Another view has its lists.
    monkeypatch.undo()
    short.set_view(view)
    short.render()
    assert listed(short).any()
    assert short.warnings == ()


def test_numbers_of_samples_are_told_apart(room: Room) -> None:
    """Up to 2^24: from 2^23 on, float32 has no halves."""
    from addon.corrmap.own_hits import OwnHits
    from addon.corrmap.pixel_list_pass import PixelListTextures
    from addon.corrmap.pixel_lists import PixelLists
    from addon.glsl.shader import framebuffer, texture_2d, texture_from_array
    from addon.relight.layers.resolve_pass import _RESOLVE

    width, rows = 4096, 4096
    atlas = np.zeros((rows, width, 2), dtype=np.float32)
    atlas[..., 0] = np.arange(rows * width).reshape(rows, width) % 1000
    atlas[..., 1] = np.arange(rows * width).reshape(rows, width) // 1000
    number = np.array([3, 8388607, 8388608, 8388609, 8388611, 12000001, 16777213, 16777215])
    # A list that is longer than the rest of its row of entries, and longer than 2048.
    count = np.zeros(width, dtype=np.int64)
    count[: len(number)] = 1
    count[len(number)] = 5000
    nothing = np.zeros((0, 4), dtype=np.float32)
    lists = PixelLists(
        height=1,
        width=width,
        first=np.cumsum(count) - count,
        count=count,
        sample=np.concatenate([number, np.arange(5000)]),
        weight=np.repeat([1.0, 1.0 / 4096.0], [len(number), 5000]).astype(np.float32),
        cell=np.zeros(0, dtype=np.int64),
        position=nothing,
        normal=nothing[:, :3],
        triangle=nothing[:, :2],
        visibility=5000,
        own_hits=OwnHits(np.zeros(0, dtype=np.int64), nothing, nothing[:, :3], nothing[:, :2]),
    )
    picture = texture_2d(width, 1)
    _RESOLVE.build().draw_fullscreen(
        framebuffer([picture]),
        {
            "shaded": texture_from_array(atlas, "RG32F"),
            **PixelListTextures(lists).textures(),
        },
        {},
    )
    got = read_texture(picture)[0, : len(number) + 1, :2].astype(np.float64)
    np.testing.assert_array_equal(1000.0 * got[:-1, 1] + got[:-1, 0], number)
    every = np.arange(5000)
    expected = np.array([(every % 1000).sum(), (every // 1000).sum()]) / 4096.0
    # A sum of 5000 float32, each rounded.
    np.testing.assert_allclose(got[-1], expected, rtol=5000 * 2.0**-24)


def test_linked_objects_are_known_in_the_atlas(room: Room) -> None:
    """A light that only the box gets, at the box's edges too."""
    only_box = replace(
        point_light("Key", (-1.0, -1.2, 1.5)),
        use_shadow=False,
        linking=LightLinking(receivers=LinkedObjects(frozenset(["part 1"]))),
    )
    shared, truth = open_session(room, 2, 64), open_session(room, 64, 0)
    for session in (shared, truth):
        session.set_lights([only_box])
    got, want = (session.render().layers["Key"] for session in (shared, truth))
    edges = listed(shared)
    assert want.max() > 0.0
    np.testing.assert_allclose(got[~edges], want[~edges], rtol=0.05, atol=1e-3 * want.max())
    # The share of each object in a pixel is that of the same 64 visibility samples; two samples of
    # the light's own are within a few percent of the shading of all.
    assert np.abs(got - want).max() < 0.06 * want.max()


def test_the_world_behind_edges(room: Room) -> None:
    """The background lies where each sample of it is seen."""
    _, store, _ = room
    corner = synthetic.box((0.0, 0.0, 0.0), 1.0)
    alone = synthetic.geometry_of([corner, synthetic.box((0.0, 0.0, -50.0), 0.01)])
    view = synthetic.perspective_view(
        synthetic.looking_at((1.5, -2.6, 1.9), (0.0, 0.0, 0.0)), 48, 36, 0.9
    )
    height, width = 64, 128
    row, column = np.mgrid[:height, :width]
    picture = np.stack(
        [0.5 + 0.4 * np.sin(column / 5.0), 0.5 + 0.4 * np.cos(row / 4.0), 0.2 + 0.0 * row], axis=-1
    )
    world = World(None, picture.astype(np.float32))
    pictures = []
    for samples, visibility in ((4, 16), (16, 0)):
        session = open_session((alone, store, view), samples, visibility)
        # The surfaces are left dark: this is about what lies behind them.
        session._world, session._world_textures = world, WorldTextures.upload(world)
        session._drawing._add_world = lambda *_: None
        pictures.append(session.render().combined)
        if visibility:
            edges = listed(session)
    got, want = pictures
    assert 0.05 < edges.mean() < 0.5
    sky = want[..., 2] > 0.199
    assert sky.mean() > 0.2
    assert np.abs(got - want)[~edges].max() < 0.02
    assert np.abs(got - want).max() < 0.06


def blurred(room: Room, how: str) -> tuple[View, Exposure | None]:
    _, _, view = room
    if how == "lens":
        # In focus is the room's far side.
        return replace(view, lens=Lens(radius=0.2, focus_distance=4.0)), None
    poses = np.tile(np.eye(4), (2, 1, 1, 1))
    poses[:, 0, 0, 3] = (-0.3, 0.3)
    still = np.eye(4)[None]
    moving = Exposure((view,), np.array([1]), poses, still, np.array([0.0, 1.0]))
    if how == "object":
        return view, moving
    if how == "vanishing":
        steps = np.tile(np.eye(4), (5, 1, 1, 1))
        steps[3:, :, 2, 2] = 0.0
        return view, replace(moving, world_from_object=steps)
    turned = replace(view, world_from_camera=view.world_from_camera.copy())
    turned.world_from_camera[:3, 3] += (0.1, 0.05, 0.0)
    none = np.zeros((2, 0, 4, 4)), np.zeros((0, 4, 4))
    return view, Exposure((view, turned), np.zeros(0, np.int64), *none, np.array([0.0, 1.0]))


@pytest.mark.parametrize("how", ["lens", "object", "vanishing", "camera"])
def test_blur_is_that_of_brute_force(room: Room, how: str) -> None:
    """With 16 shaded samples for 48 that are seen; the shadow's edge is sharp in each of them."""
    view, exposure = blurred(room, how)
    pictures = {}
    for name, samples, visibility in (("shared", 16, 48), ("brute", 48, 0), ("sharp", 16, 48)):
        session = open_session(room, samples, visibility, replace(view, lens=None))
        if name != "sharp":
            session.set_view(view)
            session.set_exposure(exposure)
        session.set_lights([replace(KEY, shadow_soft_size=0.0)])
        pictures[name] = session.render().combined[..., :3]
        if name == "shared":
            lists = session._sampler.lists.lists
            assert lists.samples_per_pixel < 2.0
            assert np.isfinite(pictures[name]).all()
            # A light edit sees nothing anew.
            kept = session._sampler.lists
            session.set_lights([replace(KEY, shadow_soft_size=0.0, energy=3.0)])
            session.render()
            assert session._sampler.lists is kept
    off, sharp = (
        float(np.sqrt(np.mean((pictures[name] - pictures["brute"]) ** 2)))
        for name in ("shared", "sharp")
    )
    assert sharp > 0.03 * pictures["brute"].mean()
    assert off < 0.4 * sharp


def test_another_view_is_not_blurred_by_the_last_ones_shutter(room: Room) -> None:
    _, exposure = blurred(room, "object")
    session = open_session(room, 2, 16)
    session.set_lights([KEY])
    plain = session.render().layers["Key"]
    session.set_exposure(exposure)
    assert np.abs(session.render().layers["Key"] - plain).max() > 0.1 * plain.max()
    session.set_exposure(None)
    np.testing.assert_array_equal(session.render().layers["Key"], plain)


def test_more_samples_bring_as_many_looks(room: Room) -> None:
    """Lists of a few looks would keep their error at edges however many samples are shaded."""
    changed, fresh = open_session(room, 4, None), open_session(room, 80, None)
    for session in (changed, fresh):
        session.set_lights([replace(KEY, shadow_soft_size=0.0)])
    changed.render()
    assert changed._sampler.lists.lists.visibility == 64
    changed.set_samples(80)
    got, want = changed.render(), fresh.render()
    assert changed._sampler.lists.lists.visibility == 80
    np.testing.assert_array_equal(got.combined, want.combined)
    changed.set_samples(8)
    changed.render()
    assert changed._sampler.lists.lists.visibility == 64


def test_samples_are_shaded_where_pixels_see_them(room: Room) -> None:
    """Not more often in the pixel's middle, where an edge hides the rest of the surface: along an
    edge, light changes across it."""
    session = open_session(room, 2, None)
    session.set_lights([KEY])
    session.render()
    sampler, view = session._sampler, room[2]
    shading, own = sampler._shading, sampler.looks.pinhole(0)
    place, facing = (read_texture(t) for t in (own.position, own.normal))
    count = np.zeros((*place.shape[:2], 1))
    seen, shaded = np.zeros((2, *place.shape[:2], 2))
    film = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in place.shape[1::-1])), axis=-1)
    for k in range(VISIBILITY_SAMPLES):
        hit = sampler.looks.pinhole(k)
        mine = same_surface(
            place, facing[..., :3], read_texture(hit.position), read_texture(hit.normal)[..., :3]
        )[..., None]
        count += mine
        seen += mine * np.array(sampler.looks.offset(k))
        at = read_texture(shading._hits(k).position)[: len(place), :, :3]
        x, y, _, _ = np.moveaxis(
            view.project(at.astype(np.float64) + sampler.looks.surfaces.origin), -1, 0
        )
        shaded += (np.stack([x, y], axis=-1) - film) / VISIBILITY_SAMPLES
    share = count / VISIBILITY_SAMPLES
    partly = ((share > 0.3) & (share < 0.8) & (place[..., 3:] > 0.0))[..., 0]
    assert partly.sum() > 100
    seen = (seen / np.maximum(count, 1.0))[partly]
    # How far from the middle towards what is seen they are shaded, 1 for all of the way.
    way = (shaded[partly] * seen).sum() / (seen * seen).sum()
    assert way == pytest.approx(1.0, abs=0.1)


def test_many_samples_are_each_pixels_own(room: Room) -> None:
    """Where a shadow lies along an edge, the mean over a neighbour's pixel is not this one's."""
    session = open_session(room, 2, 65)
    session.set_lights([KEY])
    session.render()
    lists = session._sampler.lists.lists
    pixels = lists.height * lists.width
    pixel = np.repeat(np.arange(pixels), lists.count)
    cell = np.concatenate([np.arange(pixels), lists.cell])
    assert len(pixel) > pixels / 50
    assert (cell[lists.sample] == pixel).all()
    assert lists.samples_per_pixel < 1.2
