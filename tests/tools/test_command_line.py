# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line as a process: exit status, one line for bad input, one JSON object."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tools.picture_file import write_exr, write_png

ROOT = Path(__file__).resolve().parents[2]


def relume(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "tools.relume", *map(str, words)]
    return subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, check=False, timeout=240
    )


def last_line(run: subprocess.CompletedProcess[str]) -> str:
    return run.stderr.rstrip("\n").rpartition("\n")[2]


@pytest.fixture
def pictures(tmp_path: Path) -> tuple[Path, Path]:
    reference = np.full((48, 64, 3), 0.25, dtype=np.float32)
    image = reference.copy()
    image[:24] *= 1.1
    paths = tmp_path / "reference.exr", tmp_path / "image.exr"
    write_exr(paths[0], reference)
    write_exr(paths[1], image)
    return paths


def test_compare_prints_one_json_object_and_nothing_else(pictures: tuple[Path, Path]) -> None:
    run = relume("compare", *pictures, "--json")
    assert run.returncode == 0
    report = json.loads(run.stdout)
    # sRGB of 0.25 and 0.275 are levels 137 and 143; half of the pixels differ by 6.
    expected = 10 * np.log10(255**2 / (36 / 2))
    assert report["whole"]["psnr_luma"] == pytest.approx(expected, abs=1e-9)
    assert report["whole"]["psnr_rgb"] == pytest.approx(expected, abs=1e-9)
    assert report["flip_kind"] == "HDR-FLIP"


def test_compare_tells_a_person_and_leaves_pictures(
    pictures: tuple[Path, Path], tmp_path: Path
) -> None:
    run = relume("compare", *pictures, "--out", tmp_path / "new" / "folder")
    assert run.returncode == 0
    assert "PSNR luma" in run.stdout
    names = {path.name for path in (tmp_path / "new" / "folder").iterdir()}
    assert names == {"difference.png", "flip.png", "edges.png"}


def test_identical_pictures_have_a_psnr_of_null(pictures: tuple[Path, Path]) -> None:
    report = json.loads(relume("compare", pictures[0], pictures[0], "--json").stdout)
    assert report["identical"] is True
    assert report["whole"]["psnr_luma"] is None


def test_pictures_of_different_sizes_or_kinds_are_refused(
    pictures: tuple[Path, Path], tmp_path: Path
) -> None:
    write_exr(tmp_path / "small.exr", np.zeros((8, 8, 3), dtype=np.float32))
    write_png(tmp_path / "other.png", np.zeros((48, 64, 3)))
    for other, words in (("small.exr", "8x8"), ("other.png", "different kinds")):
        run = relume("compare", pictures[0], tmp_path / other)
        assert (run.returncode, run.stdout) == (2, "")
        assert words in last_line(run)


@pytest.mark.parametrize(
    "words", [(), ("nothing",), ("compare", "one.exr"), ("compare", "a.exr", "b.exr", "--what")]
)
def test_wrong_arguments_end_with_2(words: tuple[str, ...]) -> None:
    run = relume(*words)
    assert (run.returncode, run.stdout) == (2, "")
    assert "usage: relume" in run.stderr


def test_help_starts_without_blender() -> None:
    code = (
        "import sys; from tools.relume import main; main(['--help']); print('bpy' in sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert run.stdout.endswith("False\n")
    assert "compare" in run.stdout


@pytest.mark.parametrize("program", [("-m", "tools.relume", "bake"), ("tools/bake_cache.py",)])
def test_an_interrupt_waits_until_blender_is_loaded(
    tmp_path: Path, program: tuple[str, ...]
) -> None:
    lines = (
        "import os, signal, sys",
        "os.kill(os.getpid(), signal.SIGINT)",
        "sys.stderr.write('all')",
    )
    (tmp_path / "bpy.py").write_text("\n".join(lines))
    run = subprocess.run(
        [sys.executable, *program, "a.blend", "--cache", tmp_path / "cache"],
        capture_output=True, text=True, cwd=ROOT, check=False, timeout=60,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    name = "relume bake" if "-m" in program else "relume"
    assert (run.returncode, run.stdout) == (1, "")
    assert run.stderr == f"all{name}: stopped\n"


def test_a_fault_ends_with_1(pictures: tuple[Path, Path]) -> None:
    code = (
        "import sys; from tools import comparison, relume\n"
        "def broken(*_): raise RuntimeError('on purpose')\n"
        "comparison.compare_pictures = broken\n"
        "sys.exit(relume.main(sys.argv[1:]))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, "compare", *map(str, pictures)],
        capture_output=True, text=True, cwd=ROOT, check=False,
    )  # fmt: skip
    assert (run.returncode, run.stdout) == (1, "")
    assert "on purpose" in run.stderr
