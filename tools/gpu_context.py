# SPDX-License-Identifier: GPL-3.0-or-later
"""A GPU context without a window, for Blender's `gpu` module."""

from __future__ import annotations

import ctypes
import sys

from addon.errors import InputError
from addon.native_lines import without_lines

from .check_machine import DRIVER_PACKAGE, PACKAGE_OF_LIBRARY, missing_packages

EGL_LIBRARY = "libEGL.so.1"
# From EGL_MESA_platform_surfaceless, for machines where no display is the default.
EGL_PLATFORM_SURFACELESS_MESA = 0x31DD
# Blender asks for the newest OpenGL first, and EGL says of each version that is too new that
# the arguments do not match.
HARMLESS = b"EGL Error (0x3009)"


def open_gpu() -> None:
    """Make `gpu` usable in this process, where it is not yet.

    Raises:
        InputError: there is no driver; Blender itself would crash then.
    """
    import gpu

    with without_lines(HARMLESS):
        if sys.platform == "linux" and not egl_works():
            raise InputError(_no_driver())
        gpu.init()


def egl_works() -> bool:
    """Whether EGL finds a driver, as Blender asks it: for a display, then for none."""
    try:
        egl = ctypes.CDLL(EGL_LIBRARY)
    except OSError:
        return False
    egl.eglGetDisplay.argtypes = [ctypes.c_void_p]
    egl.eglGetPlatformDisplay.argtypes = [ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglGetDisplay.restype = egl.eglGetPlatformDisplay.restype = ctypes.c_void_p
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    egl.eglInitialize.restype = ctypes.c_uint
    if egl.eglInitialize(egl.eglGetDisplay(None), None, None):
        return True
    display = egl.eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, None, None)
    return bool(egl.eglInitialize(display, None, None))


def _no_driver() -> str:
    usual = (PACKAGE_OF_LIBRARY[EGL_LIBRARY], PACKAGE_OF_LIBRARY["libEGL_mesa.so.0"])
    packages = missing_packages() or (*usual, DRIVER_PACKAGE)
    return (
        "EGL finds no driver to draw with on this machine; install Mesa's software driver with "
        f"apt-get install {' '.join(packages)}"
    )
