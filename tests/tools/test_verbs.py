# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs end to end on a small scene, and what they say of caches that cannot be used."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

from addon.caching.manifest_seal import sealed
from addon.caching.store import CacheStore
from addon.camplace.cameras_file import write_cameras
from tests.tools.conftest import Run
from tests.tools.test_bad_input import assert_refused, save_scene, write
from tests.tools.test_command_line import ROOT, relume
from tools.picture_file import read_picture

# Cycles' Lambert plane of Blender's default material is not one: the cache has a few texels
# only here, and 40 dB is far above what a wrong light, shadow or camera would give.
GOOD_ENOUGH_DB = 40.0


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A scene of a floor, a point light and a camera; and its cache."""
    folder = tmp_path_factory.mktemp("baked")
    scene, cache = save_scene(folder / "scene.blend"), folder / "cache"
    run = relume("bake", scene, "--cache", cache, "--preset", "draft", "--json")
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["baked"] == report["cameras"] > 0
    assert report["kept"] == 0
    return scene, cache


def small(*words: object) -> tuple[object, ...]:
    return (*words, "--size", "48x36", "--samples", "4")


def test_relight_writes_linear_exr_with_layers_and_png(
    baked: tuple[Path, Path], tmp_path: Path
) -> None:
    scene, cache = baked
    exr, png = tmp_path / "a.exr", tmp_path / "a.png"
    run = relume(*small("relight", scene, "--cache", cache, "--out", exr, "--json"))
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["lights"] == ["Key"]
    assert report["hole_fraction"] < 0.01
    picture = read_picture(exr)
    assert picture.rgb.shape == (36, 48, 3)
    assert picture.rgb.min() > 0.0
    layer = np.stack([picture.extra[f"Key.{c}"] for c in "RGB"], axis=-1)
    np.testing.assert_allclose(layer, picture.rgb, rtol=1e-5)  # one light: its layer is all
    assert relume(*small("relight", scene, "--cache", cache, "--out", png)).returncode == 0
    assert read_picture(png).rgb.shape == (36, 48, 3)


def test_edits_change_the_picture_as_they_say(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    edits = write(tmp_path / "edits.json", {"Key": {"energy": 30.0, "color": [1.0, 0.5, 0.0]}})
    pictures = []
    for name, words in (("plain.exr", ()), ("edited.exr", ("--lights", edits))):
        out = tmp_path / name
        run = relume_here(*small("relight", scene, "--cache", cache, "--out", out, *words))
        assert run.returncode == 0, run.stderr
        pictures.append(read_picture(out).rgb)
    # Blender's own point light has 10 W and is white.
    wanted = pictures[0] * np.array([3.0, 1.5, 0.0], dtype=np.float32)
    np.testing.assert_allclose(pictures[1], wanted, rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--solo", "Nobody"), "there is no light 'Nobody'"),
        (("--mute", "Floor"), "object 'Floor' does not glow"),
    ],
)
def test_what_gives_no_light_is_neither_soloed_nor_muted(
    words: tuple[str, str], said: str, baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    out = tmp_path / "out.exr"
    run = relume_here(*small("relight", scene, "--cache", cache, "--out", out, *words))
    assert_refused(run, said)


def test_a_render_region_is_relit_alone(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    """As Blender does: nothing is around it, or the picture is the region."""
    scene, cache = baked
    region = tmp_path / "region.blend"
    pictures = {}
    for name in ("whole", "region", "crop"):
        if name != "whole":
            bpy.ops.wm.open_mainfile(filepath=str(scene))
            render = bpy.context.scene.render
            render.use_border, render.use_crop_to_border = True, name == "crop"
            render.border_min_x, render.border_max_x = 0.25, 0.5
            render.border_min_y, render.border_max_y = 0.5, 0.75
            bpy.ops.wm.save_as_mainfile(filepath=str(region))
        out, trust = tmp_path / f"{name}.exr", tmp_path / f"{name} trust.exr"
        path = scene if name == "whole" else region
        words = ("relight", path, "--cache", cache, "--out", out, "--confidence", trust, "--json")
        run = relume_here(*small(*words))
        assert run.returncode == 0, run.stderr
        report = json.loads(run.stdout)
        assert report["region"] == (None if name == "whole" else [12, 18, 24, 27])
        pictures[name] = read_picture(out), read_picture(trust)
        assert pictures[name][0].rgb.shape == (report["height"], report["width"], 3)
    inside = (slice(18, 27), slice(12, 24))
    for whole, part, crop in zip(*pictures.values(), strict=True):
        assert crop.rgb.shape == (9, 12, 3)
        np.testing.assert_array_equal(part.rgb[inside], crop.rgb)
        # A floor under a light: the same rays, to float32's rounding.
        np.testing.assert_allclose(crop.rgb, whole.rgb[inside], rtol=1e-3)
        outside = part.rgb.copy()
        outside[inside] = 0.0
        assert outside.max() == 0.0
    layer = pictures["crop"][0].extra["Key.R"]
    np.testing.assert_allclose(layer, pictures["crop"][0].rgb[..., 0], rtol=1e-5)


def test_a_light_that_is_switched_off_leaves_black(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    edits = write(tmp_path / "edits.json", {"Key": None})
    words = small("relight", scene, "--cache", cache, "--out", tmp_path / "off.exr")
    run = relume_here(*words, "--lights", edits)
    assert run.returncode == 0, run.stderr
    assert read_picture(tmp_path / "off.exr").rgb.max() == 0.0


def test_surfaces_change_as_they_are_edited(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    edit = {"objects": {"Floor": {"gain": 0.0, "specular": 0.0, "emission": 2.0}}}
    path, out = write(tmp_path / "surfaces.json", edit), tmp_path / "black.exr"
    words = small("relight", scene, "--cache", cache, "--out", out, "--surfaces", path, "--json")
    run = relume_here(*words)
    assert run.returncode == 0, run.stderr
    assert read_picture(out).rgb.max() == 0.0
    (warning,) = (text for text in json.loads(run.stdout)["warnings"] if "'Floor'" in text)
    assert "emission does nothing" in warning
    write(path, {"objects": {"Flor": {"gain": 0.0}}})
    assert_refused(relume_here(*words), "no object 'Flor'")


def test_notes_are_on_standard_error_also_with_json(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    copy = Path(shutil.copytree(cache, tmp_path / "cache"))
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["plan"]["approximations"] = [{"material": "Paint", "effect": "no sheen"}]
    write(copy / "manifest.json", sealed(manifest))
    words = small("relight", scene, "--cache", copy, "--out", tmp_path / "a.png")
    for json_word in ((), ("--json",)):
        run = relume_here(*words, *json_word)
        assert run.returncode == 0, run.stderr
        assert "note: material 'Paint': no sheen\n" in run.stderr
    assert json.loads(run.stdout)["warnings"][-1] == "material 'Paint': no sheen"


def test_evaluate_measures_against_cycles(baked: tuple[Path, Path], tmp_path: Path) -> None:
    scene, cache = baked
    words = small("evaluate", scene, "--cache", cache, "--out", tmp_path / "out", "--json")
    run = relume(*words, "--reference-samples", "8")
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    (view,) = report["views"]
    assert view["camera"] == "Camera"
    assert view["whole"]["psnr_luma"] is None or view["whole"]["psnr_luma"] > GOOD_ENOUGH_DB
    assert view["away_from_edges"]["edges_from"] == "surfaces"
    assert report["bake"]["kept"] == report["bake"]["cameras"]
    names = {path.name for path in (tmp_path / "out" / "Camera").iterdir()}
    assert {"relit.exr", "relit.png", "reference.exr", "reference.png", "difference.png"} <= names
    assert (tmp_path / "out" / "contact_sheet.png").is_file()
    assert json.loads((tmp_path / "out" / "report.json").read_text()) == report


def test_resume_keeps_what_is_there_and_bakes_the_rest(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    copy = Path(shutil.copytree(cache, tmp_path / "cache"))
    lost = max((copy / "cameras").iterdir())
    lost.unlink()
    words = ("bake", scene, "--cache", copy, "--preset", "draft", "--resume", "--json")
    report = json.loads(relume_here(*words).stdout)
    assert report["baked"] == 1
    assert report["kept"] == report["cameras"] - 1
    assert lost.is_file()


@pytest.mark.parametrize(
    ("edits", "words"),
    [
        ({"Lamp": {"energy": 1.0}}, ("no light 'Lamp'", "Key")),
        ({"Key": {"watts": 1.0}}, ("'watts'",)),
        ({"Key": {"energy": "much"}}, ("'energy'", "number")),
        ("{", ("not JSON",)),
    ],
)
def test_edits_that_cannot_be_made(
    baked: tuple[Path, Path],
    tmp_path: Path,
    edits: object,
    words: tuple[str, ...],
    relume_here: Run,
) -> None:
    scene, cache = baked
    path, out = write(tmp_path / "edits.json", edits), tmp_path / "out.png"
    run = relume_here("relight", scene, "--cache", cache, "--out", out, "--lights", path)
    assert_refused(run, *words)
    assert not out.exists()


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        (("--camera", "Absent"), "no camera 'Absent'"),
        (("--out", "picture.jpg"), "neither an .exr nor a .png"),
        (("--cache", "/nowhere"), "/nowhere"),
    ],
)
def test_relight_words_that_cannot_be_used(
    baked: tuple[Path, Path], tmp_path: Path, extra: tuple[str, str], words: str, relume_here: Run
) -> None:
    scene, cache = baked
    out = ("--out", tmp_path / "out.png")
    assert_refused(relume_here("relight", scene, "--cache", cache, *out, *extra), words)
    assert list(tmp_path.iterdir()) == []


def spoil(cache: Path, how: str) -> None:
    """Damage a cache in one way."""
    manifest = cache / "manifest.json"
    data = json.loads(manifest.read_text())
    first = min((cache / "cameras").iterdir())
    if how == "truncated camera":
        first.write_bytes(first.read_bytes()[: first.stat().st_size // 2])
    elif how == "missing camera":
        first.unlink()
    elif how == "truncated manifest":
        manifest.write_text(manifest.read_text()[:100])
    elif how == "older schema":
        manifest.write_text(json.dumps(data | {"version": 0}))
    else:
        manifest.write_text(json.dumps(sealed(data | {"fingerprint": "0" * 64})))


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("truncated camera", ".exr"),
        ("missing camera", ".exr"),
        ("truncated manifest", "manifest.json is damaged"),
        ("older schema", "older version"),
        ("another scene", "another scene"),
    ],
)
def test_caches_that_cannot_be_used_are_named(
    baked: tuple[Path, Path], tmp_path: Path, how: str, words: str, relume_here: Run
) -> None:
    scene, cache = baked
    copy = Path(shutil.copytree(cache, tmp_path / "cache"))
    spoil(copy, how)
    before = sorted(copy.rglob("*"))
    out = tmp_path / "out.png"
    assert_refused(relume_here(*small("relight", scene, "--cache", copy, "--out", out)), words)
    assert not out.exists()
    assert sorted(copy.rglob("*")) == before


def test_another_scenes_cache_is_not_baked_over(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    scene, cache = baked
    copy = Path(shutil.copytree(cache, tmp_path / "cache"))
    spoil(copy, "another scene")
    manifest = (copy / "manifest.json").read_bytes()
    words = ("bake", scene, "--cache", copy, "--preset", "draft")
    assert_refused(relume_here(*words), "another scene", "--overwrite")
    assert (copy / "manifest.json").read_bytes() == manifest
    # One camera is enough to see that it is baked over.
    one = tmp_path / "cameras.json"
    write_cameras(one, CacheStore.open(cache).cameras[:1])
    assert relume_here(*words, "--placement", one, "--overwrite").returncode == 0
    assert len(CacheStore.open(copy).cameras) == 1
    assert CacheStore.open(copy).manifest.fingerprint == CacheStore.open(cache).manifest.fingerprint


def test_a_cache_that_cannot_be_made(
    baked: tuple[Path, Path], tmp_path: Path, relume_here: Run
) -> None:
    (tmp_path / "file").touch()
    run = relume_here("bake", baked[0], "--cache", tmp_path / "file" / "cache", "--preset", "draft")
    assert_refused(run, "file")


def test_a_full_disk_leaves_nothing_half_written(baked: tuple[Path, Path], tmp_path: Path) -> None:
    scene, cache = baked
    out = tmp_path / "out.exr"
    words = small("relight", scene, "--cache", cache, "--out", out)

    def no_room() -> None:
        # Files of this process end at 4 kB: what a full disk does, without filling one.
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    run = subprocess.run(
        [sys.executable, "-m", "tools.relume", *map(str, words)],
        capture_output=True, text=True, cwd=ROOT, check=False, preexec_fn=no_room,
    )  # fmt: skip
    assert_refused(run, "out.exr cannot be written")
    assert list(tmp_path.iterdir()) == []
