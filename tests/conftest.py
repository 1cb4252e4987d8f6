# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests share."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="session")
def gpu_context() -> None:
    """A GPU context without a window. Tests never skip for want of one: software OpenGL does."""
    import bpy  # noqa: F401  (the gpu module lives in it)
    import gpu

    gpu.init()
