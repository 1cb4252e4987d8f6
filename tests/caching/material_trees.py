# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials with what they have to be cached as, baked on a grid of planes by one camera."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from addon.caching.channels import CHANNEL_BY_NAME, LOBE_FIELDS, MAX_LOBES, lobe_channel
from addon.caching.framebuffer import DeepFramebuffer
from addon.caching.plan import ChannelPlan

from .material_grid import HALF, add_plane, bake, camera_above, empty_material, empty_scene
from .plain_cycles import emission_of

# Planes along a side of the grid, each 1 m wide, and texels across a plane.
SIDE, TEXELS = 8, 12

Probes = Mapping[str, NDArray[np.float64]]
# A number or three; or a function of what plain Cycles shows of the tree's probed sockets,
# (n, 3) each, that gives (n, 1 or 3).
Value = Any
Fields = Mapping[str, Value]


@dataclass(frozen=True)
class Tree:
    """A material, and what is to be found in its channels.

    Attributes:
        name: of the material.
        make: given the tree and its output node, fills it; gives the outputs that are probed.
        lobes: of each lobe the fields that are not neutral.
        emission: of the surface.
        effects: a part of each sentence that is reported, in any order.
        hole: whether all of it is cut away.
        prepare: given the plane's object, before the bake.
    """

    name: str
    make: Callable[[Any, Any], Mapping[str, Any] | None]
    lobes: Sequence[Fields] = ()
    emission: Value = 0.0
    effects: Sequence[str] = ()
    hole: bool = False
    prepare: Callable[[Any], None] | None = None


@dataclass(frozen=True)
class BakedTrees:
    """A grid of trees after the bake."""

    trees: Sequence[Tree]
    plan: ChannelPlan
    framebuffer: DeepFramebuffer
    probes: Mapping[str, Probes]

    def values(self, tree: Tree, name: str) -> NDArray[np.float64]:
        """(n, components) of a channel, wherever it lives, in all texels inside of a plane."""
        plan, channels = self.plan, self.framebuffer.channels
        components = CHANNEL_BY_NAME[name].components
        rows, columns = texels_of(self.trees.index(tree))
        constant = plan.constant(name)
        if name in plan.material_constants:
            constant = plan.material_constants[name][plan.material_names.index(tree.name)]
        if constant is not None:
            return np.broadcast_to(np.array(constant, dtype=np.float64), (1, components))
        stored = channels[plan.same.get(name, name)][rows, columns].astype(np.float64)
        return np.broadcast_to(
            stored.reshape(-1, stored.shape[-1]), (stored[..., 0].size, components)
        )

    def expected(self, tree: Tree, value: Value) -> NDArray[np.float64]:
        """(n, 1 or 3), or (1 or 3,) of a constant."""
        found = value(self.probes[tree.name]) if callable(value) else value
        return np.asarray(found, dtype=np.float64)


def texels_of(number: int) -> tuple[slice, slice]:
    """Rows and columns of the texels of a plane that are wholly inside of it."""
    row, column = divmod(number, SIDE)
    return tuple(slice(TEXELS * k + 1, TEXELS * (k + 1) - 1) for k in (row, column))  # type: ignore[return-value]


def bake_trees(trees: Sequence[Tree], folder: Path, frame: int = 1) -> BakedTrees:
    """Bake all of them in a new file, at a frame, and have plain Cycles show their probes."""
    assert len(trees) <= SIDE * SIDE
    scene = empty_scene()
    probed: dict[str, Mapping[str, Any]] = {}
    objects = []
    for number, tree in enumerate(trees):
        row, column = divmod(number, SIDE)
        place = (column + 0.5 * (1 - SIDE), row + 0.5 * (1 - SIDE), 0.0)
        material, surface = empty_material(tree.name)
        plane = add_plane(scene, tree.name, place, material)
        objects.append(plane)
        if tree.prepare is not None:
            tree.prepare(plane)
        sockets = tree.make(material.node_tree, surface.node) or {}
        probed[tree.name] = {
            name: (socket.node.name, socket.identifier) for name, socket in sockets.items()
        }
    scene.frame_set(frame)
    camera = replace(camera_above((0, 0, 0), 0.5 * SIDE), resolution=SIDE * TEXELS)
    # Probes are of texels' centres, and so are the values of drafts.
    store, _ = bake(scene, [camera], folder / "cache", preset="draft")
    probes = _probe(scene, camera, trees, probed, folder)
    return BakedTrees(trees, store.plan, store.read_camera(0), probes)


def _probe(
    scene: Any,
    camera: Any,
    trees: Sequence[Tree],
    probed: Mapping[str, Mapping[str, Any]],
    folder: Path,
) -> dict[str, dict[str, NDArray[np.float64]]]:
    """What sockets give, as plain Cycles shows them where they are all that the surface emits."""
    found: dict[str, dict[str, NDArray[np.float64]]] = {tree.name: {} for tree in trees}
    for turn in range(max(len(sockets) for sockets in probed.values())):
        for tree in trees:
            names = list(probed[tree.name])
            if turn < len(names):
                _show_only(bpy.data.materials[tree.name], *probed[tree.name][names[turn]])
        picture = emission_of(scene, camera, folder)
        for number, tree in enumerate(trees):
            names = list(probed[tree.name])
            if turn < len(names):
                texels = picture[texels_of(number)].reshape(-1, 3)
                found[tree.name][names[turn]] = texels.astype(np.float64)
    return found


def _show_only(material: Any, node: str, identifier: str) -> None:
    tree = material.node_tree
    value = next(s for s in tree.nodes[node].outputs if s.identifier == identifier)
    light = tree.nodes.new("ShaderNodeEmission")
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    tree.links.new(value, light.inputs["Color"])
    tree.links.new(light.outputs[0], output.inputs["Surface"])


def check_tree(baked: BakedTrees, tree: Tree) -> None:
    """Every field of every lobe, and what is said to be approximated."""
    plan = baked.plan
    effects = [a.effect for a in plan.approximations if a.material == tree.name]
    left = list(effects)
    for part in tree.effects:
        match = [effect for effect in left if part in effect]
        assert match, f"nothing says {part!r}: {effects}"
        left.remove(match[0])
    assert not left
    depth = baked.values(tree, "depth")
    assert np.all(depth == 0.0) if tree.hole else np.all(depth > 0.0)
    if tree.hole:
        return
    _check(baked, tree, "emission", tree.emission)
    for lobe in range(1, MAX_LOBES + 1):
        fields = tree.lobes[lobe - 1] if lobe <= len(tree.lobes) else {}
        is_there = lobe <= len(tree.lobes)
        assert not is_there or lobe <= plan.lobes, "it has too few lobes"
        assert set(fields) <= set(LOBE_FIELDS)
        for field in LOBE_FIELDS:
            name = lobe_channel(field, lobe)
            if lobe <= plan.lobes and _has_a_say(fields, field, is_there):
                _check(baked, tree, name, fields.get(field, CHANNEL_BY_NAME[name].neutral))


def _has_a_say(fields: Fields, field: str, is_there: bool) -> bool:
    """Whether a field of such a lobe may be seen in what is shaded, by the table's formula."""
    if CHANNEL_BY_NAME[field].space == "linear Rec.709":
        return True
    specular = "specular_f0" in fields or "specular_f90" in fields
    diffuse = "diffuse_color" in fields
    parts = {
        "diffuse": diffuse,
        "rough diffuse": diffuse and "diffuse_roughness" in fields,
        "layer": diffuse or specular,
        "specular": specular,
        "bounces": specular and "distribution" not in fields,
        "tangent": "aspect" in fields,
        "view": is_there,
    }
    rest = field in fields or (is_there and field == "normal")
    return parts.get(CHANNEL_BY_NAME[field].part, rest)


def _check(baked: BakedTrees, tree: Tree, name: str, value: Value) -> None:
    found, expected = baked.values(tree, name), baked.expected(tree, value)
    # Two roundings to half, of which one may be that of a difference from 1, and for what varies
    # within a texel, how far a filter of a hundredth of it moves a sample.
    tolerance = 4 * HALF * np.maximum(np.abs(expected), 0.05 if callable(value) else 1e-3)
    error = np.abs(found - expected)
    assert np.all(error <= tolerance), (
        f"{tree.name}, {name}: {found.mean(axis=0)} for {np.atleast_2d(expected).mean(axis=0)}, "
        f"at most {error.max():.2g} off"
    )
