# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a scene's cache on a farm, in plain Python or inside Blender.

    python tools/bake_cache.py SCENE.blend --cache DIR [--preset final] [--resume] …
    blender --background SCENE.blend --python tools/bake_cache.py -- --cache DIR …

Inside Blender the packages scipy, embreex and OpenEXR are needed: install the extension, or
set PYTHONPATH and start Blender with --python-use-system-env.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

# Started as a script, Python does not know the checkout's folder.
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

_NEEDED = ("numpy", "scipy", "embreex", "OpenEXR")


def main(argv: Sequence[str]) -> int:
    """Bake; returns the exit status: 0, 2 for input that cannot be used, 1 for anything else."""
    missing = [name for name in _NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        sys.stderr.write(
            f"relume: Blender's Python lacks {', '.join(missing)}; install the Relume extension "
            "or set PYTHONPATH and add --python-use-system-env\n"
        )
        return 2
    from addon.errors import InputError
    from addon.stopping import stop_signals

    try:
        # What takes time to load is loaded in this block.
        with stop_signals():
            return _bake(list(argv))
    except InputError as error:
        sys.stderr.write(f"relume: {error}\n")
        return 2
    except KeyboardInterrupt:
        sys.stderr.write("relume: stopped\n")
        return 1


def _bake(arguments: list[str]) -> int:
    """The scene's file first among the arguments, if this is not inside Blender."""
    from tools.scene_file import load_blender, open_scene

    load_blender()
    import bpy

    from addon import batch

    if not bpy.app.binary_path:
        if not arguments or arguments[0].startswith("-"):
            sys.stderr.write("relume: name the .blend file first\n")
            return 2
        open_scene(Path(arguments.pop(0)))
    return batch.main(arguments)


if __name__ == "__main__":
    inside_blender = "--" in sys.argv
    status = main(sys.argv[sys.argv.index("--") + 1 :] if inside_blender else sys.argv[1:])
    sys.exit(status)
