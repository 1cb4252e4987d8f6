# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input: one clear line on standard error, exit status 2, nothing half-written left."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from tests.tools.conftest import Run
from tests.tools.test_command_line import last_line, relume


def save_scene(path: Path, *, mesh: bool = True, camera: bool = True, light: bool = True) -> Path:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    made: list[Any] = []
    if mesh:
        square = bpy.data.meshes.new("Floor")
        square.from_pydata([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [], [(0, 1, 2, 3)])
        made.append(bpy.data.objects.new("Floor", square))
    if camera:
        made.append(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
        made[-1].location = (0, 0, 3)
        scene.camera = made[-1]
    if light:
        made.append(bpy.data.objects.new("Key", bpy.data.lights.new("Key", "POINT")))
        made[-1].location = (0, 0, 2)
    for obj in made:
        scene.collection.objects.link(obj)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_scene(tmp_path_factory.mktemp("good") / "good.blend")


def assert_refused(run: subprocess.CompletedProcess[str], *words: str) -> None:
    """Exit status 2, nothing on standard output, and a last line that says these words."""
    assert run.returncode == 2, run.stderr
    assert run.stdout == ""
    assert "Traceback" not in run.stderr
    line = last_line(run)
    assert line.startswith("relume ")
    for word in words:
        assert word in line


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "no file"), (b"", "is empty"), (b"not one at all", "is not a .blend file")],
)
def test_files_that_are_no_blend(tmp_path: Path, content: bytes | None, words: str) -> None:
    path = tmp_path / "scene.blend"
    if content is not None:
        path.write_bytes(content)
    before = sorted(tmp_path.iterdir())
    out = tmp_path / "cameras.json"
    assert_refused(relume("place", path, "--out", out), "scene.blend", words)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("lacks", "words"), [({"mesh": False}, "no mesh"), ({"camera": False}, "no camera")]
)
def test_a_scene_that_lacks_something(
    tmp_path: Path, lacks: dict[str, bool], words: str, relume_here: Run
) -> None:
    path = save_scene(tmp_path / "scene.blend", **lacks)
    assert_refused(relume_here("place", path), words)


Change = Callable[[Path], tuple[object, ...]]


def write(path: Path, content: object) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "is not JSON"),
        ([1], "not a JSON object"),
        ({"Floor": 2.0}, "'Floor' is not a number from 0 to 1"),
        ({"Floor": True}, "'Floor' is not a number from 0 to 1"),
        ({"Wall": 0.5}, "no object or material 'Wall'"),
    ],
)
def test_weights_that_cannot_be_used(
    good: Path, tmp_path: Path, content: object, words: str, relume_here: Run
) -> None:
    weights = write(tmp_path / "weights.json", content)
    assert_refused(relume_here("place", good, "--weights", weights), words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--box", "1,2,3"), "six numbers"),
        (("--secondaries", "-1"), "less than 0"),
        (("--primaries", "many"), "whole number"),
    ],
)
def test_arguments_that_cannot_be_used(good: Path, arguments: tuple[str, str], words: str) -> None:
    run = relume("place", good, *arguments)
    assert (run.returncode, run.stdout) == (2, "")
    assert words in last_line(run)


@pytest.mark.parametrize(
    ("verb", "arguments", "words"),
    [
        ("relight", ("--out", "a.exr", "--frame", "99999999999"), "1,048,574"),
        ("relight", ("--out", "a.exr", "--frame", "-" + 5000 * "9"), "whole number"),
        ("bake", ("--cameras", "0-99999999999"), "99,999"),
    ],
)
def test_numbers_that_are_too_large(
    good: Path, verb: str, arguments: tuple[str, ...], words: str, relume_here: Run
) -> None:
    run = relume_here(verb, good, "--cache", "absent", *arguments)
    assert (run.returncode, run.stdout) == (2, "")
    assert words in last_line(run)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("relight", "--cache", "absent", "--out", "FILE/a.png"), "cannot be written"),
        (("relight", "--cache", "absent", "--out", "FOLDER.png"), "it is a folder"),
        (
            ("relight", "--cache", "absent", "--out", "A.png", "--confidence", "A.png"),
            "the picture's own file",
        ),
        (("evaluate", "--out", "FILE/out"), "cannot be written"),
        (("place", "--out", "ABSENT/cameras.json"), "cannot be written"),
        (("place", "--show", "a.pdf"), "not a .png file"),
        (("bake", "--cache", "FILE"), "cannot be written"),
        (("bake", "--cache", "FILE/cache"), "cannot be written"),
        (("bake", "--cache", "/proc/cache"), "cannot be written"),
    ],
)
def test_a_place_that_cannot_be_written_is_told_before_the_work(
    tmp_path: Path, words: tuple[str, ...], message: str, relume_here: Run
) -> None:
    (tmp_path / "FILE").touch()
    (tmp_path / "FOLDER.png").mkdir()
    before = sorted(tmp_path.iterdir())
    verb, *options = words
    options = [f"{tmp_path}/{word}" if word[0].isupper() else word for word in options]
    # The scene is not looked at: it is missing, and that is not what is told.
    assert_refused(relume_here(verb, tmp_path / "absent.blend", *options), message)
    assert sorted(tmp_path.iterdir()) == before


def test_a_box_may_begin_with_a_negative_number(tmp_path: Path, relume_here: Run) -> None:
    words = ("place", tmp_path / "absent.blend", "--box")
    for corners in ("-1,-2,-3,1,2,3", "-.5,0,0,1,1,1e3"):
        assert_refused(relume_here(*words, corners), "no file")
    assert "six numbers" in relume_here(*words, "-1,2").stderr


def test_a_place_that_cannot_be_written(good: Path, tmp_path: Path, relume_here: Run) -> None:
    out = tmp_path / "no such folder" / "cameras.json"
    assert_refused(relume_here("place", good, "--out", out, "--secondaries", "1"), "cameras.json")
    assert list(tmp_path.iterdir()) == []
