# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds dist/relume-VERSION.zip, which an artist installs in Blender.

    python -m tools.build_extension [--out dist]

The zip holds addon/, the licence and the wheels of `extension_wheels`. Blender's own checker
(in the bpy wheel) validates and builds it.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

from addon.progress import Progress, silent

from .extension_wheels import fetch_wheels
from .output import progress_on

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "addon"
WHEEL_CACHE = SOURCE / "wheels"
NOT_INSTALLED = ("__pycache__", "*.pyc", "wheels", ".*")


def build_extension(out: Path, wheels: Sequence[Path], progress: Progress = silent) -> Path:
    """Stage, check and zip the extension.

    Args:
        out: the folder for the zip; made when it is missing.
        wheels: the files to carry.
        progress: told about the steps.

    Returns:
        The zip's path.

    Raises:
        RuntimeError: Blender's checker refuses it; its words are in the message.
    """
    with (SOURCE / "blender_manifest.toml").open("rb") as file:
        manifest = tomllib.load(file)
    out.mkdir(parents=True, exist_ok=True)
    target = out / f"{manifest['id']}-{manifest['version']}.zip"
    # Beside the result, so that the wheels can be hard links and the last rename is atomic.
    with tempfile.TemporaryDirectory(dir=out, prefix=".stage-") as scratch:
        progress(0.0, "collecting the files")
        stage = Path(scratch) / "relume"
        _stage(stage, wheels)
        progress(0.1, "asking Blender's checker")
        _blender_ext("validate", str(stage))
        progress(0.2, "packing")
        part = Path(scratch) / target.name
        _blender_ext("build", "--source-dir", str(stage), "--output-filepath", str(part))
        progress(0.9, "checking the zip")
        _blender_ext("validate", str(part))
        part.replace(target)
    progress(1.0, "done")
    return target


def _stage(stage: Path, wheels: Sequence[Path]) -> None:
    """Lay out the extension's files in a folder."""
    shutil.copytree(SOURCE, stage, ignore=shutil.ignore_patterns(*NOT_INSTALLED))
    shutil.copy(ROOT / "LICENSE", stage)
    (stage / "wheels").mkdir()
    for wheel in wheels:
        target = stage / "wheels" / wheel.name
        try:
            os.link(wheel, target)
        except OSError:  # another file system
            shutil.copy(wheel, target)
    manifest = stage / "blender_manifest.toml"
    lines = manifest.read_text(encoding="utf-8").split("\n[", maxsplit=1)
    # A key must stand before the first table; JSON's strings and lists are TOML's too.
    names = json.dumps([f"./wheels/{wheel.name}" for wheel in wheels], indent=2)
    lines[0] += f"\nwheels = {names}\n"
    manifest.write_text("\n[".join(lines), encoding="utf-8")


def checker() -> Path:
    """Blender's command-line tool for extensions, inside the bpy wheel."""
    spec = importlib.util.find_spec("bpy")
    places = list(spec.submodule_search_locations or []) if spec else []
    for place in places:
        found = sorted(Path(place).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
        if found:
            return found[-1]
    raise RuntimeError("the bpy wheel with Blender's blender_ext.py is not installed; run make")


def _blender_ext(*arguments: str) -> None:
    result = subprocess.run(
        [sys.executable, str(checker()), *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip
    if result.returncode != 0:
        raise RuntimeError(f"Blender's checker: {result.stdout.strip()}")


def main(argv: Sequence[str] | None = None) -> int:
    """Fetch the wheels, build, and print the zip's path. Exit status 0, or 1 with a line."""
    parser = argparse.ArgumentParser(description="Build the extension's zip.")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="folder for the zip")
    args = parser.parse_args(argv)
    progress = progress_on(sys.stderr)
    try:
        wheels = fetch_wheels(WHEEL_CACHE, progress=lambda part, what: progress(0.6 * part, what))
        target = build_extension(
            args.out, wheels, progress=lambda part, what: progress(0.6 + 0.4 * part, what)
        )
    except (RuntimeError, OSError, subprocess.CalledProcessError) as error:
        print(f"build_extension: {error}", file=sys.stderr)
        return 1
    print(target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
