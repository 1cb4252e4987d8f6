# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds values in node trees that change with the viewer's place.

A value cached from a caching camera is wrong for every other view where it depends on the
view. The walk goes from what Cycles renders to what feeds it, output by output, so that what is
linked to nothing, muted, or behind an output that nobody reads is not taken for it. Factors that
the lobes have as a curve of the view are shaded at run time; all else is named.

What depends on the side that is seen (Geometry's Normal and Backfacing, a Bump node) does not
depend on the viewer otherwise, and a cached texel is of one side.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from typing import Any

from ..scene.node_reader import constant_value, source_of
from .specialize_expression import find_socket
from .specialize_tree import group_output

# An input of a node, by the node's pointer and the input's identifier.
Sink = tuple[int, str]

_ALL = "all"

# Objects that may move after the bake.
_MOVABLE = {"CAMERA", "LIGHT"}


def _vector_transform(node: Any, _: str) -> bool:
    spaces = {node.convert_from, node.convert_to}
    return "CAMERA" in spaces and len(spaces) == 2


def _texture_coordinate(node: Any, output: str) -> bool:
    if output == "Object":
        return _is_movable(node.object)
    return output in {"Camera", "Window", "Reflection"}


def _is_movable(obj: Any) -> bool:
    while obj is not None:
        if obj.type in _MOVABLE:
            return True
        obj = obj.parent
    return False


def _light_falloff(node: Any, output: str) -> bool:
    """On a surface the ray that it measures is the camera's."""
    return output != "Quadratic" or constant_value(node.inputs["Smooth"]) != 0.0


def _outputs(*names: str) -> Callable[[Any, str], bool]:
    return lambda _, output: _ALL in names or output in names


# Node type -> whether this output of it depends on the view (Cycles' src/kernel/svm). A Light
# Path node's other outputs tell the kinds of ray apart: caching cameras and the view's camera
# agree on those. What a script does is not known.
_VIEW_DEPENDENT: dict[str, Callable[[Any, str], bool]] = {
    "ShaderNodeFresnel": _outputs(_ALL),
    "ShaderNodeLayerWeight": _outputs(_ALL),
    "ShaderNodeCameraData": _outputs(_ALL),
    "ShaderNodeLightPath": _outputs("Ray Length", "Transparent Depth"),
    "ShaderNodeNewGeometry": _outputs("Incoming"),
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeVectorTransform": _vector_transform,
    "ShaderNodeWireframe": lambda node, _: node.use_pixel_size,
    "ShaderNodeLightFalloff": _light_falloff,
    "ShaderNodeScript": _outputs(_ALL),
}


def view_dependent_effects(output: Any, shaded: Collection[Sink]) -> Iterator[str]:
    """A sentence for each node in use, groups included, whose value is frozen by the cache.

    Args:
        output: the Material Output node that Cycles renders, or None.
        shaded: inputs whose value is a curve of the view that is shaded at run time.
    """
    if output is None:
        return
    walk = _Walk(shaded)
    for name in ("Surface", "Displacement"):
        walk.follow((), output.inputs[name])
    for node, names in walk.found:
        script = node.bl_idname == "ShaderNodeScript"
        yield (
            f"the {node.bl_label} node '{node.name}' {'may depend' if script else 'depends'} on "
            f"the view ({', '.join(names)}); its value is kept as the caching camera saw it"
        )


class _Walk:
    """What was found so far: nodes, and the names of their outputs that are frozen."""

    def __init__(self, shaded: Collection[Sink]) -> None:
        self._shaded = shaded
        self._found: dict[int, tuple[Any, dict[str, None]]] = {}
        # Outputs that were visited, in which groups.
        self._seen: set[tuple[tuple[int, ...], int, str]] = set()

    @property
    def found(self) -> list[tuple[Any, list[str]]]:
        """In the order in which they were found."""
        return [(node, list(names)) for node, names in self._found.values()]

    def follow(self, groups: tuple[Any, ...], start: Any) -> None:
        """Go through all that an input, within groups from the outermost, depends on."""
        pending = [(groups, start)]
        while pending:
            inside, sink = pending.pop()
            source = source_of(sink)
            if source is None:
                continue
            if (sink.node.as_pointer(), sink.identifier) not in self._shaded:
                self._note(source)
            key = (*(group.as_pointer() for group in inside),)
            visited = (key, source.node.as_pointer(), source.identifier)
            if visited not in self._seen:
                self._seen.add(visited)
                # The last one is looked at first: this keeps the order of the inputs.
                pending.extend(reversed(list(_feeding(inside, source))))

    def _note(self, source: Any) -> None:
        node = source.node
        depends = _VIEW_DEPENDENT.get(node.bl_idname)
        if depends is not None and depends(node, source.name):
            _, names = self._found.setdefault(node.as_pointer(), (node, {}))
            names[source.name] = None


def _feeding(groups: tuple[Any, ...], source: Any) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """The inputs that an output depends on, each with the groups that it is in."""
    node = source.node
    if node.bl_idname == "NodeGroupInput":
        if groups:
            yield groups[:-1], find_socket(groups[-1].inputs, source.identifier)
    elif hasattr(node, "node_tree"):
        end = group_output(node.node_tree) if node.node_tree is not None else None
        if end is not None:
            yield (*groups, node), find_socket(end.inputs, source.identifier)
    else:
        yield from ((groups, socket) for socket in _read_inputs(node))


def _read_inputs(node: Any) -> Iterator[Any]:
    """The inputs that a node reads: of a mix that is all of one shader, only that one's."""
    unread = -1
    if node.bl_idname == "ShaderNodeMixShader":
        factor = constant_value(node.inputs[0])
        if factor is not None and not 0.0 < factor < 1.0:
            unread = 2 if factor <= 0.0 else 1
    for index, socket in enumerate(node.inputs):
        if index != unread and socket.enabled and not socket.is_unavailable:
            yield socket
