# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes that a benchmark is asked for."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.unique_names import folder_names


def chosen_scenes(paths: Sequence[Path], folder: Path) -> dict[str, Path]:
    """By the names of their folders; the demo's room, which is built in `folder` first, if none is
    named. Ends the program where there is no such file."""
    if paths:
        missing = [str(path) for path in paths if not path.is_file()]
        if missing:
            sys.exit(f"there is no file {', '.join(missing)}; check the path")
        return dict(zip(folder_names([path.stem for path in paths]), paths, strict=True))
    room = folder / "room.blend"
    if not room.is_file():
        command = [sys.executable, "-m", "tools.demo_scene", str(room)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return {"room": room}
