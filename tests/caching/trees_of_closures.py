# SPDX-License-Identifier: GPL-3.0-or-later
"""Trees of one closure each; what they reflect, in float64 from the manual's formulas."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .material_grid import node_in, set_inputs
from .material_trees import Fields, Tree

MULTI_GGX, GGX, BECKMANN, ASHIKHMIN_SHIRLEY = range(4)
COAT = 3

BASE = np.array([0.6, 0.3, 0.1])
TINT = np.array([1.0, 0.8, 0.5])


def closure(
    kind: str, settings: dict[str, str] | None = None, **inputs: Any
) -> Callable[..., None]:
    """A tree of this one node."""

    def make(tree: Any, output: Any) -> None:
        node = tree.nodes.new(kind)
        for name, value in (settings or {}).items():
            setattr(node, name, value)
        set_inputs(tree, node, **inputs)
        tree.links.new(node.outputs[0], output.inputs["Surface"])

    return make


def reflectance(ior: float) -> float:
    """Fresnel's at normal incidence."""
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def edge(f0: Any, tint: Any) -> Any:
    """The dip of the F82-tint model: b of F = Schlick - b cos (1 - cos)^6, which is `tint` times
    Schlick's at cos = 1/7."""
    cosine = 1.0 / 7.0
    schlick = f0 + (1.0 - f0) * (1.0 - cosine) ** 5
    return schlick * (1.0 - np.asarray(tint)) / (cosine * (1.0 - cosine) ** 6)


def principled_fields(
    *,
    base: Any = 0.8,
    metallic: float = 0.0,
    roughness: float = 0.5,
    ior: float = 1.5,
    level: float = 0.5,
    tint: Any = 1.0,
    transmission: float = 0.0,
    diffuse_roughness: float = 0.0,
    distribution: int = MULTI_GGX,
) -> dict[str, Any]:
    """The lobe of a Principled BSDF without coat, sheen and thin film."""
    base, tint = np.asarray(base), np.asarray(tint)
    f0 = reflectance(ior) * 2.0 * level
    f90 = 1.0 if f0 > 0.0 else 0.0
    layer = np.minimum(f0 * tint, 1.0)
    glass = np.minimum(reflectance(ior) * tint, 1.0)
    opaque = (1.0 - metallic) * (1.0 - transmission)
    clear = (1.0 - metallic) * transmission
    metal = np.minimum(base, 1.0)
    fields = {
        "diffuse_color": base * opaque,
        "diffuse_roughness": diffuse_roughness,
        "diffuse_share": opaque,
        "layer_f0": float(np.max(layer)),
        "layer_f90": f90,
        "specular_f0": metal * metallic + layer * opaque + glass * clear,
        "specular_f90": metallic + f90 * opaque + clear,
        "specular_dip": edge(metal, np.minimum(tint, 1.0)) * metallic,
        "dielectric": opaque + clear,
        "roughness": roughness,
        "specular_share": metallic + f90 * opaque + clear,
        "distribution": distribution,
    }
    kept = {"roughness", "specular_share"}
    return {name: value for name, value in fields.items() if np.any(value) or name in kept}


def weighted(fields: dict[str, Any], weight: float) -> dict[str, Any]:
    """The fields of a lobe that has so much of the material: of a layer before what lies behind."""
    names = ("diffuse_color", "specular_f0", "specular_f90", "specular_dip")
    shares = ("dielectric", "diffuse_share", "specular_share")
    return fields | {name: weight * fields[name] for name in (*names, *shares) if name in fields}


def principled(name: str, effects: tuple[str, ...] = (), **inputs: Any) -> Tree:
    """A Principled BSDF with these inputs, by the names of `principled_fields`."""
    labels = {
        "base": "Base_Color",
        "level": "Specular_IOR_Level",
        "tint": "Specular_Tint",
        "ior": "IOR",
        "transmission": "Transmission_Weight",
    }
    of_node = {labels.get(key, key.title()): value for key, value in inputs.items()}
    distribution = of_node.pop("Distribution", MULTI_GGX)
    names = {MULTI_GGX: "MULTI_GGX", GGX: "GGX"}
    make = closure("ShaderNodeBsdfPrincipled", {"distribution": names[distribution]}, **of_node)
    return Tree(name, make, [principled_fields(**inputs)], effects=effects)


def other_inputs(name: str, effects: tuple[str, ...] = (), **inputs: Any) -> Tree:
    """A Principled BSDF with inputs that have no say in what is cached."""
    make = closure("ShaderNodeBsdfPrincipled", **inputs)
    return Tree(name, make, [principled_fields()], effects=effects)


PRINCIPLED = [
    Tree("principled", closure("ShaderNodeBsdfPrincipled"), [principled_fields()]),
    principled("base colour", base=BASE),
    principled("base colour above 1", base=np.array([1.5, 0.5, 0.0])),
    principled("half metal", base=BASE, metallic=0.5),
    principled("metal", base=BASE, metallic=1.0),
    principled("metal with an edge", base=BASE, metallic=1.0, tint=TINT, roughness=0.3),
    principled("metal of more than 1", base=np.array([1.5, 0.5, 0.2]), metallic=1.0, tint=TINT),
    principled("smooth", roughness=0.0),
    principled("rough", roughness=1.0),
    principled("index of refraction", ior=2.2),
    principled("index below 1", ior=0.7),
    principled("no refraction", ior=1.0),
    principled("no reflection", level=0.0),
    principled("much reflection", level=1.0, ior=1.8),
    principled("tinted reflection", base=BASE, tint=TINT),
    principled("tint above 1", tint=np.array([30.0, 2.0, 1.0]), ior=1.6),
    principled("rough diffuse", diffuse_roughness=0.7),
    principled("plain GGX", distribution=GGX, roughness=0.3),
    principled("transmission", ("transmitted light",), base=BASE, transmission=0.4),
    principled("all transmission", ("transmitted light",), tint=TINT, transmission=1.0, ior=1.3),
    principled(
        "all together",
        ("transmitted light",),
        base=BASE,
        metallic=0.3,
        roughness=0.2,
        ior=1.4,
        level=0.8,
        tint=TINT,
        transmission=0.25,
        diffuse_roughness=0.4,
        distribution=GGX,
    ),
    other_inputs("subsurface", ("subsurface",), Subsurface_Weight=0.7),
    other_inputs("no subsurface", Subsurface_Weight=0.0, Subsurface_Scale=0.5),
    other_inputs("rotation alone", Anisotropic_Rotation=0.3),
    other_inputs("thin film", ("thin film",), Thin_Film_Thickness=300.0),
]


def coated(
    base: Fields, weight: float, *, roughness: float = 0.03, ior: float = 1.5, tint: Any = 1.0
) -> list[dict[str, Any]]:
    """Two lobes: what is under the coat, seen through 1 - weight * its albedo, and the coat."""
    f0 = reflectance(ior)
    through = 1.0 - weight + weight * np.asarray(tint)
    colours = {"diffuse_color", "specular_f0", "specular_f90", "specular_dip"}
    under = {
        key: np.asarray(value) * through if key in colours else value for key, value in base.items()
    }
    for name in {"dielectric", "diffuse_share", "specular_share"} & under.keys():
        under[name] = under[name] * float(np.mean(through))
    view = {"slope": -weight, "curve": COAT, "parameter": f0, "roughness": roughness}
    under |= {f"view_{key}": value for key, value in view.items()}
    over = {
        "specular_f0": f0 * weight,
        "specular_f90": weight,
        "layer_f0": f0,
        "layer_f90": 1.0,
        "dielectric": weight,
        "roughness": roughness,
        "distribution": GGX,
    }
    return [under, over]


def turned(normal: tuple[float, float, float], *sockets: str, **inputs: Any) -> Callable[..., None]:
    """A Principled BSDF of which some normals are this one."""

    def make(tree: Any, output: Any) -> None:
        node = node_in(tree, "ShaderNodeBsdfPrincipled", **inputs)
        # Not a constant: a Combine XYZ node of the surface's own position.
        bent = node_in(tree, "ShaderNodeVectorMath")
        bent.operation = "MULTIPLY_ADD"
        position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
        tree.links.new(position, bent.inputs[0])
        bent.inputs[1].default_value, bent.inputs[2].default_value = (0, 0, 0), normal
        for socket in sockets:
            tree.links.new(bent.outputs[0], node.inputs[socket])
        tree.links.new(node.outputs[0], output.inputs["Surface"])

    return make


TILTED = (0.6, 0.0, 0.8)
COATED_LOBES = coated(principled_fields(), 0.5)
COATS = [
    Tree("coat", closure("ShaderNodeBsdfPrincipled", Coat_Weight=0.5), COATED_LOBES),
    Tree(
        "whole coat",
        closure(
            "ShaderNodeBsdfPrincipled",
            Base_Color=BASE,
            Coat_Weight=1.0,
            Coat_Roughness=0.25,
            Coat_IOR=1.7,
        ),
        coated(principled_fields(base=BASE), 1.0, roughness=0.25, ior=1.7),
    ),
    Tree(
        "tinted coat",
        closure("ShaderNodeBsdfPrincipled", Coat_Weight=0.5, Coat_Tint=TINT),
        coated(principled_fields(), 0.5, tint=TINT),
        effects=("tint of its coat",),
    ),
    Tree(
        "coat with a normal",
        # Three times as long: closures take it at unit length.
        turned((1.8, 0.0, 2.4), "Coat Normal", Coat_Weight=0.5),
        [COATED_LOBES[0], COATED_LOBES[1] | {"normal": TILTED}],
    ),
    Tree(
        # The coat keeps the surface's own.
        "base with a normal under a coat",
        turned(TILTED, "Normal", Coat_Weight=0.5),
        [COATED_LOBES[0] | {"normal": TILTED}, COATED_LOBES[1]],
    ),
    Tree(
        "coat and base with a normal",
        turned(TILTED, "Normal", "Coat Normal", Coat_Weight=0.5),
        [lobe | {"normal": TILTED} for lobe in COATED_LOBES],
    ),
    Tree(
        "glowing under a coat",
        closure(
            "ShaderNodeBsdfPrincipled",
            Coat_Weight=0.5,
            Emission_Color=(1.0, 0.5, 0.25),
            Emission_Strength=3.0,
        ),
        COATED_LOBES,
        emission=3.0 * np.array([1.0, 0.5, 0.25]) * (1.0 - 0.5 * reflectance(1.5)),
        effects=("a second weight that depends on the view",),
    ),
]


def glossy_fields(colour: Any, roughness: float, distribution: int) -> dict[str, Any]:
    return {
        "specular_f0": colour,
        "specular_f90": colour,
        "roughness": roughness,
        # Zero is not a value of note: by it a lobe is known to have bounces.
        **({"distribution": distribution} if distribution else {}),
    }


DISTRIBUTIONS = {
    "MULTI_GGX": MULTI_GGX,
    "GGX": GGX,
    "BECKMANN": BECKMANN,
    "ASHIKHMIN_SHIRLEY": ASHIKHMIN_SHIRLEY,
}


def fresnel(n: complex, cosine: float) -> float:
    """A conductor's reflectance, by Fresnel's equations with a complex index (Born and Wolf)."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / n**2)
    across = (cosine - n * inside) / (cosine + n * inside)
    along = (n * cosine - inside) / (n * cosine + inside)
    return float(0.5 * (abs(across) ** 2 + abs(along) ** 2))


COPPER_N, COPPER_K = np.array([0.271, 0.677, 1.316]), np.array([3.609, 2.625, 2.292])
COPPER = [complex(n, k) for n, k in zip(COPPER_N, COPPER_K, strict=True)]
COPPER_F0 = np.array([fresnel(n, 1.0) for n in COPPER])
COPPER_82 = np.array([fresnel(n, 1.0 / 7.0) for n in COPPER])


def _diffuse_with_normal(tree: Any, output: Any) -> None:
    normal = node_in(tree, "ShaderNodeNormalMap", Color=(0.8, 0.5, 0.9))
    normal.space = "WORLD"
    node = node_in(tree, "ShaderNodeBsdfDiffuse", Normal=normal.outputs[0])
    tree.links.new(node.outputs[0], output.inputs["Surface"])


OTHERS = [
    Tree(
        "diffuse",
        closure("ShaderNodeBsdfDiffuse", Color=BASE),
        [{"diffuse_color": BASE}],
    ),
    Tree(
        "rough diffuse node",
        closure("ShaderNodeBsdfDiffuse", Color=BASE, Roughness=0.8),
        [{"diffuse_color": BASE, "diffuse_roughness": 0.8}],
    ),
    Tree(
        "diffuse with a normal",
        _diffuse_with_normal,
        [{"diffuse_color": [0.8] * 3, "normal": TILTED}],
    ),
    *(
        Tree(
            f"glossy {name}",
            closure("ShaderNodeBsdfAnisotropic", {"distribution": name}, Color=BASE, Roughness=0.3),
            [glossy_fields(BASE, 0.3, value)],
        )
        for name, value in DISTRIBUTIONS.items()
    ),
    *(
        Tree(
            f"metallic {name}",
            closure(
                "ShaderNodeBsdfMetallic",
                {"distribution": name, "fresnel_type": "F82"},
                Base_Color=BASE,
                Edge_Tint=TINT,
                Roughness=0.3,
            ),
            [
                glossy_fields(BASE, 0.3, DISTRIBUTIONS[name])
                | {"specular_f90": 1.0, "specular_dip": edge(BASE, TINT)}
            ],
        )
        for name in ("MULTI_GGX", "GGX", "BECKMANN")
    ),
    Tree(
        "conductor",
        closure(
            "ShaderNodeBsdfMetallic",
            {"fresnel_type": "PHYSICAL_CONDUCTOR"},
            IOR=COPPER_N,
            Extinction=COPPER_K,
            Roughness=0.3,
        ),
        [
            glossy_fields(COPPER_F0, 0.3, MULTI_GGX)
            | {
                "specular_f90": 1.0,
                "specular_dip": edge(
                    COPPER_F0, COPPER_82 / (COPPER_F0 + (1 - COPPER_F0) * (6 / 7) ** 5)
                ),
            }
        ],
    ),
    Tree(
        "sheen",
        closure("ShaderNodeBsdfSheen", Color=BASE, Roughness=0.4),
        [{"sheen_color": BASE, "sheen_roughness": 0.4}],
    ),
    Tree(
        "translucent",
        closure("ShaderNodeBsdfTranslucent", Color=BASE),
        [{"translucent_color": BASE}],
    ),
    Tree(
        "emission",
        closure("ShaderNodeEmission", Color=BASE, Strength=5.0),
        emission=5.0 * BASE,
    ),
    Tree(
        "principled emission",
        closure("ShaderNodeBsdfPrincipled", Emission_Color=BASE, Emission_Strength=2.0),
        [principled_fields()],
        emission=2.0 * BASE,
    ),
    Tree(
        "glass",
        closure("ShaderNodeBsdfGlass", Color=BASE, Roughness=0.2, IOR=1.4),
        [glossy_fields(BASE * reflectance(1.4), 0.2, MULTI_GGX) | {"specular_f90": BASE}],
        effects=("transmitted light",),
    ),
    Tree("refraction", closure("ShaderNodeBsdfRefraction"), effects=("transmitted light",)),
    Tree(
        "subsurface node",
        closure("ShaderNodeSubsurfaceScattering", Color=BASE),
        [{"diffuse_color": BASE}],
        effects=("subsurface",),
    ),
    Tree(
        "toon",
        closure("ShaderNodeBsdfToon", Color=BASE),
        [{"diffuse_color": BASE}],
        effects=("toon",),
    ),
    Tree("holdout", closure("ShaderNodeHoldout"), effects=("shown black",)),
    Tree("clear", closure("ShaderNodeBsdfTransparent", Color=(1, 1, 1)), hole=True),
    # Black is what Cycles shows of it.
    Tree("dark glass pane", closure("ShaderNodeBsdfTransparent", Color=(0.0, 0.0, 0.0))),
    Tree(
        "stained glass pane",
        closure("ShaderNodeBsdfTransparent", Color=(0.9, 0.8, 0.7)),
    ),
    Tree(
        "mostly there",
        closure("ShaderNodeBsdfPrincipled", Base_Color=BASE, Alpha=0.75),
        [weighted(principled_fields(base=BASE), 0.75)],
    ),
    Tree(
        "hardly there",
        closure("ShaderNodeBsdfPrincipled", Base_Color=BASE, Alpha=0.25),
        [weighted(principled_fields(base=BASE), 0.25)],
    ),
    Tree("no output", lambda tree, output: tree.nodes.remove(output)),
    Tree("no surface", lambda tree, output: None),
]


TREES = [*PRINCIPLED, *COATS, *OTHERS]
