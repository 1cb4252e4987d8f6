# SPDX-License-Identifier: GPL-3.0-or-later
"""What a light's controls let through, as shader nodes.

The formulas are those of addon/glsl/lib/*_filter.glsl. A light's shader knows a point of the light
(Geometry, Position), the direction to the place that it lights (Incoming) and the distance to it
(Ray Length); the place itself follows. The light's object space has its scale in it; light space's
axes are made of its columns, as `Light.axes` has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..relight.filters.slide_picture import SlidePicture
from ..scene.light_controls import (
    BarnDoors,
    Blocker,
    DistanceRange,
    Falloff,
    LightControls,
    Noise,
    Slide,
    Superellipse,
)
from .node_math import NodeMath, Number, Scalar, Vector
from .write_back_picture import blender_picture

# Sides of outlines below this are as thin, metres; Blender divides by 0 to 0.
_THINNEST = 1e-12
# Below this roundness an outline is a rectangle to float32's precision.
_SQUAREST = 1e-6


@dataclass(frozen=True)
class _Beam:
    """The place that is lit.

    Attributes:
        centre: the light's, world space.
        lit: the place, world space.
        x, y, z: in light space.
        from_centre: the distance.
    """

    centre: Vector
    lit: Vector
    x: Scalar
    y: Scalar
    z: Scalar
    from_centre: Scalar


def transmission(
    nodes: NodeMath, controls: LightControls, picture: SlidePicture | None = None
) -> Vector:
    """Adds the nodes of all controls that Cycles can show; gives their product.

    Args:
        nodes: where.
        controls: of the light; any of their numbers may be `Scalar`s.
        picture: what its slide lets through, if it has one, made with a scale of 1.
    """
    beam = _beam(nodes)
    product: Vector | Scalar | float = 1.0
    if controls.barn_doors is not None:
        with nodes.framed("Barn Doors"):
            product = _times(product, _barn_doors(nodes, beam, controls.barn_doors))
    if controls.distance is not None:
        with nodes.framed("Near and Far"):
            product = _times(product, _distance(nodes, beam, controls.distance))
    if controls.falloff is not None:
        with nodes.framed("Falloff"):
            product = _times(product, _falloff(nodes, beam, controls.falloff))
    if controls.slide is not None and picture is not None:
        with nodes.framed("Slide"):
            product = _times(product, _slide(nodes, beam, controls.slide, picture))
    if controls.noise is not None:
        with nodes.framed("Noise"):
            product = _times(product, _noise(nodes, beam, controls.noise))
    for blocker in controls.blockers:
        with nodes.framed(f"Blocker {blocker.name}"):
            product = _times(product, _blocker(nodes, beam, blocker))
    if isinstance(product, Vector):
        return product
    return nodes.combined(product, product, product)


def _times(product: Vector | Scalar | float, factor: Vector | Scalar) -> Vector | Scalar:
    if not isinstance(product, Scalar | Vector):
        return factor
    if isinstance(factor, Vector):
        return product * factor if isinstance(product, Vector) else factor.scaled(product)
    return product.scaled(factor) if isinstance(product, Vector) else product * factor


def _beam(nodes: NodeMath) -> _Beam:
    with nodes.framed("Light Space"):
        geometry = nodes.node("ShaderNodeNewGeometry")
        path = nodes.node("ShaderNodeLightPath")
        to_lit = nodes.vector(geometry, "Incoming").scaled(nodes.scalar(path, "Ray Length"))
        lit = nodes.vector(geometry, "Position") + to_lit
        centre = _to_world(nodes, "POINT", (0.0, 0.0, 0.0))
        back = _to_world(nodes, "VECTOR", (0.0, 0.0, 1.0)).normalized()
        right = _to_world(nodes, "VECTOR", (0.0, 1.0, 0.0)).cross(back).normalized()
        from_centre = lit - centre
        return _Beam(
            centre,
            lit,
            from_centre.dot(right),
            from_centre.dot(back.cross(right)),
            from_centre.dot(back),
            from_centre.length(),
        )


def _to_world(nodes: NodeMath, kind: str, vector: tuple[float, float, float]) -> Vector:
    node: Any = nodes.node(
        "ShaderNodeVectorTransform", vector_type=kind, convert_from="OBJECT", convert_to="WORLD"
    )
    node.inputs[0].default_value = vector
    return nodes.vector(node, "Vector")


def _barn_doors(nodes: NodeMath, beam: _Beam, doors: BarnDoors) -> Scalar:
    ahead = -beam.z
    x, y = beam.x / ahead - doors.shear[0], beam.y / ahead - doors.shear[1]
    x, y = _turned_back(nodes, x, y, doors.rotation)
    covered = _covered(nodes, x, y, doors.outline) * (ahead > 0.0)
    taken = covered if doors.invert else 1.0 - covered
    return 1.0 - taken * doors.density


def _turned_back(nodes: NodeMath, x: Scalar, y: Scalar, angle: Number) -> tuple[Scalar, Scalar]:
    """Clockwise."""
    if angle == 0.0:
        return x, y
    cosine, sine = nodes.cosine_and_sine(angle)
    return x * cosine + y * sine, y * cosine - x * sine


def _covered(nodes: NodeMath, x: Scalar, y: Scalar, shape: Superellipse) -> Scalar:
    """1 within an outline, 0 beyond its edge."""
    outer_sides = (shape.width + shape.width_edge, shape.height + shape.height_edge)
    inner = _outline(nodes, (x, y), (shape.width, shape.height), shape.roundness)
    if outer_sides == (shape.width, shape.height):
        return 1.0 - (inner > 1.0)
    outer = _outline(nodes, (x, y), outer_sides, shape.roundness)
    # Where the ray from the centre through the point crosses the outlines, if the point is at 1.
    return 1.0 - nodes.smoothstep(1.0 / inner, 1.0 / outer, 1.0)


def _outline(
    nodes: NodeMath, p: tuple[Scalar, Scalar], sides: tuple[Number, Number], roundness: Number
) -> Scalar:
    """How large the outline of this shape through a point is, 1 being its own size."""
    u, v = (abs(part) / _at_least(nodes, side) for part, side in zip(p, sides, strict=True))
    larger, smaller = nodes.maximum(u, v), nodes.minimum(u, v)
    if not isinstance(roundness, Scalar) and roundness <= _SQUAREST:
        return larger
    # With the larger in front no power leaves what float32 holds.
    exponent = 2.0 / roundness
    return larger * (1.0 + (smaller / larger) ** exponent) ** (1.0 / exponent)


def _at_least(nodes: NodeMath, side: Number) -> Number:
    if isinstance(side, Scalar):
        return nodes.maximum(side, _THINNEST)
    return max(side, _THINNEST)


def _distance(nodes: NodeMath, beam: _Beam, span: DistanceRange) -> Scalar:
    distance = -beam.z if span.along_axis else beam.from_centre
    near = _step(nodes, span.near - span.near_edge, span.near, distance)
    if span.far == float("inf"):
        return near
    far = 1.0 - _step(nodes, span.far, span.far + span.far_edge, distance)
    # Without a near end there is light behind the lamp too.
    return far if span.near == 0.0 and span.near_edge == 0.0 else near * far


def _step(nodes: NodeMath, low: Number, high: Number, value: Scalar) -> Scalar:
    if isinstance(low, Scalar) or isinstance(high, Scalar) or high > low:
        return nodes.smoothstep(low, high, value)
    return 1.0 - (value < high)


def _falloff(nodes: NodeMath, beam: _Beam, falloff: Falloff) -> Scalar:
    power = (beam.from_centre / falloff.distance) ** (2.0 - falloff.exponent)
    return nodes.minimum(nodes.maximum(power, 2.0**-80), 2.0**80)


def _slide(nodes: NodeMath, beam: _Beam, slide: Slide, picture: SlidePicture) -> Vector:
    ahead = -beam.z
    x, y = beam.x / ahead - slide.offset[0], beam.y / ahead - slide.offset[1]
    x, y = _turned_back(nodes, x, y, slide.rotation)
    u = x / (slide.scale[0] * picture.scale[0]) + 0.5
    v = y / (slide.scale[1] * picture.scale[1]) + 0.5
    node = nodes.node(
        "ShaderNodeTexImage",
        image=blender_picture(picture.pixels, slide.image),
        interpolation="Linear",
        extension="REPEAT" if slide.repeat else "EXTEND",
    )
    nodes.feed(node.inputs["Vector"], nodes.combined(u, v, 0.0))
    color = nodes.vector(node, "Color")
    if not slide.repeat:
        beside = nodes.maximum(abs(u - 0.5), abs(v - 0.5)) > 0.5
        color = _either(color, picture.outside, beside)
    return _either(color, picture.behind, 1.0 - (ahead > 0.0))


def _either(color: Vector, other: float, chosen: Scalar) -> Vector:
    """The other, a grey, where `chosen` is 1; the colour where it is 0."""
    grey = (other, other, other)
    return (color - grey).scaled(1.0 - chosen) + grey


def _noise(nodes: NodeMath, beam: _Beam, noise: Noise) -> Scalar:
    node = nodes.node("ShaderNodeTexNoise", noise_dimensions="3D", noise_type="FBM", normalize=True)
    place = nodes.combined(beam.x, beam.y, beam.z)
    scale = noise.scale / beam.from_centre if noise.projected else noise.scale
    offset = nodes.combined(*noise.offset)
    nodes.feed(node.inputs["Vector"], place.scaled(scale) + offset)
    values = {
        "Scale": 1.0,
        "Detail": noise.detail,
        "Roughness": noise.roughness,
        "Lacunarity": 2.0,
        "Distortion": 0.0,
    }
    for name, value in values.items():
        nodes.feed(node.inputs[name], value)
    fac = nodes.scalar(node, "Factor")
    return nodes.maximum((2.0 * fac - 1.0) * noise.amount + 1.0, 0.0)


def _blocker(nodes: NodeMath, beam: _Beam, blocker: Blocker) -> Vector | Scalar:
    """Where the ray from the light's centre crosses the card; the nodes follow its object."""
    import bpy

    obj = bpy.data.objects[blocker.name]
    x_axis, y_axis, centre = (
        nodes.combined(*(nodes.driven(obj, f"matrix_world[{column}][{row}]") for row in range(3)))
        for column in (0, 1, 3)
    )
    normal = x_axis.cross(y_axis)
    ray = beam.lit - beam.centre
    along = (centre - beam.centre).dot(normal) / ray.dot(normal)
    on_card = beam.centre + ray.scaled(along) - centre
    across_x, across_y = y_axis.cross(normal), normal.cross(x_axis)
    x = on_card.dot(across_x) / x_axis.dot(across_x)
    y = on_card.dot(across_y) / y_axis.dot(across_y)
    covered = _covered(nodes, x, y, blocker.outline)
    if blocker.invert:
        covered = 1.0 - covered
    taken = covered * (along > 0.0) * (along < 1.0) * blocker.density
    red, green, blue = blocker.color
    if red == green == blue:
        return 1.0 - taken * (1.0 - red)
    return nodes.combined(
        1.0 - taken * (1.0 - red), 1.0 - taken * (1.0 - green), 1.0 - taken * (1.0 - blue)
    )
