# SPDX-License-Identifier: GPL-3.0-or-later
"""The caching benchmark from end to end on a small scene, and the hooks by which it measures."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
import pytest

from addon.caching.channels import CHANNEL_BY_NAME
from addon.caching.framebuffer import DeepFramebuffer
from addon.camplace.cameras_file import to_json
from benchmarks.caching_run import made_textures, nothing_rounded
from tests.caching.material_grid import add_plane, camera_above, empty_material, empty_scene

ROOT = Path(__file__).resolve().parent.parent.parent


def test_an_exact_bake_keeps_every_channel_as_it_is() -> None:
    camera = camera_above((0, 0, 0), 3.0)
    side = camera.resolution
    names = ("depth", "material_id", "diffuse_color", "roughness")
    channels = {
        name: np.full((side, side, CHANNEL_BY_NAME[name].components), 0.3, dtype=np.float32)
        for name in names
    }
    with nothing_rounded():
        exact = DeepFramebuffer(camera, channels)
    assert {exact.precision(name) for name in names} == {"float32"}
    assert exact.raw_bytes == sum(values.nbytes for values in channels.values())
    assert DeepFramebuffer(camera, channels).raw_bytes < exact.raw_bytes


def test_textures_are_noted_as_they_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def make(size: Any, **options: Any) -> tuple[Any, ...]:
        return size, options["format"]

    monkeypatch.setattr(gpu.types, "GPUTexture", make)
    with made_textures() as made:
        made_one: Any = gpu.types.GPUTexture((8, 4), layers=3, format="RGBA16F")
        gpu.types.GPUTexture((2, 2), format="R32F", data=None)
    gpu.types.GPUTexture((9, 9), format="R32F")
    assert made_one == ((8, 4), "RGBA16F")
    assert [texture.size for texture in made] == [8 * 4 * 3 * 8, 2 * 2 * 4]
    assert gpu.types.GPUTexture is make


@pytest.fixture(scope="module")
def small_scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor under a lamp, seen from above."""
    path = tmp_path_factory.mktemp("bench") / "floor.blend"
    scene = empty_scene()
    add_plane(scene, "floor", (0.0, 0.0, 0.0), empty_material("floor")[0], size=4.0)
    for name, data, height in (
        ("Eye", bpy.data.cameras.new("Eye"), 3.0),
        ("Key", bpy.data.lights.new("Key", "POINT"), 2.0),
    ):
        obj = bpy.data.objects.new(name, data)
        obj.location = (0.0, 0.0, height)
        scene.collection.objects.link(obj)
    scene.camera = bpy.data.objects["Eye"]
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_all_of_it(small_scene: Path, tmp_path: Path) -> None:
    out, cameras = tmp_path / "figures.json", tmp_path / "cameras.json"
    cameras.write_text(json.dumps(to_json((camera_above((0, 0, 0), 3.0),))))
    words = (
        *("--placement", cameras),
        *("--preset", "draft", "--size", "48x32", "--samples", "1", "--reference-samples", "2"),
        *("--frame-samples", "1,2", "--out", out, "--scratch", tmp_path),
    )
    run = subprocess.run(
        [sys.executable, "-m", "benchmarks.caching", small_scene, tmp_path / "none.blend", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    # Of two scenes one is missing, which is said, and does not take the other one along.
    assert run.returncode == 1
    assert "none: failed at place" in run.stdout
    assert "no file" in run.stderr
    report, missing = json.loads(out.read_text())
    assert missing["failed"][0] == "place"
    assert report["bake"]["stored_bytes"] == report["bake"]["cache_bytes"] > 0
    everything = report["bake"]["texels"] * report["bake"]["bytes_per_texel"]["all_float32"]
    sizes = {bound["name"]: bound["value"] for bound in report["bounds"]}
    assert sizes["times smaller on the GPU"] == everything / report["gpu"]["gpu_bytes"]
    # Depth is a texture of four bytes in each of the baked texels, at least.
    assert report["gpu"]["gpu_bytes"] >= 4 * report["bake"]["texels"]
    assert set(report["error"]["loss"]) == {"psnr_rgb", "psnr_luma"}
    # Equal where the machine's noise hides what a sample costs.
    assert report["frame"]["whole_s"] >= report["frame"]["seconds"]["1"] > 0.0
    assert "floor: draft" in run.stdout
    assert "lost to compression" in run.stdout
    assert "at 256 samples" in run.stdout
    assert set(tmp_path.iterdir()) == {out, cameras}
