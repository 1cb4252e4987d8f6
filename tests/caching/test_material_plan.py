# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the channels of materials live: what no shader could take is refused."""

from __future__ import annotations

import math

import pytest

from addon.caching.material_plan import plan_channels
from addon.caching.plan import ChannelPlan
from addon.caching.specialize_expression import Constant, Socket
from addon.caching.specialize_lobes import Lobe, Lobes
from addon.errors import InputError

GREY = Constant((0.5, 0.5, 0.5))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e39])
@pytest.mark.parametrize("alone", [True, False])
def test_constants_that_are_not_finite_are_named(value: float, alone: bool) -> None:
    fine = Lobes.of(Lobe(diffuse_color=GREY, diffuse_roughness=Constant((1.0,))))
    broken = Lobes.of(Lobe(diffuse_color=GREY, diffuse_roughness=Constant((value,))))
    names, materials = ["fine", "broken"], [fine, broken]
    if alone:
        names, materials = names[1:], materials[1:]
    with pytest.raises(InputError, match="'broken' gives 'diffuse_roughness' that is not finite"):
        plan_channels(names, materials, [()] * len(names), has_ambient=False)


def test_the_largest_number_is_finite() -> None:
    glowing = Lobes(emission=Constant((3.4e38, 0.0, 0.0)))
    plan = plan_channels(["glowing"], [glowing], [()], has_ambient=False)
    assert plan.constants["emission"] == (3.4e38, 0.0, 0.0)


def test_which_normals_are_the_mesh_s_own() -> None:
    leaning = Socket("a Bump node", "Normal", 3)
    plain = Lobes.of(Lobe(diffuse_color=GREY))
    bumped = Lobes.of(Lobe(diffuse_color=GREY, normal=leaning))
    coated = Lobes((Lobe(diffuse_color=GREY), Lobe(specular_f0=GREY, normal=leaning)))
    names, materials = ["plain", "bumped", "coated", "displaced"], [plain, bumped, coated, plain]
    plan = plan_channels(names, materials, [()] * 4, has_ambient=False, bent=[3])
    # Of a lobe that a material does not have nothing is read.
    assert plan.mesh_normals == {
        "normal": (True, False, True, False),
        "normal_2": (True, True, False, False),
    }
    assert ChannelPlan.from_json(plan.to_json()) == plan
    older = plan.to_json()
    del older["mesh_normals"]
    assert not ChannelPlan.from_json(older).mesh_normals


def test_a_diffuse_material_has_no_layer_beside_those_that_have_one() -> None:
    """The one layer of all other materials is no constant of the scene: it would dim the base."""
    layered = Lobes.of(
        Lobe(
            diffuse_color=GREY,
            layer_f0=Constant((0.04,)),
            layer_f90=Constant((1.0,)),
            specular_f0=GREY,
            specular_f90=GREY,
        )
    )
    plain = Lobes.of(Lobe(diffuse_color=GREY))
    plan = plan_channels(["layered", "plain"], [layered, plain], [()] * 2, has_ambient=False)
    assert plan.material_constants["layer_f0"] == ((0.04,), (0.0,))
    assert plan.material_constants["layer_f90"] == ((1.0,), (0.0,))
    alone = plan_channels(["plain"], [plain], [()], has_ambient=False)
    assert not {"layer_f0", "layer_f90"} & {*alone.constants, *alone.material_constants}
