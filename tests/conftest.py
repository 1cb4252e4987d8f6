# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests share."""

from __future__ import annotations

import os
import signal
import sys

import bpy  # noqa: F401  (the modules gpu and mathutils live in it)
import pytest

# Shells start what runs in the background with Ctrl+C switched off, and programs inherit that.
# The tests of stopping are of what it does where it is on.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def gpu_context() -> None:
    """A GPU context without a window. Tests never skip for want of one: software OpenGL does."""
    import gpu

    gpu.init()


_exit_status = 1


def pytest_sessionfinish(exitstatus: int) -> None:
    """Remember how the tests ended."""
    global _exit_status  # noqa: PLW0603 - pytest_unconfigure is not told
    _exit_status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure() -> None:
    """Leave without taking the interpreter down, with the tests' own exit status.

    Hundreds of tests leave objects of Blender's in reference cycles; those that the interpreter
    frees after Blender has shut itself down crash it, when every test has passed. A worker has
    told its results by then, and the process that started it ends with the status of all.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(_exit_status)
