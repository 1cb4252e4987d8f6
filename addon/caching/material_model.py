# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflection models of the papers, which an artist may choose for a material.

Gershbein and Hanrahan (2000) and Kim, Kyung and Lee (2009) shade with Lambert's, Phong's, Blinn's,
Oren and Nayar's, Cook and Torrance's and Minnaert's models. A material that has one is shaded with
it in the place of Cycles' models, from the colours and the roughness that its nodes give. Cycles
does not know the choice, so its own render of such a material differs; that is reported.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from .channels import DiffuseModel, Distribution
from .specialize_expression import BLACK, ONE, ZERO, Constant
from .specialize_lobes import Lobe, Lobes

# Identifier, name, what it does; in the order of the numbers that a .blend keeps.
MODELS: tuple[tuple[str, str, str], ...] = (
    ("CYCLES", "As in Cycles", "The models of the material's own shader nodes"),
    ("LAMBERT", "Lambert", "Diffuse alone, equally bright from everywhere"),
    ("PHONG", "Phong", "Diffuse, and a highlight around the mirrored direction"),
    ("BLINN", "Blinn", "Diffuse, and a highlight by the half vector, without masking or Fresnel"),
    ("OREN_NAYAR", "Oren-Nayar", "Rough diffuse alone: flatter, as clay or cloth"),
    ("COOK_TORRANCE", "Cook-Torrance", "Diffuse, and masked facets with Fresnel's reflectance"),
    ("MINNAERT", "Minnaert", "Diffuse that grows darker or brighter toward the outline"),
)  # fmt: skip
MODEL_NAMES = tuple(identifier for identifier, _, _ in MODELS)
DEFAULT_LIMB = 1.0

_HIGHLIGHTS = {
    "PHONG": Distribution.PHONG,
    "BLINN": Distribution.BLINN,
    "COOK_TORRANCE": Distribution.COOK_TORRANCE,
}


def material_model(material: Any) -> tuple[str, float]:
    """A `bpy.types.Material`'s model, and Minnaert's exponent.

    Also where the extension's properties are not registered, as on the command line: Blender
    keeps an enumeration's number in the file.
    """
    if hasattr(material, "relume"):
        return str(material.relume.model), float(material.relume.limb)
    kept = material.bl_system_properties_get()
    group = None if kept is None else kept.get("relume")
    if group is None:
        return MODEL_NAMES[0], DEFAULT_LIMB
    number = int(group.get("model", 0))
    name = MODEL_NAMES[number] if 0 <= number < len(MODEL_NAMES) else MODEL_NAMES[0]
    return name, float(group.get("limb", DEFAULT_LIMB))


def remodelled(lobes: Lobes, model: str, limb: float) -> Lobes:
    """Lobes as a model has them: the diffuse base without what a layer takes from it, and the
    highlight, if the model has one, with the reflectance that the nodes give it."""
    each = (_remodelled(lobe, model, limb) for lobe in lobes.each)
    return replace(lobes, each=tuple(lobe for lobe in each if not lobe.is_black))


def _remodelled(lobe: Lobe, model: str, limb: float) -> Lobe:
    base = replace(lobe, layer_f0=ZERO, layer_f90=ZERO, dielectric=ZERO, specular_dip=BLACK)
    if model in _HIGHLIGHTS:
        distribution = Constant((float(_HIGHLIGHTS[model]),))
        # Phong's and Blinn's highlights have one reflectance for all angles.
        f90 = lobe.specular_f90 if model == "COOK_TORRANCE" else lobe.specular_f0
        return replace(base, specular_f90=f90, distribution=distribution, diffuse_roughness=ZERO)
    base = replace(base, specular_f0=BLACK, specular_f90=BLACK, roughness=ONE)
    if model == "OREN_NAYAR":
        # A material without gloss says by itself how rough it is.
        rough = lobe.roughness if lobe.has_specular else lobe.diffuse_roughness
        return replace(base, diffuse_roughness=rough)
    if model == "MINNAERT":
        return replace(
            base,
            diffuse_model=Constant((float(DiffuseModel.MINNAERT),)),
            diffuse_roughness=Constant((limb,)),
        )
    return replace(base, diffuse_roughness=ZERO)
