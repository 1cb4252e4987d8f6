# SPDX-License-Identifier: GPL-3.0-or-later
"""The GPU context of the command line: quiet where it works, plain words where it does not."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tools.gpu_context import egl_works

ROOT = Path(__file__).resolve().parents[2]
OPEN = "import bpy; from tools.gpu_context import open_gpu; open_gpu(); print('opened')"


def open_gpu(**environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", OPEN],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | environment,
        check=False,
        timeout=60,
    )


def test_this_machine_has_a_driver() -> None:
    assert egl_works()


def test_a_context_without_noise() -> None:
    run = open_gpu()
    assert run.stdout.endswith("opened\n")
    assert "EGL Error (0x3009)" not in run.stderr


def test_without_a_driver_the_packages_are_named() -> None:
    run = open_gpu(__EGL_VENDOR_LIBRARY_FILENAMES="/nonexistent")  # hides them all
    assert run.returncode == 1  # not a crash
    assert "apt-get install" in run.stderr
    assert "libgl1-mesa-dri" in run.stderr
