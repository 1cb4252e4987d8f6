# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the real window's viewport with `relume relight` of the same view.

    python -m tests.ui.window.window_check SCENE.blend --cache DIR --edits EDITS.json \
        --out DIR --blender "blender" [--backend vulkan] [--samples 16] [--least 40]

Builds the extension's zip, starts the given Blender program (it needs a display, ImageMagick's
`import`, and may be a command of several words), installs the zip there, shows
the scene under Rendered shading before and after the edits, and compares both screenshots,
inside the viewport, with the command line's pictures. Prints the PSNR of each and leaves
screenshots, pictures, differences and report.json in --out. Exit status 0 when both reach
--least decibels, 1 otherwise.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from tools.build_extension import main as build_extension

DRIVER = Path(__file__).with_name("drive_window.py")
WINDOW = ("0", "0", "1600", "1000")
# Blender draws its own round corners and the arrows that unfold hidden regions over the edge
# of the viewport; the arrows are about 10 pixels wide.
MARGIN = 16


def show_in_blender(args: argparse.Namespace) -> dict[str, Any]:
    """Run the driver inside Blender; returns its report."""
    request = {
        "out": str(args.out.resolve()),
        "zip": str(next((args.out / "zip").glob("*.zip")).resolve()),
        "blend": str(args.scene.resolve()),
        "cache": str(args.cache.resolve()),
        "samples": args.samples,
        "patience_s": args.patience,
        "edits": json.loads(args.edits.read_text(encoding="utf-8")),
    }
    path = args.out / "request.json"
    path.write_text(json.dumps(request), encoding="utf-8")
    command = [*shlex.split(args.blender), "--gpu-backend", args.backend]
    command += ["--window-geometry", *WINDOW, "--python", str(DRIVER), "--", str(path.resolve())]
    # Installing, two pictures and the interface, each within its patience.
    subprocess.run(command, check=True, timeout=5.0 * args.patience)
    failed = args.out / "failed.txt"
    if failed.exists():
        raise RuntimeError(failed.read_text(encoding="utf-8"))
    report: dict[str, Any] = json.loads((args.out / "window.json").read_text(encoding="utf-8"))
    return report


def relight(args: argparse.Namespace, name: str, edits: Path | None) -> Path:
    """The command line's picture of the viewport's view."""
    picture: Path = args.out / f"relight_{name}.png"
    command = [sys.executable, "-m", "tools.relume", "relight", str(args.out / "view.blend")]
    command += ["--cache", str(args.cache), "--camera", "Viewport Check", "--out", str(picture)]
    command += ["--samples", str(args.samples)]
    command += ["--lights", str(edits)] if edits is not None else []
    subprocess.run(command, check=True)
    return picture


def read_rgb(path: Path) -> NDArray[np.float64]:
    """(H, W, 3) display values 0 to 255, row 0 at the top."""
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.float64)


def crop(screen: NDArray[np.float64], region: list[int]) -> NDArray[np.float64]:
    """The viewport's part of the screen; `region` counts from the bottom left."""
    left, bottom, width, height = region
    top = screen.shape[0] - bottom - height
    return screen[top : top + height, left : left + width]


def psnr(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Decibels over all channels, 8-bit range."""
    with np.errstate(divide="ignore"):
        return float(10.0 * np.log10(255.0**2 / np.mean((first - second) ** 2)))


def compare(args: argparse.Namespace, name: str, region: list[int], picture: Path) -> float:
    """PSNR away from the viewport's edge; leaves a difference picture, 20 times as strong."""
    shown = crop(read_rgb(args.out / f"{name}.png"), region)
    expected = read_rgb(picture)
    if shown.shape != expected.shape:
        raise RuntimeError(f"{picture} is {expected.shape}, the viewport {shown.shape}")
    inside = (slice(MARGIN, -MARGIN), slice(MARGIN, -MARGIN))
    difference = np.clip(20.0 * np.abs(shown - expected)[inside], 0.0, 255.0)
    Image.fromarray(difference.astype(np.uint8)).save(args.out / f"difference_{name}.png")
    return psnr(shown[inside], expected[inside])


def parse(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("--cache", type=Path, required=True)
    parser.add_argument("--edits", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--backend", choices=("opengl", "vulkan"), default="opengl")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--least", type=float, default=40.0)
    parser.add_argument("--patience", type=float, default=100.0, help="seconds for a picture")
    return parser.parse_args(argv)


def main(argv: list[str] | None = None) -> int:
    args = parse(argv)
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "failed.txt").unlink(missing_ok=True)
    if build_extension(["--out", str(args.out / "zip")]) != 0:
        return 1
    report = show_in_blender(args)
    figures = {
        name: compare(args, name, report["region"], relight(args, name, edits))
        for name, edits in (("before", None), ("after", args.edits))
    }
    moved = psnr(
        crop(read_rgb(args.out / "before.png"), report["region"]),
        crop(read_rgb(args.out / "after.png"), report["region"]),
    )
    report |= {"psnr": figures, "psnr_between_before_and_after": moved}
    (args.out / "report.json").write_text(json.dumps(report, indent=2), encoding="utf-8")
    for name, figure in figures.items():
        print(f"{name}: {figure:.1f} dB between viewport and relume relight ({report['backend']})")
    print(f"the edit changed the picture: {moved:.1f} dB between before and after")
    return 0 if min(figures.values()) >= args.least and moved < args.least else 1


if __name__ == "__main__":
    sys.exit(main())
