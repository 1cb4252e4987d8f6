# SPDX-License-Identifier: GPL-3.0-or-later
"""A registered extension in an empty session."""

from __future__ import annotations

from collections.abc import Iterator

import bpy
import pytest

import addon


@pytest.fixture
def extension() -> Iterator[None]:
    """Relume registered, and Blender's factory file open: a cube, a light and a camera."""
    bpy.ops.wm.read_factory_settings()
    addon.register()
    yield
    addon.unregister()
