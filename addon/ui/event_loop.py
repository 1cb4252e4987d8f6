# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls that Blender's event loop makes later: drawing may neither run operators nor have other
areas drawn."""

from __future__ import annotations

from collections.abc import Callable

import bpy


def call_later(function: Callable[[], float | None], after_s: float) -> None:
    """Have a function called by Blender's event loop; once, however often it was asked for.

    Args:
        function: the same object each time, which a method looked up anew is not. If it gives
            seconds, it is called again after these.
        after_s: seconds until then.
    """
    if not bpy.app.timers.is_registered(function):
        bpy.app.timers.register(function, first_interval=after_s)
