# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns the shader nodes of Cycles into lobes.

The Principled BSDF follows Blender's manual and Cycles' svm/closure.h: a coat over all else, a
metal lobe with the F82 model's edge tint, a dielectric lobe with F0 from the IOR, scaled by the
specular level and tinted, and a diffuse lobe that the dielectric lobe's albedo takes light from.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ..scene.node_reader import source_of
from ..scene.sheer_reader import CLEAR
from . import specialize_lobes
from .channels import Distribution, ViewCurve
from .specialize_expression import (
    BLACK,
    ONE,
    ZERO,
    Constant,
    Expression,
    ExpressionBuilder,
    Socket,
    find_socket,
    is_constant,
    is_zero,
)
from .specialize_lobes import Lobe, Lobes, Reporter, ViewWeight
from .specialize_tree import TreeContext, group_output


class ShaderReader:
    """Reads one material; collects what could only be approximated.

    Attributes:
        effects: a sentence for each approximation, in the order found.

    Args:
        is_sheer: whether what passes straight through it is shown as it is.
    """

    def __init__(self, *, is_sheer: bool = False) -> None:
        self._is_sheer = is_sheer
        self.effects: dict[str, None] = {}
        self._shaded: set[tuple[int, str]] = set()

    @property
    def shaded(self) -> frozenset[tuple[int, str]]:
        """Mix factors that are shaded at run time: pointer of the node, identifier of the input."""
        return frozenset(self._shaded)

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
            return _CLOSURES[node.bl_idname](
                _ClosureInputs(context, node, self.report, is_sheer=self._is_sheer)
            )
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
        by_view = self._view_curve(context, node.inputs[0])
        if by_view is None:
            factor = build.clamp(context.value(node.inputs[0]))
        else:
            curve, factor, normal = by_view
        # A curve is 0 or 1 at the front only if it is so everywhere, or starts there.
        if is_zero(factor) and by_view is None:
            return self.shader(context, node.inputs[1])
        if is_constant(factor, 1.0):
            return self.shader(context, node.inputs[2])
        first, second = (self.shader(context, node.inputs[i]) for i in (1, 2))
        if by_view is None:
            return specialize_lobes.mix(build, first, second, factor, self.report)
        if any(lobe.normal != normal for lobe in (*first.each, *second.each)):
            curved = source_of(node.inputs[0]).node
            self.report(
                f"the {curved.bl_label} node '{curved.name}' takes the normal of what it mixes, "
                "not its own"
            )
        return specialize_lobes.mix_by_view(build, first, second, curve, factor, self.report)

    def _view_curve(
        self, context: TreeContext, socket: Any
    ) -> tuple[ViewWeight, Expression, Expression | None] | None:
        """The curve of the view that a factor is, its value where a surface is looked at straight
        on, and its normal as a lobe has it; None for another factor."""
        origin = context.origin(socket)
        if origin is None or origin[0] is not context:
            return None
        output = origin[1]
        node, build = output.node, context.build
        if node.bl_idname == "ShaderNodeFresnel":
            # Cycles keeps 1e-5 as the smallest IOR; the same bound keeps this division defined.
            ior = build.maximum(context.value(node.inputs["IOR"]), Constant((1e-5,)))
            if isinstance(ior, Constant) and ior.values[0] < 1.0:
                # It reflects all from an angle on; the curve that is shaded is of an IOR above 1.
                self.report(f"the Fresnel node '{node.name}': its IOR is below 1 and is inverted")
            found = _fresnel_curve(build, ior)
        elif node.bl_idname != "ShaderNodeLayerWeight":
            return None
        elif output.identifier == "Fresnel":
            # Cycles' Layer Weight: the IOR is 1 / (1 - blend).
            facing = build.complement(context.value(node.inputs["Blend"]))
            ior = build.divide(ONE, build.maximum(facing, Constant((1e-5,))))
            found = _fresnel_curve(build, ior)
        else:
            found = _facing_curve(build, context.value(node.inputs["Blend"]))
        self._shaded.add((socket.node.as_pointer(), socket.identifier))
        return *found, context.normal(node.inputs["Normal"])


def _fresnel_curve(build: ExpressionBuilder, ior: Expression) -> tuple[ViewWeight, Expression]:
    f0 = f0_from_ior(build, ior)
    return ViewWeight(curve=Constant((float(ViewCurve.FRESNEL),)), parameter=f0), f0


def _facing_curve(build: ExpressionBuilder, blend: Expression) -> tuple[ViewWeight, Expression]:
    """1 - |NoV|^e; e is 2 blend up to a half, and 1 / (2 - 2 blend) above (Cycles'
    svm_node_layer_weight)."""
    blend = build.minimum(build.maximum(blend, ZERO), Constant((1.0 - 1e-5,)))
    high = build.greater(blend, 0.5)
    below = build.multiply(blend, Constant((2.0,)))
    above = build.divide(Constant((0.5,)), build.complement(blend))
    exponent = build.mix(below, above, high)
    return ViewWeight(curve=Constant((float(ViewCurve.FACING),)), parameter=exponent), ZERO


def f0_from_ior(build: ExpressionBuilder, ior: Expression) -> Expression:
    """((ior - 1) / (ior + 1))^2."""
    root = build.divide(build.subtract(ior, ONE), build.add(ior, ONE))
    return build.multiply(root, root)


class _ClosureInputs:
    """A closure node's inputs, by identifier, each limited as Cycles limits it."""

    def __init__(
        self, context: TreeContext, node: Any, report: Reporter, *, is_sheer: bool = False
    ) -> None:
        self.is_sheer = is_sheer
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
        return self.context.normal(find_socket(self.node.inputs, "Normal"))

    def tangent(self, rotation: str) -> Expression:
        """The direction of anisotropy: the Tangent input turned about the normal by so many
        rounds, where Cycles takes the surface's own tangent for none."""
        tree = self.build.tree
        socket = find_socket(self.node.inputs, "Tangent")
        if self.context.is_linked(socket):
            tangent = self.context.value(socket)
        else:
            tangent = Socket(tree.nodes.new("ShaderNodeNewGeometry"), "Tangent", 3)
        turns = self.value(rotation)
        if is_zero(turns):
            return tangent
        turned = tree.nodes.new("ShaderNodeVectorRotate")
        turned.rotation_type = "AXIS_ANGLE"
        self.build.assign(turned.inputs["Vector"], tangent)
        normal = specialize_lobes.unit_normal(self.build, self.normal)
        self.build.assign(turned.inputs["Axis"], normal)
        angle = self.build.multiply(turns, Constant((2.0 * math.pi,)))
        self.build.assign(turned.inputs["Angle"], angle)
        return Socket(turned, "Vector", 3)

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

    metal_f0 = build.minimum(base, ONE)
    dielectric_f0 = build.multiply(f0_tinted, opaque)
    specular_f0 = build.add(
        build.add(build.multiply(metal_f0, metallic), dielectric_f0),
        build.multiply(glass_f0, glass),
    )
    dip = edge_dip(build, metal_f0, build.minimum(tint, ONE))
    whole: Expression = ONE
    if not is_constant(f90, 1.0):
        whole = build.add(build.add(metallic, build.multiply(f90, opaque)), glass)
    lobe = Lobe(
        diffuse_color=build.multiply(base, opaque),
        diffuse_roughness=inputs.unit("Diffuse Roughness"),
        diffuse_share=opaque,
        layer_f0=build.largest(f0_tinted),
        layer_f90=f90,
        specular_f0=specular_f0,
        specular_f90=whole,
        specular_share=whole,
        dielectric=build.add(opaque, glass),
        specular_dip=build.multiply(dip, metallic),
        roughness=inputs.unit("Roughness"),
        distribution=_PRINCIPLED_DISTRIBUTIONS[inputs.node.distribution],
        normal=inputs.normal,
    )
    if inputs.used("Anisotropic"):
        aspect = _metal_aspect(build, inputs.unit("Anisotropic"))
        tangent = inputs.tangent("Anisotropic Rotation")
        lobe = replace(lobe, aspect=aspect, tangent=tangent)
    emission = _emission(build, inputs.value("Emission Color"), inputs.value("Emission Strength"))
    lobes = Lobes((lobe,), emission)
    if inputs.used("Coat Weight"):
        lobes = _coated(inputs, lobes)
    if inputs.used("Sheen Weight"):
        lobes = _under_sheen(inputs, lobes)
    alpha = inputs.unit("Alpha")
    lobes = specialize_lobes.scale(build, lobes, alpha)
    return replace(lobes, transparency=build.complement(alpha))


def edge_dip(build: ExpressionBuilder, f0: Expression, tint: Expression) -> Expression:
    """The factor of LoH (1 - LoH)^6 that brings Schlick's reflectance at LoH = 1/7 down to `tint`
    times itself (Kutz, Hasan and Edmondson, Novel aspects of the Adobe Standard Material, 2021)."""
    if is_constant(tint, 1.0):
        return BLACK
    return _dip(build, build.multiply(_schlick_at_82(build, f0), build.complement(tint)))


# cos(82 degrees) is about 1/7, where Schlick's weight is (6/7)^5.
_WEIGHT_AT_82 = (6.0 / 7.0) ** 5


def _schlick_at_82(build: ExpressionBuilder, f0: Expression) -> Expression:
    return build.mix(f0, ONE, Constant((_WEIGHT_AT_82,)))


def _dip(build: ExpressionBuilder, lost: Expression) -> Expression:
    """The factor of LoH (1 - LoH)^6 that takes so much from the reflectance at LoH = 1/7."""
    return build.multiply(lost, Constant((7.0 / (_WEIGHT_AT_82 * 6.0 / 7.0),)))


def _distribution(model: Distribution) -> Constant:
    return Constant((float(model),))


_PRINCIPLED_DISTRIBUTIONS = {
    "MULTI_GGX": _distribution(Distribution.MULTI_GGX),
    "GGX": _distribution(Distribution.GGX),
}
_GLOSSY_DISTRIBUTIONS = {
    **_PRINCIPLED_DISTRIBUTIONS,
    "BECKMANN": _distribution(Distribution.BECKMANN),
    "ASHIKHMIN_SHIRLEY": _distribution(Distribution.ASHIKHMIN_SHIRLEY),
}


def _metal_aspect(build: ExpressionBuilder, anisotropy: Expression) -> Expression:
    """Of the Principled and the Metallic BSDF: sqrt(1 - 0.9 a)."""
    rest = build.complement(build.multiply(anisotropy, Constant((0.9,))))
    return build.power(rest, Constant((0.5,)))


def _report_principled(inputs: _ClosureInputs) -> None:
    for identifier, effect in (
        ("Transmission Weight", "transmitted light is left out, only reflection is shown"),
        ("Subsurface Weight", "subsurface scattering is shown as diffuse"),
        ("Thin Film Thickness", "the thin film is left out"),
    ):
        if inputs.used(identifier):
            inputs.approximate(effect)


def _coated(inputs: _ClosureInputs, base: Lobes) -> Lobes:
    """A clear coat over other lobes; what it reflects to the viewer it takes from them."""
    build = inputs.build
    weight = inputs.unit("Coat Weight")
    f0 = f0_from_ior(build, build.maximum(inputs.value("Coat IOR"), ONE))
    roughness = inputs.unit("Coat Roughness")
    tint = inputs.positive("Coat Tint")
    if not is_constant(tint, 1.0):
        inputs.approximate("the tint of its coat is as seen from the front")
        base = specialize_lobes.scale(build, base, build.mix(ONE, tint, weight))
    through = ViewWeight(
        slope=build.multiply(weight, Constant((-1.0,))),
        curve=Constant((float(ViewCurve.COAT),)),
        parameter=f0,
        roughness=roughness,
    )
    front = build.complement(build.multiply(f0, weight))
    under = specialize_lobes.seen_through(build, base, through, front, inputs.report)
    socket = find_socket(inputs.node.inputs, "Coat Normal")
    coat = Lobe(
        specular_f0=build.multiply(f0, weight),
        specular_f90=build.multiply(build.greater(f0, 0.0), weight),
        # All of it is a dielectric, whose curve is Fresnel's.
        layer_f0=f0,
        layer_f90=build.greater(f0, 0.0),
        dielectric=weight,
        roughness=roughness,
        distribution=_distribution(Distribution.GGX),
        # Where nothing is linked, the surface's own: a coat is smooth over a base with bumps.
        normal=inputs.context.normal(socket),
    )
    return specialize_lobes.add(build, under, Lobes.of(coat), inputs.report)


def _under_sheen(inputs: _ClosureInputs, base: Lobes) -> Lobes:
    """A sheen over other lobes; what it reflects to the viewer it takes from them."""
    build = inputs.build
    color = build.multiply(inputs.positive("Sheen Tint"), inputs.positive("Sheen Weight"))
    roughness = inputs.unit("Sheen Roughness")
    most = build.largest(color)
    through = ViewWeight(
        slope=build.multiply(most, Constant((-1.0,))),
        curve=Constant((float(ViewCurve.SHEEN),)),
        roughness=roughness,
    )
    # The table's albedo from the front, to within 0.02.
    albedo = build.multiply(
        build.power(build.maximum(roughness, Constant((1e-3,))), Constant((3.3,))),
        Constant((0.36,)),
    )
    front = build.complement(build.multiply(most, albedo))
    under = specialize_lobes.seen_through(build, base, through, front, inputs.report)
    normal = inputs.normal
    coat_normal = inputs.context.normal(find_socket(inputs.node.inputs, "Coat Normal"))
    if inputs.used("Coat Weight") and coat_normal != normal:
        own, coat = (specialize_lobes.unit_normal(build, each) for each in (normal, coat_normal))
        normal = build.mix(own, coat, inputs.unit("Coat Weight"))
    sheen = Lobe(sheen_color=color, sheen_roughness=roughness, normal=normal)
    return specialize_lobes.add(build, under, Lobes.of(sheen), inputs.report)


def _sheen(inputs: _ClosureInputs) -> Lobes:
    if inputs.node.distribution != "MICROFIBER":
        inputs.approximate("its sheen is shown as that of microfibers")
    lobe = Lobe(
        sheen_color=inputs.positive("Color"),
        sheen_roughness=inputs.unit("Roughness"),
        normal=inputs.normal,
    )
    return Lobes.of(lobe)


def _emission(build: ExpressionBuilder, colour: Expression, strength: Expression) -> Expression:
    return build.multiply(colour, strength)


def _emission_node(inputs: _ClosureInputs) -> Lobes:
    return Lobes(emission=_emission(inputs.build, inputs.value("Color"), inputs.value("Strength")))


def _diffuse(inputs: _ClosureInputs) -> Lobes:
    return Lobes.of(
        Lobe(
            diffuse_color=inputs.positive("Color"),
            diffuse_roughness=inputs.unit("Roughness"),
            normal=inputs.normal,
        )
    )


def _reflecting(
    inputs: _ClosureInputs, f0: Expression, f90: Expression, roughness: str = "Roughness"
) -> Lobe:
    """A microfacet lobe; `roughness` is the input that has it."""
    node = inputs.node
    return Lobe(
        specular_f0=f0,
        specular_f90=f90,
        roughness=inputs.unit(roughness),
        distribution=(
            _GLOSSY_DISTRIBUTIONS[node.distribution] if hasattr(node, "distribution") else ZERO
        ),
        normal=inputs.normal,
    )


def _glossy(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    colour = inputs.positive("Color")
    lobe = _reflecting(inputs, colour, colour)
    if is_zero(inputs.value("Anisotropy")):
        return Lobes.of(lobe)
    # Alpha is divided by 1 + a along the tangent where a < 0, else multiplied with 1 - a.
    anisotropy = build.minimum(inputs.value("Anisotropy"), Constant((0.99,)))
    anisotropy = build.maximum(anisotropy, Constant((-0.99,)))
    below = build.add(ONE, build.minimum(anisotropy, ZERO))
    above = build.divide(ONE, build.complement(build.maximum(anisotropy, ZERO)))
    aspect = build.multiply(below, above)
    tangent = inputs.tangent("Rotation")
    return Lobes.of(replace(lobe, aspect=aspect, tangent=tangent))


def _metallic(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    if inputs.used("Thin Film Thickness"):
        inputs.approximate("the thin film is left out")
    if inputs.node.fresnel_type == "F82":
        f0 = build.clamp(inputs.value("Base Color"))
        dip = edge_dip(build, f0, build.clamp(inputs.value("Edge Tint")))
    else:
        n, k = inputs.positive("IOR"), inputs.positive("Extinction")
        f0, dip = conductor(build, n, k)
    lobe = replace(_reflecting(inputs, f0, ONE), specular_dip=dip)
    if inputs.used("Anisotropy"):
        aspect = _metal_aspect(build, inputs.unit("Anisotropy"))
        lobe = replace(lobe, aspect=aspect, tangent=inputs.tangent("Rotation"))
    return Lobes.of(lobe)


def conductor(
    build: ExpressionBuilder, n: Expression, k: Expression
) -> tuple[Expression, Expression]:
    """F0 = ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2), and the dip with which the F82 model has the
    conductor's reflectance at LoH = 1/7 as well, where it strays most from Schlick's."""
    k_square = build.multiply(k, k)
    low, high = build.subtract(n, ONE), build.add(n, ONE)
    f0 = build.divide(
        build.add(build.multiply(low, low), k_square),
        build.add(build.multiply(high, high), k_square),
    )
    # Born and Wolf, Principles of Optics, 14.4.1, at LoH = 1/7: u + iv = sqrt((n + ik)^2 - sin^2).
    cosine = Constant((1.0 / 7.0,))
    n_square = build.multiply(n, n)
    real = build.subtract(build.subtract(n_square, k_square), Constant((48.0 / 49.0,)))
    imaginary = build.multiply(build.multiply(n, k), Constant((2.0,)))
    size = _root(build, _length_square(build, real, imaginary))
    u = _root(build, build.multiply(build.add(size, real), Constant((0.5,))))
    v = _root(build, build.multiply(build.subtract(size, real), Constant((0.5,))))
    across = build.divide(
        _length_square(build, build.subtract(cosine, u), v),
        _length_square(build, build.add(cosine, u), v),
    )
    p = build.multiply(build.subtract(n_square, k_square), cosine)
    q = build.multiply(imaginary, cosine)
    parallel = build.divide(
        _length_square(build, build.subtract(p, u), build.subtract(q, v)),
        _length_square(build, build.add(p, u), build.add(q, v)),
    )
    at_82 = build.multiply(build.add(parallel, across), Constant((0.5,)))
    return f0, _dip(build, build.subtract(_schlick_at_82(build, f0), at_82))


def _length_square(build: ExpressionBuilder, a: Expression, b: Expression) -> Expression:
    return build.add(build.multiply(a, a), build.multiply(b, b))


def _root(build: ExpressionBuilder, a: Expression) -> Expression:
    return build.power(build.maximum(a, ZERO), Constant((0.5,)))


def _transparent(inputs: _ClosureInputs) -> Lobes:
    colour = inputs.unit("Color")
    if inputs.is_sheer:
        return Lobes(transparency=inputs.build.mean(colour))
    if not isinstance(colour, Constant):
        inputs.approximate("tinted transparency is shown as clear or opaque")
        return Lobes(transparency=inputs.build.mean(colour))
    # As the view has it (scene/cutout_reader.py).
    if max(colour.values) < CLEAR:
        return Lobes()
    if min(colour.values) < 1.0:
        inputs.approximate("tinted transparency is shown as clear")
    return Lobes(transparency=ONE)


def _glass(inputs: _ClosureInputs) -> Lobes:
    build = inputs.build
    inputs.approximate("transmitted light is left out, only reflection is shown")
    ior = build.maximum(inputs.value("IOR"), Constant((1e-5,)))
    colour = inputs.positive("Color")
    f0 = build.multiply(colour, f0_from_ior(build, ior))
    return Lobes.of(_reflecting(inputs, f0, colour))


def _refraction(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("transmitted light is left out, it shows black")
    return Lobes()


def _diffuse_like(inputs: _ClosureInputs, has_normal: bool = True) -> Lobes:
    normal = inputs.normal if has_normal else None
    return Lobes.of(Lobe(diffuse_color=inputs.positive("Color"), normal=normal))


def _subsurface(inputs: _ClosureInputs) -> Lobes:
    inputs.approximate("subsurface scattering is shown as diffuse")
    return _diffuse_like(inputs)


def _translucent(inputs: _ClosureInputs) -> Lobes:
    return Lobes.of(Lobe(translucent_color=inputs.positive("Color"), normal=inputs.normal))


def _as_diffuse(what: str, has_normal: bool = True) -> Callable[[_ClosureInputs], Lobes]:
    def read(inputs: _ClosureInputs) -> Lobes:
        inputs.approximate(f"{what} is shown as diffuse")
        return _diffuse_like(inputs, has_normal)

    return read


def _toon(inputs: _ClosureInputs) -> Lobes:
    if inputs.node.component == "DIFFUSE":
        return _as_diffuse("toon shading")(inputs)
    inputs.approximate("toon shading is shown as a GGX reflection of its size")
    colour = inputs.positive("Color")
    return Lobes.of(_reflecting(inputs, colour, colour, "Size"))


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
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeBsdfSheen": _sheen,
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
DEFAULT_LOBE = Lobe(
    diffuse_color=Constant((0.8, 0.8, 0.8)),
    layer_f0=Constant((_DEFAULT_F0,)),
    layer_f90=ONE,
    specular_f0=Constant((_DEFAULT_F0,)),
    specular_f90=ONE,
    dielectric=ONE,
    roughness=Constant((0.5,)),
)
DEFAULT_SURFACE = Lobes.of(DEFAULT_LOBE)
