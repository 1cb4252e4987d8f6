# SPDX-License-Identifier: GPL-3.0-or-later
"""What an edit cannot reach in a cache is said, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.caching.plan import ChannelPlan
from addon.caching.surface_edit_reach import materials_on, out_of_reach
from addon.scene.surface_edit import SurfaceEdit, SurfaceEdits
from tests.synthetic import box, geometry_of

# Chalk is diffuse, Plastic black under gloss, Metal has no green, Lamp glows, Void is black.
NAMES = ("Chalk", "Plastic", "Metal", "Lamp", "Void")
BLACK = (0.0, 0.0, 0.0)
PLAN = ChannelPlan(
    ("depth", "material_id", "normal"),
    {"roughness": (0.5,)},
    NAMES,
    material_constants={
        "diffuse_color": ((0.8, 0.1, 0.1), BLACK, BLACK, (0.2, 0.2, 0.2), BLACK),
        "specular_f0": (BLACK, (0.04,) * 3, (0.9, 0.0, 0.4), BLACK, BLACK),
        "specular_f90": (BLACK, (1.0,) * 3, (1.0,) * 3, BLACK, BLACK),
        "layer_f0": ((0.0,), (0.04,), (0.0,), (0.0,), (0.0,)),
        "layer_f90": ((0.0,), (1.0,), (0.0,), (0.0,), (0.0,)),
        "dielectric": ((0.0,), (1.0,), (0.0,), (0.0,), (0.0,)),
        "emission": (BLACK, BLACK, BLACK, (1.0, 1.0, 1.0), BLACK),
    },
)


def sentences(material: str, **edit: Any) -> str:
    return " ".join(out_of_reach(PLAN, SurfaceEdits({material: SurfaceEdit(**edit)})))


@pytest.mark.parametrize(
    ("material", "edit", "says"),
    [
        ("Plastic", {"gain": 0.5}, "gain and tint do nothing"),
        ("Void", {"tint": (1.0, 0.0, 0.0)}, "gain and tint do nothing"),
        ("Metal", {"tint": (0.5, 1.0, 0.5)}, "no green"),
        ("Chalk", {"roughness": 0.5}, "roughness does nothing"),
        ("Chalk", {"specular": 0.5, "roughness_offset": 0.1}, "roughness and specular do nothing"),
        ("Chalk", {"emission": 2.0}, "emission does nothing"),
        ("Plastic", {"roughness": 3.0}, "roughness ends at 1"),
        ("Plastic", {"roughness_offset": -0.6}, "roughness ends at 0"),
        ("Plastic", {"specular": 30.0}, "reflectance of its gloss ends at 1"),
        ("Elsewhere", {"gain": 0.5}, "not in the cache"),
    ],
)
def test_what_an_edit_does_not_reach(material: str, edit: dict[str, Any], says: str) -> None:
    assert says in sentences(material, **edit)
    assert f"material '{material}'" in sentences(material, **edit)


@pytest.mark.parametrize(
    ("material", "edit"),
    [
        ("Chalk", {"gain": 0.5, "tint": (0.5, 1.0, 1.0)}),
        ("Metal", {"gain": 2.0, "roughness": 0.5, "specular": 3.0}),
        ("Metal", {"tint": (1.0, 0.2, 0.2)}),
        ("Plastic", {"specular": 2.0, "roughness_offset": 0.5}),
        ("Lamp", {"emission": 5.0}),
        ("Void", {}),
    ],
)
def test_nothing_is_said_of_what_shows(material: str, edit: dict[str, Any]) -> None:
    assert not sentences(material, **edit)


def test_what_varies_may_show_unless_it_is_black_on_the_whole() -> None:
    plan = ChannelPlan(("depth", "material_id", "normal", "diffuse_color"), {}, ("A", "B"))
    edits = SurfaceEdits({"A": SurfaceEdit(gain=2.0), "B": SurfaceEdit(gain=2.0)})

    def mean(material: int, channel: str) -> NDArray[np.float64]:
        assert channel == "diffuse_color"
        return np.zeros(3) if material == 1 else np.array([0.1, 0.2, 0.3])

    assert not out_of_reach(plan, edits)
    (sentence,) = out_of_reach(plan, edits, mean)
    assert sentence.startswith("material 'B': gain and tint do nothing")


def test_an_object_is_limited_where_all_its_materials_are() -> None:
    geometry = geometry_of([box((i, 0, 0), 0.5) for i in range(3)])
    # The first is of Plastic and Void, which have no colour; the second of Void and Chalk.
    half = len(geometry) // 6
    materials = np.repeat([1, 4, 4, 0, 5, 5], half).astype(np.int32)
    geometry = replace(geometry, material_id=materials, material_names=(*NAMES, ""))
    edits = SurfaceEdits(objects={f"part {i}": SurfaceEdit(gain=2.0) for i in range(3)})
    materials_of = materials_on(geometry, edits.objects)
    assert materials_of["part 0"] == {"Plastic", "Void"}
    (sentence,) = out_of_reach(PLAN, edits, materials_of=materials_of)
    assert sentence.startswith("object 'part 0': gain and tint do nothing")
