# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks that come to the GPU when they are asked for are, to the bit, those that always were."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.channels import CHANNEL_BY_NAME, channels_of
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.packing import PackedTexture, TexelFormat
from addon.caching.plan import ChannelPlan
from addon.corrmap.packed_blocks import PackedBlocks
from addon.corrmap.resident_blocks import ResidentBlocks
from addon.corrmap.texel_codes import code_type, from_texel_codes, to_texel_codes
from addon.corrmap.tile_layout import BLOCK, PageShape
from addon.errors import InputError
from addon.scene.geometry import SceneGeometry
from addon.scene.view import View
from tests import synthetic

FORMATS: list[TexelFormat] = [
    "R8", "RG8", "RGBA8", "R16", "RG16", "RGBA16",
    "R16F", "RG16F", "RGBA16F", "R32F", "RG32F", "RGBA32F",
]  # fmt: skip


# Which blocks have a place -----------------------------------------------------------------------


def test_who_was_not_asked_for_the_longest_gives_way() -> None:
    resident = ResidentBlocks(10, 3)
    assert resident.ask(np.array([4, 5])).tolist() == [4, 5]
    assert resident.ask(np.array([5, 6])).tolist() == [6]
    # 4 was asked for before 5 and 6.
    assert resident.ask(np.array([7, 6])).tolist() == [7]
    held = np.flatnonzero(resident.place >= 0)
    assert held.tolist() == [5, 6, 7]
    assert sorted(resident.place[held].tolist()) == [0, 1, 2]
    assert resident.ask(np.array([5, 6, 7])).tolist() == []


def test_what_is_asked_for_never_gives_way_to_the_rest() -> None:
    random = np.random.default_rng(3)
    resident = ResidentBlocks(50, 12)
    for _ in range(200):
        wanted = random.choice(50, random.integers(1, 13), replace=False)
        before = resident.place.copy()
        missing = resident.ask(wanted)
        assert set(missing.tolist()) == {n for n in wanted.tolist() if before[n] < 0}
        places = resident.place[wanted]
        assert (places >= 0).all()
        assert len(np.unique(places)) == len(wanted)
        held = resident.place[resident.place >= 0]
        assert len(np.unique(held)) == len(held) <= 12
        kept = np.setdiff1d(wanted, missing)
        assert np.array_equal(resident.place[kept], before[kept])


def test_more_than_there_are_places_is_refused() -> None:
    with pytest.raises(ValueError, match="places"):
        ResidentBlocks(10, 2).ask(np.arange(3))


# Texels aside ------------------------------------------------------------------------------------


@pytest.mark.parametrize("texel_format", FORMATS)
def test_codes_come_back(texel_format: TexelFormat) -> None:
    values = np.linspace(0.0, 1.0, 4097, dtype=np.float32)
    codes = to_texel_codes(values, texel_format)
    back = from_texel_codes(codes)
    # Half a step of the format, and some roundings of float32.
    step = {"8": 1 / 255, "16": 1 / 65535, "16F": 2.0**-11, "32F": 0.0}
    assert np.abs(back - values).max() <= 0.5 * step[texel_format.lstrip("RGBA")] + 2.0**-22
    assert np.array_equal(to_texel_codes(back, texel_format), codes)


def test_blocks_are_taken_as_they_were_added() -> None:
    textures = (PackedTexture("RG8", (("a", 0), ("a", 1))), PackedTexture("R16F", (("b", 0),)))
    random = np.random.default_rng(5)
    codes = [
        random.integers(0, 4, (3, BLOCK, BLOCK, 2)).astype(np.uint8),
        random.integers(0, 4, (3, BLOCK, BLOCK, 1)).astype(np.float16),
    ]
    blocks = PackedBlocks(textures)
    blocks.add(np.array([7, 2, 9]), codes)
    taken = blocks.take(np.array([9, 7]))
    assert [t.dtype for t in taken] == [code_type(t.texture_format) for t in textures]
    for expected, found in zip(codes, taken, strict=True):
        assert np.array_equal(found, expected[[2, 0]])
    assert 0 < blocks.bytes < 3 * BLOCK**2 * 4
    with pytest.raises(KeyError):
        blocks.take(np.array([1]))


# Pages on the GPU --------------------------------------------------------------------------------


@pytest.mark.parametrize("texel_format", FORMATS)
def test_blocks_are_written_where_they_belong(gpu_context: None, texel_format: TexelFormat) -> None:
    from addon.corrmap.block_pages import BlockPages

    components = {"R": 1, "RG": 2, "RGBA": 4}[texel_format.rstrip("0123456789F")]
    random = np.random.default_rng(7)
    shape = PageShape(1, 3)
    pages = BlockPages(shape, [texel_format])
    expected = np.zeros((shape.places, BLOCK, BLOCK, components), dtype=np.float32)
    # Written over and over, in any order, one by one and all at once.
    for places in ([11, 0, 5, 6], list(range(12)), [3], [4, 8, 2]):
        values = random.random((len(places), BLOCK, BLOCK, components)).astype(np.float32)
        codes = from_texel_codes(to_texel_codes(values, texel_format))
        pages.write(np.array(places), [codes])
        expected[places] = codes
    found = _read_pages(pages.textures[0], shape, components)
    # Both sides divide by the largest code, and may round the quotient another way.
    assert np.array_equal(
        to_texel_codes(found, texel_format), to_texel_codes(expected, texel_format)
    )


def _read_pages(texture: Any, shape: PageShape, components: int) -> NDArray[np.float32]:
    """(places, BLOCK, BLOCK, components), read by drawing: `gpu` reads no array textures."""
    from addon.glsl.shader import PassShader, framebuffer, read_texture, texture_2d

    program = PassShader(
        name="read_page",
        fragment="sum_layers",
        samplers=(("pages", "FLOAT_2D_ARRAY"),),
        outputs=(("VEC4", "radiance"),),
    )
    blocks = []
    for layer in range(shape.count):
        one_layer = (
            "vec4 sum_of_layers(ivec2 pixel)\n"
            f"{{ return texelFetch(pages, ivec3(pixel, {layer}), 0); }}\n"
        )
        target = texture_2d(shape.side, shape.side)
        replace(program, generated=one_layer).build().draw_fullscreen(
            framebuffer([target]), {"pages": texture}, {}
        )
        pixels = read_texture(target)[..., :components]
        across = 1 << shape.bits
        grid = pixels.reshape(across, BLOCK, across, BLOCK, components).swapaxes(1, 2)
        blocks.append(grid.reshape(-1, BLOCK, BLOCK, components))
    return np.concatenate(blocks)


# Views -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def room() -> tuple[SceneGeometry, list[DeepFramebuffer], ChannelPlan]:
    geometry = synthetic.room_with_box()
    tracer = synthetic.Tracer(geometry)
    cameras = [
        *synthetic.cube_cameras((-1.2, -1.0, 1.0), 128),
        *synthetic.cube_cameras((1.0, 1.2, -0.2), 80, first_id=6),
    ]
    framebuffers = [
        synthetic.trace_framebuffer(geometry, tracer, camera, lambda p: 0.5 + 0.5 * np.sin(3.0 * p))
        for camera in cameras
    ]
    stored = ("depth", "material_id", "normal", "diffuse_color")
    return geometry, framebuffers, ChannelPlan(stored, {}, geometry.material_names)


def views() -> list[View]:
    places = [(-1.5, -1.6, 0.9), (1.6, 1.5, 1.0), (0.0, -1.7, -1.5), (-1.5, -1.6, 0.9)]
    return [
        synthetic.perspective_view(synthetic.looking_at(place, (0.3, 0.2, -0.6)), 96, 72, 0.7)
        for place in places
    ]


def surfaces(sampler: Any, view: View) -> list[NDArray[np.float32]]:
    """All that the light passes would read of two samples of a view."""
    from addon.glsl.shader import read_texture

    sampler.set_view(view)
    drawn = [sampler.sample(index) for index in range(2)]
    return [
        read_texture(texture) for one in drawn for texture in (one.geometric_normal, *one.values)
    ]


def open_sampler(room: Any, **options: Any) -> Any:
    from addon.corrmap.surface_sampler import SurfaceSampler

    geometry, framebuffers, plan = room
    return SurfaceSampler(geometry, framebuffers, plan, **options)


def test_a_paged_cache_shows_the_same_to_the_bit(gpu_context: None, room: Any) -> None:
    whole = open_sampler(room)
    assert not whole.pages.is_paged
    assert whole.warnings == ()
    # Room for the depth and half of the rest.
    depth = 4 * whole.pages._depth.shape.texels
    budget = (whole.pages.gpu_bytes + depth) // 2
    paged = open_sampler(room, cache_budget=budget)
    assert paged.pages.is_paged
    assert paged.pages.gpu_bytes <= budget
    came: set[int] = set()
    for view in views():
        for expected, found in zip(surfaces(whole, view), surfaces(paged, view), strict=True):
            assert np.array_equal(expected, found)
        came.add(int((paged.pages._resident.place >= 0).sum()))
    assert paged.warnings == ()
    # It is not that all blocks found room.
    assert max(came) < paged.pages.kept.sum()


def test_a_view_that_needs_more_than_the_budget_gets_it_and_says_so(
    gpu_context: None, room: Any
) -> None:
    whole = open_sampler(room)
    paged = open_sampler(room, cache_budget=1)
    for view in views()[:2]:
        for expected, found in zip(surfaces(whole, view), surfaces(paged, view), strict=True):
            assert np.array_equal(expected, found)
    (warning,) = paged.warnings
    assert "MiB of the GPU's memory for this view" in warning
    assert "a smaller picture, fewer caching cameras or a lower preset" in warning


def test_dropping_changes_nothing_that_is_seen(gpu_context: None) -> None:
    # Caching cameras far and near, of a wall with a pattern: much of the far one's texels goes.
    corners = np.array([[-4.0, 0, -4], [4.0, 0, -4], [4.0, 0, 4], [-4.0, 0, 4]])
    geometry = synthetic.geometry_of([(corners, np.array([[0, 1, 2], [0, 2, 3]]))])
    tracer = synthetic.Tracer(geometry)
    cameras = [
        synthetic.cube_cameras((0.0, -4.0, 0.0), 256)[2],
        synthetic.cube_cameras((0.3, -2.5, 0.2), 256, first_id=6)[2],
    ]
    framebuffers = [
        synthetic.trace_framebuffer(geometry, tracer, camera, lambda p: 0.5 + 0.5 * np.sin(3.0 * p))
        for camera in cameras
    ]
    plan = ChannelPlan(
        ("depth", "material_id", "normal", "diffuse_color"), {}, geometry.material_names
    )
    room = (geometry, framebuffers, plan)
    every, some = open_sampler(room, drop=False), open_sampler(room)
    assert some.pages.kept.sum() < 0.9 * every.pages.kept.sum()
    for place in ((0.5, -3.0, 0.2), (0.5, -1.0, 0.7), (3.0, -4.0, -2.0)):
        view = synthetic.perspective_view(
            synthetic.looking_at(place, (0.2, 0.0, 0.1)), 128, 96, 0.9
        )
        for expected, found in zip(surfaces(every, view), surfaces(some, view), strict=True):
            assert np.array_equal(expected, found)


def test_more_values_than_a_framebuffer_has_slots(gpu_context: None, room: Any) -> None:
    from addon.glsl.shader import MAX_COLOR_SLOTS

    geometry, framebuffers, plan = room
    every = [c.name for c in channels_of(3) if c.components == 3 and c.name not in plan.stored]
    more = [name for name in every if not CHANNEL_BY_NAME[name].is_direction][:10]
    wide = [
        replace(
            framebuffer,
            channels=framebuffer.channels
            | {n: framebuffer.channels["diffuse_color"] / (k + 2) for k, n in enumerate(more)},
        )
        for framebuffer in framebuffers
    ]
    names = geometry.material_names

    def values(channels: list[str]) -> dict[tuple[str, int], NDArray[np.float32]]:
        stored = [c.name for c in channels_of(3) if c.name in {*plan.stored, *channels}]
        sampler = open_sampler((geometry, wide, ChannelPlan(tuple(stored), {}, names, lobes=3)))
        _, *textures = surfaces(sampler, views()[0])
        pixels = np.concatenate(textures[: sampler.layout.texture_count], axis=-1)
        return {place: pixels[..., i] for i, place in enumerate(sampler.layout.values)}

    together = values(more)
    assert len(together) > 4 * MAX_COLOR_SLOTS
    for start in range(0, len(more), 3):
        for place, expected in values(more[start : start + 3]).items():
            assert expected.any()
            assert np.array_equal(together[place], expected), place


def test_more_values_than_the_gpu_can_draw_are_refused(
    gpu_context: None, room: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from addon.corrmap import tile_pages
    from addon.corrmap.surface_layout import OTHER_TEXTURES

    monkeypatch.setattr(tile_pages, "max_textures", lambda: OTHER_TEXTURES + 1)
    with pytest.raises(InputError, match=r"have 6 values .* can draw 4 at once"):
        open_sampler(room)


def test_each_framebuffer_is_asked_for_alone(gpu_context: None, room: Any) -> None:
    """What waits is bounded: no more than one framebuffer at a time beside it."""
    from addon.corrmap import tile_pages

    class Counted(list[DeepFramebuffer]):
        asked: list[int] = []  # noqa: RUF012 - one list is wanted

        def __getitem__(self, index: Any) -> Any:
            self.asked.append(index)
            return super().__getitem__(index)

    _, framebuffers, plan = room
    counted = Counted(framebuffers)
    tile_pages.upload_tiles(counted, plan)
    assert counted.asked == list(range(12))
    counted.asked.clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tile_pages, "_WAITING", 0)
        pages = tile_pages.upload_tiles(counted, plan)
    assert counted.asked == [*range(12), *(i for i in range(12) if pages.holds(i))]
