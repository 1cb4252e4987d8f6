# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking a file that holds caching cameras, as the artist left them, without the panel."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

import addon
from addon import baking
from addon.caching.bake import BakeSettings
from addon.caching.edited_cameras import PLACEMENT_NAME
from addon.caching.manifest_seal import sealed
from addon.caching.store import CacheStore
from addon.camplace.camera import CachingCamera
from addon.camplace.cameras_file import to_json, write_cameras
from addon.camplace.settings import PlacementSettings
from addon.errors import InputError
from addon.progress import silent
from addon.scene.depsgraph_reader import with_render_depsgraph
from addon.scene.geometry_reader import read_geometry
from addon.ui.camera_objects import show_cameras
from tests.tools.conftest import Run
from tests.tools.test_bad_input import save_scene
from tests.tools.test_bake_cache import bake_cache, events


def placed(number: int, resolution: int = 1024) -> CachingCamera:
    """Above the floor, and looking down nearly."""
    matrix = np.eye(4)
    angle = 0.1 + 0.01 * number  # neither it nor its sine is a float32
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = [0.1 * number, 0.0, 2.1]
    return CachingCamera(number, matrix, 1.1, 0.1, 9.7, resolution, "PERSPECTIVE", number)


PLACED = (placed(0), placed(1, 256), placed(2))


@pytest.fixture
def shown(tmp_path: Path) -> Iterator[Path]:
    """A file whose second caching camera was made 512 texels large, and third deleted; nothing of
    the extension is registered any more."""
    path = save_scene(tmp_path / "scene.blend")
    addon.register()
    try:
        objects = show_cameras(bpy.context.scene, PLACED).objects
        objects["Relume 0001 View 1"].data.relume.resolution = "512"
        bpy.data.objects.remove(objects["Relume 0002 View 2"])
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
    finally:
        addon.unregister()
    yield path
    bpy.ops.wm.read_factory_settings(use_empty=True)


def cached(cache: Path) -> list[Any]:
    return [camera.to_json() for camera in CacheStore.open(cache).manifest.cameras]


def test_they_are_baked_as_they_were_edited(shown: Path, tmp_path: Path, relume_here: Run) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    write_cameras(cache / PLACEMENT_NAME, PLACED)
    words = ("bake", shown, "--cache", cache, "--preset", "draft", "--json")
    run = relume_here(*words)
    assert run.returncode == 0, run.stderr
    said = "the 2 caching cameras in the scene's collection 'Relume Cameras' are baked"
    assert said in run.stderr
    assert any(said in warning for warning in json.loads(run.stdout)["warnings"])
    first, second = CacheStore.open(cache).manifest.cameras
    # Not touched: to the last bit what was placed, at the preset's resolution.
    assert first.to_json() == {**PLACED[0].to_json(), "resolution": 512}
    assert (second.id, second.resolution) == (1, 512)
    np.testing.assert_allclose(second.world_from_camera, PLACED[1].world_from_camera, atol=1e-6)
    # Gone on with, everything is current; also where the placement's file has been lost.
    _nudge(cache)
    before = cached(cache)
    assert json.loads(relume_here(*words, "--resume").stdout)["kept"] == 2
    (cache / PLACEMENT_NAME).unlink()
    assert json.loads(relume_here(*words, "--resume").stdout)["kept"] == 2
    assert cached(cache) == before


def _nudge(cache: Path) -> None:
    """As another computer may have read the edited camera: other last bits."""
    manifest = json.loads((cache / "manifest.json").read_text())
    turned = manifest["cameras"][1]["world_from_camera"]
    turned[0][0] = float(np.nextafter(turned[0][0], 0.0))
    (cache / "manifest.json").write_text(json.dumps(sealed(manifest)))


def test_an_artists_own_camera_keeps_its_number(
    shown: Path, tmp_path: Path, relume_here: Run
) -> None:
    """The file that is baked from is not saved, so that the number is found anew each time."""
    own = bpy.data.objects.new("Own", bpy.data.cameras.new("Own"))
    own.location.z = 2.5
    bpy.data.collections["Relume Cameras"].objects.link(own)
    bpy.ops.wm.save_as_mainfile(filepath=str(shown))
    words = ("bake", shown, "--cache", tmp_path / "c", "--preset", "draft", "--json")
    assert json.loads(relume_here(*words).stdout)["baked"] == 3
    before = cached(tmp_path / "c")
    assert json.loads(relume_here(*words, "--resume").stdout)["kept"] == 3
    assert cached(tmp_path / "c") == before


def test_what_the_panel_baked_is_kept(shown: Path, tmp_path: Path, relume_here: Run) -> None:
    """The panel bakes a cameras file with the edits in it, beside its cache."""
    cache, edited = tmp_path / "cache", (PLACED[0], placed(1, 512))
    cache.mkdir()
    write_cameras(cache / PLACEMENT_NAME, edited)
    words = ("bake", shown, "--cache", cache, "--preset", "draft", "--json")
    run = relume_here(*words, "--placement", cache / PLACEMENT_NAME)
    assert run.returncode == 0, run.stderr
    assert "caching cameras in the scene's" not in run.stderr
    report = json.loads(relume_here(*words, "--resume").stdout)
    assert (report["kept"], report["baked"]) == (2, 0)


def test_placing_anew_and_for_a_shot(shown: Path, tmp_path: Path, relume_here: Run) -> None:
    words = ("bake", shown, "--cache", tmp_path / "c", "--preset", "draft")
    run = relume_here(*words, "--place-anew", "--active-camera")
    assert run.returncode == 0, run.stderr
    assert "caching cameras were placed for 1 view of 'Camera'" in run.stderr
    assert "caching cameras in the scene's" not in run.stderr
    run = relume_here(*words, "--shot", "Camera")
    assert run.returncode == 0, run.stderr
    assert "the choice of a shot made no difference" in run.stderr
    run = relume_here(*words, "--place-anew", "--placement", tmp_path / "c.json")
    assert (run.returncode, "not allowed with" in run.stderr) == (2, True)


def test_an_empty_collection_is_none(shown: Path, tmp_path: Path, relume_here: Run) -> None:
    for obj in list(bpy.data.collections["Relume Cameras"].objects):
        bpy.data.objects.remove(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(shown))
    run = relume_here("bake", shown, "--cache", tmp_path / "c", "--preset", "draft")
    assert run.returncode == 0, run.stderr
    assert "caching cameras in the scene's" not in run.stderr
    assert "'Relume Cameras' holds no caching camera any more" in run.stderr


def test_an_evaluation_takes_the_cache_as_it_was_baked(
    shown: Path, tmp_path: Path, relume_here: Run
) -> None:
    cache, placement = tmp_path / "cache", tmp_path / "cameras.json"
    write_cameras(placement, PLACED[:1])
    words = ("bake", shown, "--cache", cache, "--preset", "draft", "--placement", placement)
    assert relume_here(*words).returncode == 0
    small = ("--size", "16x12", "--samples", "1", "--reference-samples", "1")
    run = relume_here("evaluate", shown, "--cache", cache, "--out", tmp_path / "out", *small)
    assert run.returncode == 0, run.stderr
    assert len(cached(cache)) == 1


def test_the_batch_script_takes_them_too(shown: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    cache.mkdir()
    write_cameras(cache / PLACEMENT_NAME, PLACED)
    run = bake_cache(shown, "--cache", cache, "--preset", "draft", "--cameras", "0")
    assert run.returncode == 0, run.stderr
    assert "relume: the 2 caching cameras in the scene's collection" in run.stderr
    assert any("collection" in event.get("message", "") for event in events(run))
    assert events(run)[-1]["result"]["cameras"] == 2
    assert json.loads((cache / PLACEMENT_NAME).read_text()) == to_json(PLACED)


def test_cameras_are_placed_for_the_texels_of_the_preset(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    save_scene(tmp_path / "scene.blend")
    asked: list[PlacementSettings] = []

    def stop(
        _geometry: object, _views: object, settings: PlacementSettings, *_rest: object
    ) -> None:
        asked.append(settings)
        raise InputError("far enough")

    monkeypatch.setattr(baking, "place_cameras", stop)
    scene = bpy.context.scene
    geometry = with_render_depsgraph(scene, read_geometry)
    settings = BakeSettings(preset="draft")
    with pytest.raises(InputError, match="far enough"):
        baking.Baking(scene, geometry, tmp_path / "cache", settings).run((), silent)
    assert [one.max_resolution for one in asked] == [512]
