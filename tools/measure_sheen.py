# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures Cycles' sheen, and writes the table that Relume shades it with.

    python -m tools.measure_sheen [addon/relight/shading/sheen_table.npy]

The microfiber sheen of Cycles is a linearly transformed cosine (Zeltner, Burley and Chiang,
Practical Multiple-Scattering Sheen Using Linearly Transformed Cosines, 2022): with the view in the
plane of x and z, it sends to the viewer, of light from (x, y, z),

    R z / pi (a / l)^2,    l = (a x + b z)^2 + (a y)^2 + z^2

R, a and b depend on the view's cosine and the roughness. A plane of 32 roughnesses is rendered from
32 angles under a sun without extent in four places; three equations give the three numbers.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

NODES = 32
TABLE = Path("addon/relight/shading/sheen_table.npy")

# The first node is the view along the surface, from which no picture can be taken. Cycles mixes
# its table's nodes, so halfway to the second one it shows their mean.
_GRAZING = 0.5 / (NODES - 1)

_BLACK = (0.0, 1.0, 0.0)

# Blender's smallest pictures.
_ROWS = 4

# Of the suns beside the one overhead: away from it in x, -x and y.
_SINE, _COSINE = math.sin(0.7), math.cos(0.7)
_SUNS = (
    (0.0, 0.0, 1.0),
    (0.0, _SINE, _COSINE),
    (_SINE, 0.0, _COSINE),
    (-_SINE, 0.0, _COSINE),
)


def measure(folder: Path) -> NDArray[np.float64]:
    """(NODES, NODES, 3): R, a and b by roughness and the view's cosine.

    R is 0 where Cycles leaves the sheen out, below 1e-5.
    """
    scene = _scene()
    table = np.zeros((NODES, NODES, 3))
    for column, cosine in enumerate(np.linspace(0.0, 1.0, NODES)):
        _look(scene, max(float(cosine), _GRAZING))
        seen = []
        for sun in _SUNS:
            _shine(scene, sun)
            seen.append(_row(scene, folder / "sheen.exr"))
        is_black = np.min(seen, axis=0) <= 0.0
        table[:, column] = np.where(is_black[:, None], _BLACK, solve(*seen))
        print(f"cosine {cosine:.3f}", file=sys.stderr, flush=True)
    table[:, 0] = 2.0 * table[:, 0] - table[:, 1]
    table[..., 0] = np.maximum(table[..., 0], 0.0)
    # The first row is black; for what lies between it and the second, that one's shape serves.
    table[0, :, 1:] = table[1, :, 1:]
    return table


def solve(
    above: NDArray[np.float64],
    across: NDArray[np.float64],
    along: NDArray[np.float64],
    against: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(N, 3) R, a and b of (N,) radiances under the four suns of irradiance 1.

    With K = a sqrt(R), each gives s K = l for s = sqrt(z / (pi radiance)): s0 K = b^2 + 1; from the
    sun across, a^2 = alpha K; from those along x, a b = beta K; so alpha (s0 K - 1) = beta^2 K.
    """
    s = [
        np.sqrt(z / (math.pi * np.maximum(radiance, 1e-30)))
        for z, radiance in ((1.0, above), (_COSINE, across), (_COSINE, along), (_COSINE, against))
    ]
    alpha = (s[1] - _COSINE**2 * s[0]) / _SINE**2
    beta = (s[2] - s[3]) / (4.0 * _SINE * _COSINE)
    K = alpha / (alpha * s[0] - beta**2)
    a = np.sqrt(alpha * K)
    return np.stack([(K / a) ** 2, a, beta * K / a], axis=-1)


def _scene() -> Any:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene: Any = bpy.context.scene
    mesh = bpy.data.meshes.new("plane")
    # Long, so that it fills a picture that is taken along it.
    x, y = 4.0 / _GRAZING, float(NODES)
    mesh.from_pydata([(-x, 0, 0), (x, 0, 0), (x, y, 0), (-x, y, 0)], [], [(0, 1, 2, 3)])
    material: Any = bpy.data.materials.new("sheen")
    mesh.materials.append(material)
    tree = material.node_tree
    tree.nodes.clear()
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], split.inputs[0])
    floor, share = (tree.nodes.new("ShaderNodeMath") for _ in range(2))
    floor.operation, share.operation = "FLOOR", "DIVIDE"
    tree.links.new(split.outputs["Y"], floor.inputs[0])
    tree.links.new(floor.outputs[0], share.inputs[0])
    share.inputs[1].default_value = NODES - 1.0
    sheen = tree.nodes.new("ShaderNodeBsdfSheen")
    sheen.distribution = "MICROFIBER"
    sheen.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(share.outputs[0], sheen.inputs["Roughness"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(sheen.outputs[0], output.inputs["Surface"])
    scene.collection.objects.link(bpy.data.objects.new("plane", mesh))
    light: Any = bpy.data.lights.new("sun", "SUN")
    light.energy, light.angle, light.use_shadow = 1.0, 0.0, False
    scene.collection.objects.link(bpy.data.objects.new("sun", light))
    data: Any = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale, data.sensor_fit = "ORTHO", float(NODES), "HORIZONTAL"
    data.clip_end = 1e5
    scene.camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(scene.camera)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = NODES, _ROWS
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces = 1, 0
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.light_sampling_threshold = 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    return scene


def _look(scene: Any, cosine: float) -> None:
    """From +x, with y from left to right."""
    from mathutils import Matrix

    sine = math.sqrt(1.0 - cosine**2)
    right, back = (0.0, 1.0, 0.0), (sine, 0.0, cosine)
    up = (-cosine, 0.0, sine)
    place = [1e3 * part for part in back]
    place[1] = 0.5 * NODES
    rows = [(right[i], up[i], back[i], place[i]) for i in range(3)]
    scene.camera.matrix_world = Matrix((*rows, (0.0, 0.0, 0.0, 1.0)))


def _shine(scene: Any, toward: tuple[float, float, float]) -> None:
    from mathutils import Vector

    turned = Vector(toward).to_track_quat("Z", "Y")
    scene.objects["sun"].rotation_euler = turned.to_euler()


def _row(scene: Any, path: Path) -> NDArray[np.float64]:
    """(NODES,) radiances by roughness."""
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image: Any = bpy.data.images.load(str(path))
    pixels = np.empty(_ROWS * NODES * 4, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(_ROWS, NODES, 4)[0, :, 0].astype(np.float64)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else TABLE
    with TemporaryDirectory() as scratch:
        np.save(target, measure(Path(scratch)).astype(np.float32))
