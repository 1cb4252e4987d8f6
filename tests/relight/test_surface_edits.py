# SPDX-License-Identifier: GPL-3.0-or-later
"""Edited surfaces on the GPU against their float64 twin, on random surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from addon.corrmap import surface_edit_table
from addon.corrmap.surface_buffer import SurfaceBuffer
from addon.corrmap.surface_edit_table import SurfaceEditTable
from addon.errors import InputError
from addon.relight.light_points.light_sample import light_sample
from addon.relight.lights.light_pass import LightPass
from addon.relight.shading.surface_pass import EmissionPass
from addon.scene.light import Light
from addon.scene.surface_edit import NO_EDIT, SurfaceEdit, SurfaceEdits
from tests.reference import light_pass as light_twin
from tests.reference.surface_edit import edited
from tests.reference.surfaces import Surfaces, random_surfaces

from .drawing import TABLES, drawn
from .test_passes import assert_close, placed

LIGHT = Light("l", "POINT", placed(), 100.0, np.array([1.0, 0.7, 0.2]), shadow_soft_size=0.1)
TINT = (0.9, 0.5, 0.1)
EDITS = {
    "gain": SurfaceEdit(gain=0.3),
    "gain and tint": SurfaceEdit(gain=1.7, tint=TINT),
    "no colour": SurfaceEdit(gain=0.0),
    "huge gain": SurfaceEdit(gain=1e9),
    "tiny gain": SurfaceEdit(gain=1e-9),
    "rougher": SurfaceEdit(roughness=1.5, roughness_offset=0.1),
    "smooth": SurfaceEdit(roughness=0.0, roughness_offset=0.05),
    "mirror": SurfaceEdit(roughness=0.0),
    "rough": SurfaceEdit(roughness_offset=1.0),
    "specular": SurfaceEdit(specular=1.6, specular_tint=TINT),
    "no specular": SurfaceEdit(specular=0.0),
    "huge specular": SurfaceEdit(specular=1e9),
    "all": SurfaceEdit(0.6, TINT, 0.7, 0.1, 0.5, (0.3, 0.6, 1.0), 2.0),
}


def uploaded(
    surfaces: Surfaces, edit: SurfaceEdit, of_objects: Sequence[SurfaceEdit] = ()
) -> SurfaceBuffer:
    """Surfaces of a material that is edited, on objects that are."""
    buffer = surfaces.upload()
    table = SurfaceEditTable(buffer.layout, buffer.material_table)
    names = tuple(f"object {number}" for number in range(len(of_objects)))
    edits = SurfaceEdits(
        dict.fromkeys(buffer.layout.plan.material_names, edit),
        dict(zip(names, of_objects, strict=True)),
    )
    made, layout = table.make(edits, names)
    return replace(buffer, material_table=made, layout=layout)


def lit(buffer: SurfaceBuffer) -> NDArray[np.float64]:
    """(H, W, 3): what one light sends to the viewer."""
    sample = light_sample(LIGHT, 0, 1)
    light_pass = LightPass(TABLES, buffer.layout)

    def draw(target: Any) -> None:
        light_pass.draw(buffer, LIGHT, sample, target, shadow=None)

    return drawn(buffer.width, buffer.height, draw)[..., :3]


@pytest.mark.usefixtures("gpu_context")
@pytest.mark.parametrize("lobes", [1, 2])
@pytest.mark.parametrize("name", EDITS)
def test_edited_surfaces_are_the_twins(name: str, lobes: int) -> None:
    surfaces = random_surfaces(7, size=40, lobes=lobes)
    sample = light_sample(LIGHT, 0, 1)
    want = light_twin.light_layer(edited(surfaces, EDITS[name]), LIGHT, sample)[..., :3]
    assert np.isfinite(want).all()
    assert_close(lit(uploaded(surfaces, EDITS[name])), want)


@pytest.mark.usefixtures("gpu_context")
def test_an_objects_edit_follows_its_materials(monkeypatch: pytest.MonkeyPatch) -> None:
    of_material = EDITS["all"]
    # More objects than the table has columns.
    monkeypatch.setattr(surface_edit_table, "_WIDTH", 4)
    some = ("gain and tint", "rougher", "specular", "no colour")
    each = tuple(EDITS[name] for name in 5 * some)
    plain = random_surfaces(11, size=40, lobes=2)
    number = np.random.default_rng(2).integers(0, len(each), plain.hit.shape)
    surfaces = replace(plain, objects=np.where(plain.hit, number, -1))
    sample = light_sample(LIGHT, 0, 1)
    want = np.zeros((*plain.hit.shape, 3))
    for index, edit in enumerate(each):
        both = edited(plain, of_material, edit)
        shown = light_twin.light_layer(both, LIGHT, sample)[..., :3]
        want = np.where((number == index)[..., None], shown, want)
    assert_close(lit(uploaded(surfaces, of_material, each)), want)


def test_only_what_is_edited_is_compiled(gpu_context: None) -> None:
    layout = random_surfaces(1, size=4).upload().layout
    assert "Edit" not in layout.read_glsl()
    surfaces = replace(random_surfaces(1, size=4), objects=np.zeros((4, 4), dtype=np.int64))
    of_material = uploaded(surfaces, EDITS["all"]).layout
    assert "read_edit" in of_material.read_glsl()
    assert "object" not in of_material.read_glsl().replace("an object", "")
    assert of_material.samplers == layout.samplers
    of_object = uploaded(surfaces, NO_EDIT, [EDITS["all"]]).layout
    assert "read_object_edit" in of_object.read_glsl()
    assert ("surface_object", "FLOAT_2D") in of_object.samplers


@pytest.mark.usefixtures("gpu_context")
def test_emission_has_its_own_factor() -> None:
    surfaces = random_surfaces(3, size=16)
    buffer = uploaded(surfaces, SurfaceEdit(gain=0.0, emission=2.5))
    emission_pass = EmissionPass(buffer.layout)
    got = drawn(16, 16, lambda target: emission_pass.draw(buffer, target))[..., :3]
    want = 2.5 * surfaces.channel("emission") * surfaces.hit[..., None]
    np.testing.assert_allclose(got, want, rtol=3e-7)


@pytest.mark.usefixtures("gpu_context")
def test_an_edit_that_changes_nothing_changes_nothing() -> None:
    surfaces = random_surfaces(5, size=64, lobes=2)
    plain, neutral = lit(surfaces.upload()), lit(uploaded(surfaces, NO_EDIT))
    # What is a dielectric's is taken out of a lobe and put back: a rounding.
    np.testing.assert_allclose(neutral, plain, rtol=1e-5, atol=1e-6 * plain.max())


@pytest.mark.parametrize(
    "values",
    [{"gain": -0.1}, {"gain": float("nan")}, {"tint": (1.0, 2e9, 1.0)}, {"roughness_offset": 1.5}],
)
def test_what_is_no_factor_is_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(values))):
        SurfaceEdit(**values)
