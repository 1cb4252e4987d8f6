# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns the shader nodes of Cycles into lobes.

The Principled BSDF follows Blender's manual and Cycles' closure_principled: a metal lobe, a
dielectric lobe with F0 from the IOR, scaled by the specular level and tinted, and a diffuse
lobe that the dielectric lobe's albedo takes light from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..scene.node_reader import source_of
from . import specialize_lobes
from .specialize_expression import (
    ONE,
    ZERO,
    Constant,
    Expression,
    ExpressionBuilder,
    find_socket,
    is_constant,
    is_zero,
)
from .specialize_lobes import Lobes
from .specialize_tree import TreeContext, group_output

Report = Callable[[str], None]


class ShaderReader:
    """Reads one material; collects what could only be approximated.

    Attributes:
        effects: a sentence for each approximation, in the order found.
        exact: nodes whose dependence on the view is represented exactly enough not to be
            reported, by their pointers.
    """

    def __init__(self) -> None:
        self.effects: dict[str, None] = {}
        self.exact: set[int] = set()

    def report(self, effect: str) -> None:
        self.effects[effect] = None

    def shader(self, context: TreeContext, socket: Any) -> Lobes:
        """The lobes that a shader input receives; none at all where nothing is linked."""
        source = source_of(socket)
        if source is None:
            return Lobes()
        if source.node.bl_idname == "NodeGroupInput" and context.parent is not None:
            outside = find_socket(context.group_node.inputs, source.identifier)
            return context.fetch(self.shader(context.parent, outside))
        if source.type != "SHADER":
            # Cycles makes an emission of a colour or value that is linked to a shader input.
            return Lobes(emission=context.output(source, 3))
        return self._node(context, source)

    def _node(self, context: TreeContext, source: Any) -> Lobes:
        """The lobes of the node that has this shader output."""
        node = source.node
        if node.bl_idname == "ShaderNodeGroup":
            return self._group(context, node, source.identifier)
        if node.bl_idname == "ShaderNodeMixShader":
            return self._mix(context, node)
        if node.bl_idname == "ShaderNodeAddShader":
            first, second = (self.shader(context, node.inputs[i]) for i in (0, 1))
            return specialize_lobes.add(context.build, first, second, self.report)
        if node.bl_idname in _CLOSURES:
            return _CLOSURES[node.bl_idname](_ClosureInputs(context, node, self.report))
        self.report(f"the {node.bl_label} node '{node.name}' is not understood and shows black")
        return Lobes()

    def _group(self, context: TreeContext, node: Any, identifier: str) -> Lobes:
        if node.node_tree is None:
            return Lobes()
        inside = context.enter(node)
        output = group_output(inside.tree)
        if output is None:
            return Lobes()
        return inside.export(self.shader(inside, find_socket(output.inputs, identifier)))

    def _mix(self, context: TreeContext, node: Any) -> Lobes:
        build = context.build
        f0 = self._fresnel_f0(context, node.inputs[0])
        factor = build.clamp(context.value(node.inputs[0])) if f0 is None else f0
        if is_zero(factor):
            return self.shader(context, node.inputs[1])
        if is_constant(factor, 1.0):
            return self.shader(context, node.inputs[2])
        first, second = (self.shader(context, node.inputs[i]) for i in (1, 2))
        if f0 is None:
            return specialize_lobes.mix(build, first, second, factor, self.report)
        return specialize_lobes.mix_by_fresnel(build, first, second, f0, self.report)

    def _fresnel_f0(self, context: TreeContext, socket: Any) -> Expression | None:
        """F0 of the dielectric whose Fresnel term is the factor; None for another factor."""
        origin = context.origin(socket)
        if origin is None or origin[0] is not context:
            return None
        output = origin[1]
        node, build = output.node, context.build
        if node.bl_idname == "ShaderNodeFresnel":
            ior = build.maximum(context.value(node.inputs["IOR"]), Constant((1e-5,)))
        elif node.bl_idname == "ShaderNodeLayerWeight" and output.identifier == "Fresnel":
            # Cycles' Layer Weight: the IOR is 1 / (1 - blend).
            facing = build.complement(context.value(node.inputs["Blend"]))
            ior = build.divide(ONE, build.maximum(facing, Constant((1e-5,))))
        else:
            return None
        # Cycles keeps 1e-5 as the smallest IOR; the same bound keeps this division defined.
        if len(output.links) == 1:
            self.exact.add(node.as_pointer())
        return f0_from_ior(build, ior)


def f0_from_ior(build: ExpressionBuilder, ior: Expression) -> Expression:
    """((ior - 1) / (ior + 1))^2."""
    root = build.divide(build.subtract(ior, ONE), build.add(ior, ONE))
    return build.multiply(root, root)


class _ClosureInputs:
    """A closure node's inputs, by identifier, each limited as Cycles limits it."""

    def __init__(self, context: TreeContext, node: Any, report: Report) -> None:
        self.context = context
        self.build = context.build
        self.node = node
        self.report = report

    def value(self, identifier: str) -> Expression:
        return self.context.value(find_socket(self.node.inputs, identifier))

    def positive(self, identifier: str) -> Expression:
        return self.build.maximum(self.value(identifier), ZERO)

    def unit(self, identifier: str) -> Expression:
        return self.build.clamp(self.value(identifier))

    def used(self, identifier: str) -> bool:
        """Whether an input is anything else than the constant 0."""
        return not is_zero(self.positive(identifier))

    @property
    def normal(self) -> Expression | None:
        socket = find_socket(self.node.inputs, "Normal")
        return self.context.value(socket) if self.context.is_linked(socket) else None

    def approximate(self, what: str) -> None:
        self.report(f"the {self.node.bl_label} node '{self.node.name}': {what}")


def _principled(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    _report_principled(inputs)
    base = inputs.positive("Base Color")
    metallic = inputs.unit("Metallic")
    transmission = inputs.unit("Transmission Weight")
    not_metal = build.complement(metallic)
    opaque = build.multiply(not_metal, build.complement(transmission))
    tint = inputs.positive("Specular Tint")

    ior_f0 = f0_from_ior(build, build.maximum(inputs.value("IOR"), Constant((1e-5,))))
    level = build.multiply(inputs.positive("Specular IOR Level"), Constant((2.0,)))
    f0 = build.multiply(ior_f0, level)
    # Cycles leaves the lobe out where it has no reflectance at normal incidence.
    f90 = build.greater(f0, 0.0)
    f0_tinted = build.minimum(build.multiply(tint, f0), ONE)
    glass_f0 = build.minimum(build.multiply(tint, ior_f0), ONE)
    glass = build.multiply(not_metal, transmission)

    metal_f0 = build.multiply(build.minimum(base, ONE), metallic)
    dielectric_f0 = build.multiply(f0_tinted, opaque)
    specular_f0 = build.add(build.add(metal_f0, dielectric_f0), build.multiply(glass_f0, glass))
    specular_f90 = build.add(build.add(metallic, build.multiply(f90, opaque)), glass)
    lobes = Lobes(
        diffuse_color=build.multiply(base, opaque),
        layer_f0=build.largest(f0_tinted),
        layer_f90=f90,
        specular_f0=specular_f0,
        specular_f90=build.convert(specular_f90, 3, "VALUE"),
        roughness=inputs.unit("Roughness"),
        emission=_emission(
            build, inputs.value("Emission Color"), inputs.value("Emission Strength")
        ),
        normal=inputs.normal,
    )
    if inputs.used("Coat Weight"):
        lobes = _coated(inputs, lobes)
    alpha = inputs.unit("Alpha")
    lobes = specialize_lobes.scale(build, lobes, alpha)
    return replace(lobes, transparency=build.complement(alpha))


def _report_principled(inputs: _ClosureInputs) -> None:
    for identifier, effect in (
        ("Transmission Weight", "transmitted light is left out, only reflection is shown"),
        ("Subsurface Weight", "subsurface scattering is shown as diffuse"),
        ("Sheen Weight", "sheen is left out"),
        ("Thin Film Thickness", "the thin film is left out"),
        ("Anisotropic", "anisotropic reflection is shown as isotropic"),
        ("Diffuse Roughness", "rough diffuse reflection is shown as Lambertian"),
    ):
        if inputs.used(identifier):
            inputs.approximate(effect)
    if inputs.used("Metallic") and not is_constant(inputs.positive("Specular Tint"), 1.0):
        inputs.approximate("the edge tint of its metal is left out")


def _coated(inputs: _ClosureInputs, base: Lobes) -> Lobes:
    """A clear coat over other lobes; what it reflects it takes from them."""
    build = inputs.build
    inputs.approximate("the coat and what is under it share one roughness and normal")
    weight = inputs.unit("Coat Weight")
    coat_ior = build.maximum(inputs.value("Coat IOR"), ONE)
    f0 = build.multiply(f0_from_ior(build, coat_ior), weight)
    keep_f0, keep_f90 = build.complement(f0), build.complement(weight)
    tint = build.mix(ONE, inputs.positive("Coat Tint"), weight)
    under = replace(
        base,
        diffuse_color=build.multiply(base.diffuse_color, tint),
        layer_f0=build.complement(build.multiply(build.complement(base.layer_f0), keep_f0)),
        layer_f90=build.complement(build.multiply(build.complement(base.layer_f90), keep_f90)),
        specular_f0=build.multiply(build.multiply(base.specular_f0, tint), keep_f0),
        specular_f90=build.multiply(build.multiply(base.specular_f90, tint), keep_f90),
        emission=build.multiply(build.multiply(base.emission, tint), keep_f0),
    )
    coat = Lobes(
        specular_f0=build.convert(f0, 3, "VALUE"),
        specular_f90=build.convert(weight, 3, "VALUE"),
        roughness=inputs.unit("Coat Roughness"),
        normal=base.normal,
    )
    return specialize_lobes.add(build, under, coat, _already_reported)


def _already_reported(effect: str) -> None:
    """A coat's one sentence says all that adding it approximates."""


def _emission(build: ExpressionBuilder, colour: Expression, strength: Expression) -> Expression:
    return build.multiply(colour, strength)


def _emission_node(inputs: _ClosureInputs) -> Lobes:
    return Lobes(emission=_emission(inputs.build, inputs.value("Color"), inputs.value("Strength")))


def _diffuse(inputs: _ClosureInputs) -> Lobes:
    if inputs.used("Roughness"):
        inputs.approximate("rough diffuse reflection is shown as Lambertian")
    return Lobes(diffuse_color=inputs.positive("Color"), normal=inputs.normal)


def _glossy(inputs: _ClosureInputs) -> Lobes:
    if inputs.used("Anisotropy"):
        inputs.approximate("anisotropic reflection is shown as isotropic")
    if inputs.node.distribution not in {"GGX", "MULTI_GGX"}:
        inputs.approximate(f"its {inputs.node.distribution} distribution is shown as GGX")
    colour = inputs.positive("Color")
    return Lobes(
        specular_f0=colour,
        specular_f90=colour,
        roughness=inputs.unit("Roughness"),
        normal=inputs.normal,
    )


def _metallic(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    if inputs.used("Anisotropy"):
        inputs.approximate("anisotropic reflection is shown as isotropic")
    if inputs.used("Thin Film Thickness"):
        inputs.approximate("the thin film is left out")
    if inputs.node.fresnel_type == "F82":
        if not is_constant(inputs.value("Edge Tint"), 1.0):
            inputs.approximate("the edge tint of its metal is left out")
        f0 = build.clamp(inputs.value("Base Color"))
    else:
        # A conductor at normal incidence: ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2).
        n, k = inputs.positive("IOR"), inputs.positive("Extinction")
        square = build.multiply(k, k)
        low, high = build.subtract(n, ONE), build.add(n, ONE)
        f0 = build.divide(
            build.add(build.multiply(low, low), square),
            build.add(build.multiply(high, high), square),
        )
    return Lobes(
        specular_f0=f0,
        specular_f90=Constant((1.0, 1.0, 1.0)),
        roughness=inputs.unit("Roughness"),
        normal=inputs.normal,
    )


def _transparent(inputs: _ClosureInputs) -> Lobes:
    colour = inputs.unit("Color")
    if not is_constant(colour, 1.0):
        inputs.approximate("tinted transparency is shown as clear or opaque")
    return Lobes(transparency=inputs.build.mean(colour))


def _glass(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    inputs.approximate("transmitted light is left out, only reflection is shown")
    ior = build.maximum(inputs.value("IOR"), Constant((1e-5,)))
    colour = inputs.positive("Color")
    return Lobes(
        specular_f0=build.multiply(colour, f0_from_ior(build, ior)),
        specular_f90=colour,
        roughness=inputs.unit("Roughness"),
        normal=inputs.normal,
    )


def _refraction(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("transmitted light is left out, it shows black")
    return Lobes(normal=inputs.normal)


def _subsurface(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("subsurface scattering is shown as diffuse")
    return Lobes(diffuse_color=inputs.unit("Color"), normal=inputs.normal)


def _as_diffuse(what: str, has_normal: bool = True) -> Callable[[_ClosureInputs], Lobes]:
    def read(inputs: _ClosureInputs) -> Lobes:
        inputs.approximate(f"{what} is shown as diffuse")
        return Lobes(
            diffuse_color=inputs.positive("Color"), normal=inputs.normal if has_normal else None
        )

    return read


def _toon(inputs: _ClosureInputs) -> Lobes:
    if inputs.node.component == "DIFFUSE":
        return _as_diffuse("toon shading")(inputs)
    inputs.approximate("toon shading is shown as a GGX reflection of its size")
    colour = inputs.positive("Color")
    return Lobes(
        specular_f0=colour, specular_f90=colour, roughness=inputs.unit("Size"), normal=inputs.normal
    )


def _black(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("it is shown black")
    return Lobes()


def _background(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("a background in a material is shown black, as in Cycles")
    return Lobes()


_CLOSURES: dict[str, Callable[[_ClosureInputs], Lobes]] = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeEmission": _emission_node,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _refraction,
    "ShaderNodeSubsurfaceScattering": _subsurface,
    "ShaderNodeBsdfTranslucent": _as_diffuse("light coming through"),
    "ShaderNodeBsdfSheen": _as_diffuse("sheen"),
    "ShaderNodeBsdfHair": _as_diffuse("hair", has_normal=False),
    "ShaderNodeBsdfHairPrincipled": _as_diffuse("hair", has_normal=False),
    "ShaderNodeBsdfToon": _toon,
    "ShaderNodeHoldout": _black,
    "ShaderNodeBsdfRayPortal": _black,
    "ShaderNodeBackground": _background,
}

# What Cycles shows where there is no material (`default_surface` in its src/scene/shader.cpp): a
# Principled BSDF as it is when new, whose IOR is 1.5.
_DEFAULT_F0 = (0.5 / 2.5) ** 2
DEFAULT_SURFACE = Lobes(
    diffuse_color=Constant((0.8, 0.8, 0.8)),
    layer_f0=Constant((_DEFAULT_F0,)),
    layer_f90=ONE,
    specular_f0=Constant((_DEFAULT_F0,) * 3),
    specular_f90=Constant((1.0, 1.0, 1.0)),
    roughness=Constant((0.5,)),
)
