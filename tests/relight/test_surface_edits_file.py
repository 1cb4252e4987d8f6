# SPDX-License-Identifier: GPL-3.0-or-later
"""SURFACES.json: what it changes, and what is said when it can't."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from addon.errors import InputError
from addon.relight.edits.surface_edits_file import read_surface_changes
from addon.scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits

KEPT = SurfaceEdits({"Wood": SurfaceEdit(gain=0.5, specular=2.0)}, {"Chair": SurfaceEdit(gain=3.0)})


def applied(tmp_path: Path, data: Any) -> SurfaceEdits:
    path = tmp_path / "surfaces.json"
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return read_surface_changes(path).over(KEPT, ("Wood", "Steel", ""), ("Chair", "Table"))


def test_what_is_named_takes_the_place_of_what_was_kept(tmp_path: Path) -> None:
    data = {
        "materials": {"Wood": {"gain": 2, "tint": [1, 0.5, 0]}, "Steel": {"roughness": 0.5}},
        "objects": {"Chair": None},
    }
    found = applied(tmp_path, data)
    assert found.materials == {
        "Wood": SurfaceEdit(gain=2.0, tint=(1.0, 0.5, 0.0), specular=2.0),
        "Steel": SurfaceEdit(roughness=0.5),
    }
    assert found.objects == {"Chair": NO_EDIT}


def test_an_empty_file_changes_nothing(tmp_path: Path) -> None:
    assert applied(tmp_path, {}) == KEPT


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ("{", "not JSON"),
        ([], "'materials' and 'objects'"),
        ({"lights": {}}, "'materials' and 'objects'"),
        ({"materials": []}, "names of materials"),
        ({"materials": {"Wood": 3}}, "null for no edit"),
        ({"materials": {"Oak": {}}}, "the scene's materials are: Steel, Wood"),
        ({"objects": {"Wood": {}}}, "there is no object 'Wood'"),
        ({"materials": {"Wood": {"shine": 1}}}, "no attribute 'shine'.*gain"),
        ({"materials": {"Wood": {"gain": "1"}}}, "'gain' of material 'Wood'.*number"),
        ({"materials": {"Wood": {"gain": True}}}, "must be a number"),
        ({"materials": {"Wood": {"gain": -1}}}, "material 'Wood'.*from 0 to 1e"),
        ('{"materials": {"Wood": {"gain": NaN}}}', "'gain'"),
        ('{"materials": {"Wood": {"gain": 1e999}}}', "'gain'"),
        ({"materials": {"Wood": {"gain": 10**400}}}, "too large"),
        ({"materials": {"Wood": {"tint": [1, 1]}}}, "list of 3 numbers"),
        ({"objects": {"Chair": {"roughness_offset": 2}}}, "object 'Chair'.*from -1 to 1"),
    ],
)
def test_what_cannot_be_is_said(tmp_path: Path, data: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        applied(tmp_path, data)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.json"):
        read_surface_changes(tmp_path / "nowhere.json")
