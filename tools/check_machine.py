# SPDX-License-Identifier: GPL-3.0-or-later
"""Says which Debian packages are missing, before Blender fails without saying.

`bpy` is linked to X11, and drawing without a display needs EGL with a driver; neither comes
in a wheel. Run by the Makefile before the tests and the demo:

    python -m tools.check_machine      exit 0, or 2 with the apt-get line to run
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from pathlib import Path

# What `readelf -d` names in the shared objects of the bpy 5.2 wheel that Debian must supply.
PACKAGE_OF_LIBRARY = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXt.so.6": "libxt6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libEGL_mesa.so.0": "libegl-mesa0",
}
# Mesa's drivers are plug-ins that no program links to: one of these files must exist. A
# machine with NVIDIA's driver has its own EGL, and needs none of Mesa's.
DRIVER_PACKAGE = "libgl1-mesa-dri"
DRIVER_PATTERNS = (
    "usr/lib/*/dri/swrast_dri.so",
    "usr/lib/*/dri/libdril_dri.so",
    "usr/lib/*/libgallium-*.so",
    "usr/lib/dri/swrast_dri.so",
    "usr/lib64/dri/swrast_dri.so",
)
OWN_EGL = "libEGL_nvidia.so.0"


def loads(library: str) -> bool:
    """True when the dynamic loader finds this library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def missing_packages(
    loads: Callable[[str], bool] = loads, root: Path = Path("/")
) -> tuple[str, ...]:
    """The Debian packages to install, none when the machine is ready.

    Args:
        loads: tells whether a shared library can be loaded.
        root: where the file system starts.
    """
    has_own_egl = loads(OWN_EGL)
    missing = [
        package
        for library, package in PACKAGE_OF_LIBRARY.items()
        if not loads(library) and not (has_own_egl and library == "libEGL_mesa.so.0")
    ]
    has_driver = any(next(root.glob(pattern), None) for pattern in DRIVER_PATTERNS)
    if not has_own_egl and not has_driver:
        missing.append(DRIVER_PACKAGE)
    return tuple(missing)


def main() -> int:
    """Exit status 0, or 2 after one line that says what to install."""
    missing = missing_packages()
    if missing:
        print(
            "This machine lacks what Blender needs to draw without a display. Run:  "
            "apt-get install " + " ".join(missing),
            file=sys.stderr,
        )
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
