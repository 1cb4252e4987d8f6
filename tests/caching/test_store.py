# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache folder: what is written is read, and what is damaged is refused by name."""

from __future__ import annotations

import errno
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from addon.caching.channels import CHANNEL_BY_NAME
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.manifest import Manifest
from addon.caching.manifest_file import SCHEMA_VERSION
from addon.caching.manifest_seal import sealed
from addon.caching.plan import Approximation, ChannelPlan
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.errors import InputError

from .material_grid import HALF

PLAN = ChannelPlan(
    stored=("depth", "material_id", "normal", "diffuse_color"),
    constants={"roughness": (0.1 + 0.2,), "specular_f90": (1.0, 1.0, 1.0)},
    material_names=("", "Möbel", 'a "quoted" name'),
    approximations=(Approximation("Möbel", "sheen is left out"),),
)


def camera(number: int, resolution: int = 16) -> CachingCamera:
    world_from_camera = np.eye(4)
    world_from_camera[:3, 3] = (0.1, 1.0 / 3.0, 1e6)
    return CachingCamera(
        number, world_from_camera, np.pi / 2, 0.01, 1e3, resolution, "CUBE_FACE", 0
    )


def framebuffer(number: int) -> DeepFramebuffer:
    random = np.random.default_rng(number)
    size = camera(number).resolution
    channels = {
        name: random.uniform(0.1, 1.0, (size, size, CHANNEL_BY_NAME[name].components)).astype(
            np.float32
        )
        for name in PLAN.stored
    }
    channels["normal"] /= np.linalg.norm(channels["normal"], axis=-1, keepdims=True)
    return DeepFramebuffer(camera(number), channels)


@pytest.fixture
def cache(tmp_path: Path) -> CacheStore:
    """Two cameras, of which number 7 is finished."""
    manifest = Manifest("f" * 64, {"preset": "draft"}, PLAN, (camera(3), camera(7)))
    store = CacheStore.create(tmp_path / "scene.relume", manifest)
    record = store.write_camera(framebuffer(7))
    store.write_manifest(replace(manifest, finished={7: record}))
    return store


def leftovers(folder: Path) -> list[str]:
    return [str(path) for path in folder.rglob("*") if path.name.endswith(".part")]


def test_round_trip(cache: CacheStore) -> None:
    again = CacheStore.open(cache.folder)
    assert again.plan == PLAN
    assert again.manifest.to_json() == cache.manifest.to_json()
    assert [c.id for c in again.cameras] == [7]
    # Not a bit of a place is lost, however far from the origin.
    assert (again.cameras[0].world_from_camera == camera(7).world_from_camera).all()
    read, written = again.read_camera(7), framebuffer(7)
    assert tuple(read.channels) == PLAN.stored
    for name, pixels in written.channels.items():
        if CHANNEL_BY_NAME[name].precision == "float32":
            assert (read.channels[name] == pixels).all(), name
        elif name == "normal":
            # See `octahedral`.
            assert np.abs(read.channels[name] - pixels).max() < 5e-5
        else:
            assert np.allclose(read.channels[name], pixels, rtol=HALF, atol=0.0), name


def test_extremes_are_stored_as_they_are(cache: CacheStore) -> None:
    """In float32, of the one channel and the one camera that need it."""
    written = framebuffer(3)
    written.channels["diffuse_color"][:8] = 1e9
    written.channels["diffuse_color"][8:] = 1e-9
    written = DeepFramebuffer(written.camera, written.channels)
    cache.add_camera(written)
    read = cache.read_camera(3)
    np.testing.assert_array_equal(read.channels["diffuse_color"], written.channels["diffuse_color"])
    assert read.wide == {"diffuse_color"}
    assert cache.read_camera(7).wide == frozenset()
    exr = OpenEXR.File(str(cache.camera_path(3)), separate_channels=True)
    types = {p.name(): next(iter(p.channels.values())).pixels.dtype for p in exr.parts}
    assert types == {
        "depth": np.float32, "material_id": np.float16, "normal": np.uint32,
        "diffuse_color": np.float32,
    }  # fmt: skip
    assert read.raw_bytes == 16 * 16 * (4 + 2 + 4 + 3 * 4)


def test_a_part_for_each_channel_top_row_first(cache: CacheStore) -> None:
    """So that other programs show the files the right way up."""
    exr = OpenEXR.File(str(cache.camera_path(7)), separate_channels=True)
    assert [part.name() for part in exr.parts] == list(PLAN.stored)
    (depth,) = exr.parts[0].channels.values()
    assert (depth.pixels[0] == framebuffer(7).channels["depth"][-1, :, 0]).all()


def test_the_world_picture(cache: CacheStore) -> None:
    with pytest.raises(InputError, match="no picture of the world"):
        cache.read_world("sky")
    picture = np.random.default_rng(0).uniform(0, 9, (8, 16, 3)).astype(np.float32)
    cache.add_world(picture, "sky")
    assert (CacheStore.open(cache.folder).read_world("sky") == picture).all()


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999])
def test_a_truncated_file_is_named(cache: CacheStore, share: float) -> None:
    path = cache.camera_path(7)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    assert not cache.is_intact(7)
    with pytest.raises(InputError, match=r"0007-\w{8}\.exr is damaged"):
        cache.read_camera(7)


@pytest.mark.parametrize("share", [0.001, 0.2, 0.5, 0.99])
def test_a_flipped_bit_is_found(cache: CacheStore, share: float) -> None:
    path = cache.camera_path(7)
    data = bytearray(path.read_bytes())
    data[int(share * len(data))] ^= 1
    path.write_bytes(data)
    assert not cache.is_intact(7)
    with pytest.raises(InputError, match=r"0007-\w{8}\.exr is damaged"):
        cache.read_camera(7)


def test_a_foreign_file_is_found(cache: CacheStore) -> None:
    cache.camera_path(7).write_bytes(b"P6 1 1 255 abc")
    with pytest.raises(InputError, match="not the file that was baked"):
        cache.read_camera(7)


def test_missing_and_unfinished_cameras(cache: CacheStore) -> None:
    cache.camera_path(7).unlink()
    with pytest.raises(InputError, match=r"0007-\w{8}\.exr is missing"):
        cache.read_camera(7)
    for number in (3, 99):
        with pytest.raises(InputError, match=f"no finished camera {number}"):
            cache.read_camera(number)


def change_manifest(folder: Path, **changes: Any) -> None:
    path = folder / "manifest.json"
    path.write_text(json.dumps(sealed({**json.loads(path.read_text()), **changes})))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": SCHEMA_VERSION + 1}, "update Relume"),
        ({"version": SCHEMA_VERSION - 1}, "bake the cache again"),
        ({"schema": "something else"}, "not a Relume cache"),
        ({"cameras": [{"id": 1}]}, "another version of Relume"),
        ({"plan": {"stored": ["colour of magic"]}}, "another version of Relume"),
        ({"finished": []}, "another version of Relume"),
    ],
)
def test_unusable_manifests(cache: CacheStore, changes: dict[str, Any], message: str) -> None:
    change_manifest(cache.folder, **changes)
    with pytest.raises(InputError, match=message) as caught:
        CacheStore.open(cache.folder)
    assert "\n" not in str(caught.value)


def test_no_manifest_and_half_a_manifest(cache: CacheStore, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no Relume cache"):
        CacheStore.open(tmp_path / "elsewhere")
    path = cache.folder / "manifest.json"
    path.write_text(path.read_text()[:200])
    with pytest.raises(InputError, match="is damaged"):
        CacheStore.open(cache.folder)


def test_another_scenes_cache(cache: CacheStore) -> None:
    cache.check_fingerprint("f" * 64)
    with pytest.raises(InputError, match="another scene"):
        cache.check_fingerprint("0" * 64)


def test_a_full_disk_leaves_the_old_state(
    cache: CacheStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = cache.camera_path(7).read_bytes()
    manifest = (cache.folder / "manifest.json").read_bytes()

    def full(*_: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(InputError, match="the disk is full"):
        cache.write_camera(framebuffer(7))
    with pytest.raises(InputError, match="the disk is full"):
        cache.write_manifest(cache.manifest)
    assert cache.camera_path(7).read_bytes() == before
    assert (cache.folder / "manifest.json").read_bytes() == manifest
    assert not leftovers(cache.folder)


def test_a_full_disk_while_pixels_are_written(
    cache: CacheStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenEXR says only that it could not write; the message still names the disk."""
    # What is written to the temporary name goes to a device that is always full.
    monkeypatch.setattr("secrets.token_hex", lambda count: "token")
    part = cache.folder / "cameras" / f".0003.exr.token.{os.getpid()}.part"
    part.symlink_to("/dev/full")
    with pytest.raises(InputError, match=r"0003\.exr cannot be written: the disk is full"):
        cache.write_camera(framebuffer(3))
    assert list((cache.folder / "cameras").iterdir()) == [cache.camera_path(7)]


def test_a_folder_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("not a folder")
    with pytest.raises(InputError, match="taken cannot be written"):
        CacheStore.create(tmp_path / "taken", Manifest("f", {}, PLAN, (camera(3),)))
