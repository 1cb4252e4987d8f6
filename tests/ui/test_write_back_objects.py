# SPDX-License-Identifier: GPL-3.0-or-later
"""A Cycles render of what was written shows what Relume shows of objects' weights of 0 and 1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.ui.write_back_objects import write_objects
from tests.relight.test_linking_against_cycles import (
    away_from_edges,
    build,
    collection,
    each_alone,
    link,
    psnr,
    relit,
)


def add(scene: Any, lamp: str, name: str, weight: float) -> None:
    entry = scene.objects[lamp].relume_objects.entries.add()
    entry.object, entry.weight = bpy.data.objects[name], weight


@pytest.mark.usefixtures("gpu_context")
def test_weights_in_cycles(extension: None, tmp_path: Path) -> None:
    """Some left out beside the artist's own collection, and none but one instance lit."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    build(scene)
    link(scene, "Key", collection("Floor", "Left", "Middle"))
    add(scene, "Key", "Left", 0.0)
    add(scene, "Fill", "Group", 1.0)
    scene.objects["Fill"].relume_objects.others = 0.0
    result = relit(scene)
    for lamp in ("Key", "Fill"):
        write_objects(scene.objects[lamp].data)
    reference = each_alone(scene, tmp_path)
    inner = away_from_edges(result.seen)
    # As in tests/relight/test_linking_against_cycles.py.
    written = psnr(result.linked, reference, inner)
    assert written > 45.0, f"{written:.1f} dB"
    assert psnr(result.unlinked, reference, inner) < 40.0
    again = relit(scene)
    assert (again.linked == result.linked).all()
