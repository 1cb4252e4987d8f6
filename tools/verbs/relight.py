# SPDX-License-Identifier: GPL-3.0-or-later
"""`relume relight SCENE.blend`: one picture from the cache."""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from addon.bake_arguments import add_cache
from addon.errors import InputError
from addon.progress import Progress, part_of
from addon.writable import require_file

from ..unique_names import unique_names
from . import arguments

if TYPE_CHECKING:
    from addon.relight.layers.picture import Picture
    from addon.scene.render_region import RenderRegion

NAME = "relight"
HELP = "Relight a camera's view of SCENE.blend from its cache, and write it as PNG or EXR."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's arguments."""
    arguments.add_scene(parser)
    add_cache(parser)
    parser.add_argument(
        "--out", type=Path, metavar="IMAGE", required=True,
        help=".exr: scene-linear, with a layer for each light; .png: through Blender's view",
    )  # fmt: skip
    parser.add_argument("--camera", metavar="NAME", help="default: the scene's active camera")
    parser.add_argument(
        "--lights", type=Path, metavar="EDITS.json", help="changes to the lights, by their names"
    )
    parser.add_argument(
        "--lobes", action="store_true",
        help="in an .exr: for each light also a layer for each kind of lobe, as Key.diffuse",
    )  # fmt: skip
    parser.add_argument(
        "--solo",
        nargs="+",
        metavar="LIGHT",
        default=[],
        help="show only these lights; glowing objects count among them",
    )
    parser.add_argument(
        "--mute",
        nargs="+",
        metavar="LIGHT",
        default=[],
        help="leave these lights out; glowing objects count among them",
    )
    parser.add_argument(
        "--surfaces", type=Path, metavar="SURFACES.json",
        help="changes to what materials and objects look like, by their names",
    )  # fmt: skip
    parser.add_argument(
        "--confidence", type=Path, metavar="IMAGE",
        help="also how far each pixel may be trusted; .png: a heat map, .exr: values from 0 to 1",
    )  # fmt: skip
    arguments.add_view(parser)
    arguments.add_filling(parser)


def run(args: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Relight and write the picture."""
    suffix = args.out.suffix.lower()
    for path in (args.out, *(() if args.confidence is None else (args.confidence,))):
        if path.suffix.lower() not in (".exr", ".png"):
            raise InputError(f"{path} is neither an .exr nor a .png file; name one of these.")
        require_file(path)
    if args.confidence is not None and args.confidence.resolve() == args.out.resolve():
        raise InputError(f"--confidence names the picture's own file, {args.out}; name another.")

    from ..scene_file import load_blender, open_scene

    load_blender()
    from addon.relight.edits.edits_file import applied_edits, read_edits
    from addon.relight.edits.surface_edits_file import NO_CHANGES, read_surface_changes

    from ..confidence_table import NOTHING, write_confidence
    from ..filling import Filling
    from ..relit import (
        cache_approximations,
        mixed,
        open_session,
        read_exposure_of,
        read_region,
        read_scene,
        read_views,
        require_light,
    )

    edits = read_edits(args.lights) if args.lights is not None else {}
    changes = read_surface_changes(args.surfaces) if args.surfaces is not None else NO_CHANGES
    progress(0.0, f"opening {args.scene.name}")
    scene = open_scene(args.scene)
    if args.frame is not None:
        scene.frame_set(args.frame)
    progress(0.05, "reading the scene")
    with applied_edits(scene, edits):
        arrays = mixed(read_scene(scene), args.solo, args.mute)
        view = read_views(scene, [args.camera], args.size)[0]
        region = read_region(scene, view)
        view = view if region is None else region.of(view)
        exposure = read_exposure_of(scene, view, arrays.geometry, region)
    require_light(scene, arrays)
    shown = arrays.geometry
    surface_edits = changes.over(arrays.surface_edits, shown.material_names, shown.object_names)
    progress(0.15, f"loading {args.cache}")
    session = open_session(
        arrays,
        args.cache,
        args.samples,
        part_of(progress, 0.15, 0.4),
        split_lobes=args.lobes and suffix == ".exr",
        shadows=args.shadows,
    )
    session.set_surface_edits(surface_edits)
    session.set_view(view)
    with Filling(scene, arrays, args.cache, session, **arguments.filling(args)) as filling:
        filling.fill(view, part_of(progress, 0.4, 0.6))
        session.set_exposure(exposure)
        started = time.monotonic()
        picture = session.render(part_of(progress, 0.6, 0.95))
    seconds = time.monotonic() - started
    progress(0.95, f"writing {args.out}")
    width, height = _write(scene, picture, args.out, region)
    if args.confidence is not None:
        confidence = session.confidence().read()
        if region is not None:
            confidence = region.picture(confidence, NOTHING)
        write_confidence(args.confidence, confidence)
    progress(1.0, f"wrote {args.out}")
    return {
        "image": str(args.out),
        "camera": view.name,
        "frame": int(scene.frame_current),
        "width": width,
        "height": height,
        "region": None if region is None else region.edges,
        "samples": args.samples,
        "shadows": args.shadows,
        "lights": [light.name for light in arrays.lights],
        "hole_fraction": picture.coverage.hole_fraction,
        "open_fraction": picture.coverage.open_fraction,
        "filled": filling.report(),
        "seconds_relight": round(seconds, 3),
        "warnings": [
            *arrays.warnings,
            *(exposure.warnings if exposure is not None else ()),
            *session.warnings,
            *filling.notes,
            *cache_approximations(args.cache),
        ],
    }


def _write(
    scene: Any, picture: Picture, path: Path, region: RenderRegion | None
) -> tuple[int, int]:
    """Write a picture with its layers, or what it is a region of; its width and height."""
    from ..display import write_display_png
    from ..picture_file import write_exr

    combined, layers = picture.combined, _layers(picture)
    if region is not None:
        combined = region.picture(combined)
        layers = {name: region.picture(layer) for name, layer in layers.items()}
    if path.suffix.lower() == ".png":
        write_display_png(scene, combined, path)
    else:
        write_exr(path, combined, _channels(layers))
    return combined.shape[1], combined.shape[0]


def _layers(picture: Picture) -> dict[str, NDArray[np.float32]]:
    """A picture's layers as an EXR names them, (H, W, 3): "Key" and "Key.diffuse"."""
    # A dot parts a layer from its channel, so that a layer's own name has none.
    exr_names = unique_names(name.replace(".", "_") for name in picture.layers)
    layers: dict[str, NDArray[np.float32]] = {}
    for exr_name, (name, layer) in zip(exr_names, picture.layers.items(), strict=True):
        layers[exr_name] = layer
        for lobe, part in picture.lobes.get(name, {}).items():
            layers[f"{exr_name}.{lobe}"] = part
    return layers


def _channels(layers: Mapping[str, NDArray[np.float32]]) -> dict[str, NDArray[np.float32]]:
    """The channels of layers, as "Key.R" and "Key.diffuse.R"."""
    return {
        f"{name}.{channel}": np.ascontiguousarray(pixels[..., i])
        for name, pixels in layers.items()
        for i, channel in enumerate("RGB")
    }


def describe(report: dict[str, Any]) -> str:
    """The result for a person."""
    holes = 100.0 * report["hole_fraction"]
    return (
        f"{report['image']}: {report['camera']}, {report['width']}x{report['height']}, "
        f"{report['seconds_relight']:.2f} s, {holes:.2f} % holes"
    )
