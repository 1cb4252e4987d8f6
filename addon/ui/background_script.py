# SPDX-License-Identifier: GPL-3.0-or-later
"""Run as a script by a background Blender, for Place, Bake and the filling of holes.

    blender --background JOB.blend --python background_script.py -- REQUEST

REQUEST is one JSON object, made by `job`: `paths` (added to sys.path, so that the extension's
wheels are found although the child starts without the artist's preferences), `blend` (opened
here where the program is plain Python with bpy) and `steps`, a list of verbs with their
arguments; the first that fails ends the work.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import os
import signal
import sys
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any

FOLDER = Path(__file__).resolve().parent.parent
PACKAGE = "relume_background"
# Verb -> the module whose main(arguments) does it and returns the exit status.
MODULES = {"place": ".ui.background_place", "bake": ".batch", "fill": ".ui.background_fill"}

# A process whose owner is gone may take so long to end in order, in seconds.
GRACE_S = 60.0


def end_with_parent() -> None:
    """End this process when the other end of its standard input is closed.

    In order if it can, and at once after a while: caches are written to temporary names and
    renamed, so that even then nothing half-written is left under a final name.
    """

    def watch() -> None:
        # Not through sys.stdin: its lock, held here, would break the interpreter's own end.
        while os.read(0, 4096):
            pass
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(GRACE_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def load_extension() -> ModuleType:
    """Import the extension as a package of its own name, wherever its folder lies."""
    spec = importlib.util.spec_from_file_location(
        PACKAGE, FOLDER / "__init__.py", submodule_search_locations=[str(FOLDER)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = module
    spec.loader.exec_module(module)
    return module


def main(request: dict[str, Any]) -> int:
    """Do what was asked for; the exit status is that of the command line's verbs."""
    sys.path.extend(path for path in request["paths"] if path not in sys.path)
    load_extension()
    if not Path(_open_file()).samefile(request["blend"]):
        import bpy

        bpy.ops.wm.open_mainfile(filepath=request["blend"], load_ui=False)
    for verb, arguments in request["steps"]:
        status = int(importlib.import_module(MODULES[verb], PACKAGE).main(arguments))
        if status != 0:
            return status
    return 0


def _open_file() -> str:
    import bpy

    return bpy.data.filepath or os.devnull


if __name__ == "__main__":
    end_with_parent()
    sys.exit(main(json.loads(sys.argv[sys.argv.index("--") + 1])))
