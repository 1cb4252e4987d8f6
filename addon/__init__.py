# SPDX-License-Identifier: GPL-3.0-or-later
"""Relume: relight Blender shots from deep framebuffers that Cycles baked once."""


def register() -> None:
    """Add Relume's properties, operators, panels and render engine to Blender."""
    from . import ui

    ui.register()


def unregister() -> None:
    """Take out everything that register() added."""
    from . import ui

    ui.unregister()
