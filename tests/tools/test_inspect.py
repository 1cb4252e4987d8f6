# SPDX-License-Identifier: GPL-3.0-or-later
"""What a cache holds, in figures and pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from addon.caching.channels import CHANNEL_BY_NAME, CHANNELS
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest import Manifest
from addon.caching.plan import Approximation, ChannelPlan
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from tests.tools.conftest import Run
from tools.channel_picture import FAR, NOTHING, channel_picture
from tools.metrics import encode_srgb

SIDE = 8
STORED = ("depth", "material_id", "normal", "diffuse_color", "roughness")


def _camera(number: int) -> CachingCamera:
    return CachingCamera(number, np.eye(4), 1.1, 0.1, 9.0, SIDE, "PERSPECTIVE", number)


def _framebuffer(number: int) -> DeepFramebuffer:
    """The lower half sees a wall 2 m away."""
    channels = {
        name: np.zeros((SIDE, SIDE, CHANNEL_BY_NAME[name].components), np.float32)
        for name in STORED
    }
    low = slice(None, SIDE // 2)
    channels["depth"][low] = 2.0
    channels["material_id"][low] = 1.0
    channels["normal"][low] = (0.0, 0.0, 1.0)
    channels["diffuse_color"][low] = (0.5, 0.25, 0.125)
    channels["roughness"][low] = 0.5
    return DeepFramebuffer(_camera(number), channels)


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    plan = ChannelPlan(
        STORED, {"specular_f90": (1.0, 1.0, 1.0)}, ("Wood",), (Approximation("Wood", "is cut"),)
    )
    cameras = tuple(_camera(number) for number in range(3))
    store = CacheStore.create(
        tmp_path / "a.relume", Manifest("f", {"preset": "draft"}, plan, cameras)
    )
    for number in (0, 2):
        store.add_camera(_framebuffer(number))
    return store.folder


def test_the_figures_are_those_of_the_cache(cache: Path, relume_here: Run) -> None:
    run = relume_here("inspect", cache, "--json")
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert [camera["id"] for camera in report["cameras"]] == [0, 2]
    assert report["unfinished"] == [1]
    assert report["texels"] == 2 * SIDE**2
    # Depth and the normal take four bytes, five other values two each (material, colour,
    # roughness).
    assert report["raw_bytes"] == report["texels"] * (4 + 4 + 2 * (1 + 3 + 1))
    every = 4 * sum(channel.components for channel in CHANNELS)
    assert report["all_channels_bytes"] == report["texels"] * every
    store = CacheStore.open(cache)
    files = [store.camera_path(number).stat().st_size for number in (0, 2)]
    assert report["stored_bytes"] == sum(files)
    assert [camera["seen_share"] for camera in report["cameras"]] == [0.5, 0.5]
    assert report["constants"] == {"specular_f90": [1.0, 1.0, 1.0]}
    assert "material 'Wood': is cut" in run.stderr
    one = json.loads(relume_here("inspect", cache, "--cameras", "2", "--json").stdout)
    assert [camera["id"] for camera in one["cameras"]] == [2]
    words = relume_here("inspect", cache).stdout
    assert "not yet baked: cameras 1" in words
    assert "constant: specular_f90" in words


def test_the_sheet_has_a_row_for_each_camera_and_a_column_for_each_channel(
    cache: Path, tmp_path: Path, relume_here: Run
) -> None:
    sheet = tmp_path / "sheet.png"
    run = relume_here("inspect", cache, "--out", sheet)
    assert run.returncode == 0, run.stderr
    both = Image.open(sheet).size
    assert relume_here("inspect", cache, "--out", sheet, "--cameras", "0").returncode == 0
    one = Image.open(sheet).size
    assert both[0] == one[0] > 5 * 180
    assert both[1] - one[1] > 180


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--cameras", "1"], "no finished camera 1; it has 0, 2"),
        (["--out", "sheet.jpg"], "is not a .png file"),
        (["--out", "nowhere/sheet.png"], "nowhere"),
    ],
)
def test_what_cannot_be_shown(
    words: list[str], message: str, cache: Path, relume_here: Run
) -> None:
    run = relume_here("inspect", cache, *words)
    assert run.returncode == 2
    assert message in run.stderr
    assert run.stderr.count("\n") == 1


def test_a_damaged_camera_is_named(cache: Path, relume_here: Run) -> None:
    path = CacheStore.open(cache).camera_path(2)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    run = relume_here("inspect", cache)
    assert run.returncode == 2
    assert path.name in run.stderr


def _shown(name: str, values: list[list[float]]) -> tuple[np.ndarray, str]:
    """(1, N + 1, 3): N texels with these values, and one that hits nothing."""
    shape = (1, len(values) + 1, CHANNEL_BY_NAME[name].components)
    pixels = np.zeros(shape, np.float32)
    pixels[0, :-1] = values
    hit = np.array([[True] * len(values) + [False]])
    picture, note = channel_picture(CHANNEL_BY_NAME[name], pixels, hit)
    np.testing.assert_allclose(picture[0, -1], NOTHING)
    assert ((picture >= 0.0) & (picture <= 1.0)).all()
    return picture[0, :-1], note


def test_channels_as_a_person_sees_them() -> None:
    depth, note = _shown("depth", [[1.0], [10.0], [100.0]])
    assert (np.diff(depth[:, 0]) < 0.0).all()
    np.testing.assert_allclose(depth[:, 0], [1.0, 0.5 * (1.0 + FAR), FAR], atol=0.02)
    assert note == "1 to 100 m"
    ids, note = _shown("material_id", [[1.0], [2.0], [1.0]])
    assert note == "2 materials"
    np.testing.assert_array_equal(ids[0], ids[2])
    assert np.abs(ids[0] - ids[1]).max() > 0.2
    normal, _ = _shown("normal", [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(normal, [[0.5, 0.5, 1.0], [0.0, 0.5, 0.5]])
    color, note = _shown("diffuse_color", [[0.2, 0.5, 1.0]])
    np.testing.assert_allclose(color, encode_srgb(np.array([[0.2, 0.5, 1.0]])), atol=1e-7)
    assert note == "0.2 to 1"
    grey, note = _shown("layer_f0", [[0.01], [0.04]])
    np.testing.assert_allclose(grey[:, 0], [0.25, 1.0], rtol=1e-6)
    assert note == "0.01 to 0.04"


@pytest.mark.parametrize("scale", [0.0, 1e-9, 1e9])
def test_extreme_emission_is_shown(scale: float) -> None:
    shown, note = _shown("emission", [[scale, 0.0, 0.5 * scale]])
    assert np.isfinite(shown).all()
    assert shown[0, 0] == pytest.approx(1.0 if scale else 0.0, abs=1e-6)
    assert "W/(m2 sr)" in note


def test_a_camera_that_sees_nothing() -> None:
    channel = CHANNEL_BY_NAME["depth"]
    picture, note = channel_picture(
        channel, np.zeros((2, 2, 1), np.float32), np.zeros((2, 2), bool)
    )
    np.testing.assert_allclose(picture, np.broadcast_to(NOTHING, (2, 2, 3)))
    assert note == "nothing is seen"


def test_what_lies_behind_sheer_surfaces_is_shown(cache: Path, relume_here: Run) -> None:
    store = CacheStore.open(cache)
    first = _framebuffer(2)
    behind = (_framebuffer(2), _framebuffer(2))
    plain = relume_here("inspect", cache, "--out", cache.parent / "plain.png").stdout
    assert "behind sheer layers" not in plain
    store.add_camera(DeepFramebuffer(first.camera, first.channels, first.wide, behind))
    run = relume_here("inspect", cache, "--out", cache.parent / "layers.png", "--json")
    report = json.loads(run.stdout)
    assert [camera["pictures"] for camera in report["cameras"]] == [1, 3]
    assert report["texels"] == 4 * SIDE**2
    assert report["raw_bytes"] == report["texels"] * (4 + 4 + 2 * (1 + 3 + 1))
    words = relume_here("inspect", cache).stdout
    assert "2 cameras with 2 pictures behind sheer layers" in words
    heights = [Image.open(cache.parent / name).height for name in ("plain.png", "layers.png")]
    # Two rows of channels more.
    assert heights[1] > 1.6 * heights[0]
