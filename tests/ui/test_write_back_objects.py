# SPDX-License-Identifier: GPL-3.0-or-later
"""A Cycles render of what was written shows what Relume shows of objects' weights of 0 and 1."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from addon.ui.write_back_objects import remove_objects, write_objects
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


@pytest.mark.parametrize("shares_data", [True, False])
def test_a_copied_lamp_gets_its_own_collection_back(extension: None, shares_data: bool) -> None:
    lamp, cube = bpy.data.objects["Light"], bpy.data.objects["Cube"]
    own = bpy.data.collections.new("own")
    own.objects.link(cube)
    lamp.light_linking.receiver_collection = own
    add(bpy.context.scene, "Light", "Cube", 0.0)
    write_objects(lamp.data)
    copy = lamp.copy()
    if not shares_data:
        copy.data = lamp.data.copy()
    bpy.context.scene.collection.objects.link(copy)
    collections = len(bpy.data.collections)
    for each in (lamp, copy):
        remove_objects(each.data)
    assert lamp.light_linking.receiver_collection == own
    assert copy.light_linking.receiver_collection == own
    assert len(bpy.data.collections) == collections - 1
