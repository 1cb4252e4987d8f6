# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests share."""

from __future__ import annotations

import bpy  # noqa: F401  (the modules gpu and mathutils live in it)
import pytest


@pytest.fixture(scope="session")
def gpu_context() -> None:
    """A GPU context without a window. Tests never skip for want of one: software OpenGL does."""
    import gpu

    gpu.init()
