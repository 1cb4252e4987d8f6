# SPDX-License-Identifier: GPL-3.0-or-later
"""Splits a scene's materials into what is cached and what is shaded.

For each material, a copy is made whose lobes (see `channels`) are read into expressions. What
varies over a material (see `material_plan`) is written into AOVs of the copies, which the bake
renders in the materials' place (Ragan-Kelley et al. 2007, section 3, does the same with RenderMan
shaders).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import bpy

from ..scene.cutout_reader import is_only_volume, is_sheer
from .channels import CHANNEL_BY_NAME, Channel
from .material_model import MODEL_NAMES, material_model, remodelled
from .material_plan import expression_of_surface, plan_channels
from .plan import ChannelPlan
from .specialize_closures import DEFAULT_SURFACE, ShaderReader
from .specialize_expression import (
    ONE,
    ZERO,
    Constant,
    Expression,
    ExpressionBuilder,
    Socket,
    is_zero,
)
from .specialize_lobes import Lobe, Lobes, Reporter, expression_of, scale, unit_normal
from .specialize_tree import TreeContext
from .view_dependence import view_dependent_effects

# AOVs are named after their channels behind this.
AOV_PREFIX = "relume_"

# Opaque at or above this share (the same rule as for rasterized triangles).
CUT_OUT_AT = 0.5

# The node of a sheer material's copy that says how many layers are left out.
_LEFT_OUT_NODE = "relume_left_out"

# Rays of Cycles' Ambient Occlusion node reach through any scene.
_EVERYWHERE = 1e30


@dataclass(frozen=True)
class SpecializedMaterial:
    """A material, its instrumented copy, and what the copy computes.

    Attributes:
        name: the material's name.
        original: the material; None for surfaces without one.
        copy: what takes its place in the bake.
        context: the copy's node tree.
        lobes: its channels as expressions in that tree.
        effects: a sentence for each approximation.
        is_sheer: whether it is shown as a layer before what lies behind it. Its lobes are then
            those of the whole surface, of which so much is opaque.
    """

    name: str
    original: Any
    copy: Any
    context: TreeContext | None
    lobes: Lobes
    effects: tuple[str, ...]
    is_sheer: bool = False

    @property
    def is_cut_out(self) -> bool:
        """Whether light passes through it anywhere."""
        return not is_zero(self.lobes.transparency)

    def leave_out(self, layers: int) -> None:
        """Of a sheer material: show it to cameras only where they look through so many others."""
        if self.is_sheer and self.copy is not None:
            node = self.copy.node_tree.nodes[_LEFT_OUT_NODE]
            node.outputs[0].default_value = float(layers)


@contextmanager
def specialized(
    material_names: Sequence[str], ambient_samples: int
) -> Iterator[tuple[ChannelPlan, tuple[SpecializedMaterial, ...]]]:
    """Instrumented copies of materials, in place of the materials while the block runs.

    Args:
        material_names: `SceneGeometry.material_names`.
        ambient_samples: rays of the ambient occlusion channel; 0 leaves the channel out.

    Afterwards every user has its own material again, and the copies are gone.
    """
    trees: list[Any] = []
    materials: list[SpecializedMaterial] = []
    swapped: list[SpecializedMaterial] = []
    try:
        materials.extend(_specialize(name, trees) for name in material_names)
        plan = plan_channels(
            [material.name for material in materials],
            [material.lobes for material in materials],
            [material.effects for material in materials],
            has_ambient=ambient_samples > 0,
            bent=[number for number, m in enumerate(materials) if _has_bump(m.copy)],
        )
        # The Ambient Occlusion node takes cut-outs for solid: there a sky's light is measured.
        in_sky = needs_sky(plan, materials)
        for number, material in enumerate(materials, start=1):
            _instrument(material, number, plan, 0 if in_sky else ambient_samples)
        for material in materials:
            if material.original is not None:
                swapped.append(material)
                material.original.user_remap(material.copy)
        yield plan, tuple(materials)
    finally:
        for material in swapped:
            material.copy.user_remap(material.original)
        for material in materials:
            if material.copy is not None:
                bpy.data.materials.remove(material.copy)
        for tree in trees:
            if tree.users == 0:
                bpy.data.node_groups.remove(tree)


def needs_sky(plan: ChannelPlan, materials: Sequence[SpecializedMaterial]) -> bool:
    """Whether ambient occlusion is not an AOV but the light of a white sky."""
    return "ambient_occlusion" in plan.stored and any(m.is_cut_out for m in materials)


def _specialize(name: str, trees: list[Any]) -> SpecializedMaterial:
    original = next((m for m in bpy.data.materials if m.name_full == name), None)
    if original is None:
        return SpecializedMaterial(name, None, None, None, DEFAULT_SURFACE, ())
    copy = original.copy()
    copy.use_fake_user = False
    # The surfaces that are rasterized are not displaced.
    copy.displacement_method = "BUMP"
    tree = copy.node_tree
    if tree is None:
        colour = Constant(tuple(float(x) for x in original.diffuse_color[:3]))
        lobes = Lobes.of(Lobe(diffuse_color=colour))
        return SpecializedMaterial(name, original, copy, None, lobes, ())
    sheer = is_sheer(original)
    reader = ShaderReader(is_sheer=sheer)
    context = TreeContext(tree, trees)
    output = _active_output(tree)
    lobes = Lobes() if output is None else reader.shader(context, output.inputs["Surface"])
    if output is not None and is_only_volume(output):
        lobes = Lobes(transparency=ONE)
        reader.report("it is a volume without a surface, and is not shown")
    elif output is not None and output.inputs["Volume"].is_linked:
        reader.report("its volume is left out")
    if _is_displaced(original, output):
        reader.report("its displacement is shown as bump")
    if not sheer:
        _report_soft(lobes.transparency, reader.report)
        lobes = _unpremultiplied(context, lobes)
    model, limb = material_model(original)
    if model != MODEL_NAMES[0]:
        lobes = remodelled(lobes, model, limb)
        reader.report(f"its reflection model is {model}, which Cycles' own render does not show")
    for effect in view_dependent_effects(output, reader.shaded):
        reader.report(effect)
    return SpecializedMaterial(
        name, original, copy, context, lobes, tuple(reader.effects), is_sheer=sheer
    )


def _has_bump(material: Any) -> bool:
    """Whether a material's output bends the surface's own normal."""
    if material is None or material.node_tree is None:
        return False
    output = _active_output(material.node_tree)
    return output is not None and output.inputs["Displacement"].is_linked


def _is_displaced(material: Any, output: Any) -> bool:
    return (
        output is not None
        and output.inputs["Displacement"].is_linked
        and material.displacement_method != "BUMP"
    )


def _report_soft(transparency: Expression, report: Reporter) -> None:
    """Say of a surface that is half transparent all over that it will be there or not."""
    if isinstance(transparency, Constant) and 0.0 < transparency.values[0] < 1.0:
        opacity = 1.0 - transparency.values[0]
        shown = "opaque" if opacity >= CUT_OUT_AT else "cut away"
        report(f"it is {100.0 * opacity:.0f} % opaque, and is shown {shown}")


def _unpremultiplied(context: TreeContext, lobes: Lobes) -> Lobes:
    """What the opaque part of a partly transparent surface looks like by itself."""
    if is_zero(lobes.transparency):
        return lobes
    build = context.build
    whole = build.divide(ONE, build.complement(lobes.transparency))
    return replace(scale(build, lobes, whole), transparency=lobes.transparency)


def _active_output(tree: Any) -> Any:
    """The output that Cycles renders."""
    return tree.get_output_node("CYCLES") or tree.get_output_node("ALL")


def channel_expression(lobes: Lobes, channel: Channel) -> Expression:
    """What a material writes into a channel; neutral where it has no such lobe."""
    neutral = Constant(channel.neutral)
    if not channel.lobe:
        return expression_of_surface(lobes, channel)
    if channel.lobe > len(lobes.each):
        return neutral
    return expression_of(lobes.each[channel.lobe - 1], channel.field) or neutral


def _instrument(
    material: SpecializedMaterial, number: int, plan: ChannelPlan, ambient_samples: int
) -> None:
    """Write the stored channels into AOVs, and make the surface a plain cut-out.

    Without `ambient_samples` the surface is one that a white sky can light instead.

    A hard cut-out keeps the bake in step with the rasterized view. AOVs are multiplied by it:
    with `pass_alpha_threshold` above zero Cycles adds the AOVs of all surfaces up to the first
    that is opaque, so those that are cut away must add nothing.
    """
    if material.copy is None:
        return
    context = material.context
    if context is None:
        context = TreeContext(material.copy.node_tree, [])
    build = context.build
    tree = context.tree
    opacity = _camera_opacity(context, material)
    normal = _lobe_normal(build, material.lobes, 1)
    for name in plan.stored:
        if name == "depth" or (name == "ambient_occlusion" and not ambient_samples):
            continue
        channel = CHANNEL_BY_NAME[name]
        expression: Expression
        if name == "material_id":
            expression = Constant((float(number),))
        elif name == "ambient_occlusion":
            expression = _ambient_occlusion(context, normal, ambient_samples)
        elif channel.field == "normal":
            expression = _lobe_normal(build, material.lobes, channel.lobe)
        else:
            expression = channel_expression(material.lobes, channel)
            expression = build.normalize(expression) if channel.is_direction else expression
        components = plan.components(name)
        aov = tree.nodes.new("ShaderNodeOutputAOV")
        aov.aov_name = AOV_PREFIX + name
        socket = aov.inputs["Value" if components == 1 else "Color"]
        if components == 1 and isinstance(expression, Constant):
            expression = Constant(expression.values[:1])
        value = build.convert(expression, components, "VALUE")
        build.assign(socket, build.multiply(value, opacity))
    if "ambient_occlusion" in plan.stored and not ambient_samples:
        alpha = build.complement(material.lobes.transparency)
        _make_sky_lit(context, opacity, alpha, normal)
    else:
        _make_cut_out(context, opacity)


def _camera_opacity(context: TreeContext, material: SpecializedMaterial) -> Expression:
    """1 where cameras see a surface, else 0; of a sheer one where their rays have passed through
    as many surfaces as are left out."""
    build, nodes = context.build, context.tree.nodes
    if not material.is_sheer:
        return build.at_least(build.complement(material.lobes.transparency), CUT_OUT_AT)
    passed = Socket(nodes.new("ShaderNodeLightPath"), "Transparent Depth", 1)
    left_out = nodes.new("ShaderNodeValue")
    left_out.name = _LEFT_OUT_NODE
    left_out.outputs[0].default_value = 0.0
    beyond = build.subtract(passed, Socket(left_out, "Value", 1))
    return build.at_least(build.add(beyond, ONE), 0.5)


def _lobe_normal(build: ExpressionBuilder, lobes: Lobes, number: int) -> Expression:
    """The unit normal of a lobe. What has fewer lobes reads none of the others: any serves."""
    if not lobes.each:
        return unit_normal(build, None)
    return unit_normal(build, lobes.each[min(number, len(lobes.each)) - 1].normal)


def _ambient_occlusion(context: TreeContext, normal: Expression, samples: int) -> Expression:
    node = context.tree.nodes.new("ShaderNodeAmbientOcclusion")
    node.samples = samples
    node.inputs["Distance"].default_value = _EVERYWHERE
    context.build.assign(node.inputs["Normal"], normal)
    return Socket(node, "AO", 1)


def _make_cut_out(context: TreeContext, opacity: Expression) -> None:
    """Surface: nothing that reflects, so that Cycles looks for no light; displacement stays."""
    # Not an emission of strength 0: Cycles drops that, and the surface with it.
    _make_surface(context, context.tree.nodes.new("ShaderNodeBsdfDiffuse"), ZERO, opacity)


def _make_sky_lit(
    context: TreeContext, opacity: Expression, alpha: Expression, normal: Expression
) -> None:
    """Surface: white to cameras, where it is not cut away; to the rays that leave from there
    black, and as transparent as it is."""
    is_camera = Socket(context.tree.nodes.new("ShaderNodeLightPath"), "Is Camera Ray", 1)
    diffuse = context.tree.nodes.new("ShaderNodeBsdfDiffuse")
    context.build.assign(diffuse.inputs["Normal"], normal)
    opaque = context.build.mix(alpha, opacity, is_camera)
    _make_surface(context, diffuse, is_camera, opaque)


def _make_surface(
    context: TreeContext, diffuse: Any, grey: Expression, opacity: Expression
) -> None:
    """Make the material's surface a diffuse one, as white as `grey` and with this opacity."""
    tree, build = context.tree, context.build
    output = _active_output(tree)
    if output is None:
        output = tree.nodes.new("ShaderNodeOutputMaterial")
    for link in list(output.inputs["Volume"].links):
        tree.links.remove(link)
    build.assign(diffuse.inputs["Color"], build.convert(grey, 3, "VALUE"))
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    blend = tree.nodes.new("ShaderNodeMixShader")
    build.assign(blend.inputs[0], opacity)
    tree.links.new(clear.outputs[0], blend.inputs[1])
    tree.links.new(diffuse.outputs[0], blend.inputs[2])
    tree.links.new(blend.outputs[0], output.inputs["Surface"])
