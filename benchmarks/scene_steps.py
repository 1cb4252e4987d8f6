# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps that a run of `benchmarks.scene_accuracy` still has to do, and how long they take."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

# Seconds, measured on two cores: of a preset's placement, a texel's bake, a relit sample of a pixel
# under one light, a reference's sample of a pixel.
USUAL = {"plan": 15.0, "bake": 6e-6, "relight": 3e-6, "measure": 1.5e-6}
# Seconds before a step begins in earnest (opening the scene, loading the cache, compiling), and of
# each picture that it makes, however small that is.
START_S = {"plan": 8.0, "bake": 8.0, "relight": 12.0, "measure": 8.0}
PICTURE_S = 0.5
# A reference's samples are doubled while it is too noisy: how often is not known beforehand.
USUAL_DOUBLINGS = 1


@dataclass(frozen=True)
class Step:
    """One process to run.

    Attributes:
        kind: "plan", "bake", "relight" or "measure".
        scene: its folder's name.
        preset: "" for none.
        work: in the units of `USUAL`.
        pictures: that it renders.
    """

    kind: str
    scene: str
    preset: str
    work: float
    pictures: int = 0

    @property
    def least(self) -> float:
        """Seconds that do not grow with the work."""
        return START_S[self.kind] + PICTURE_S * self.pictures

    @property
    def title(self) -> str:
        return " ".join(part for part in (f"{self.scene}:", self.kind, self.preset) if part)


@dataclass
class Rates:
    """Seconds of a unit of work, as measured in earlier steps.

    Attributes:
        path: where they are kept.
        measured: by kind and scene.
    """

    path: Path
    measured: dict[str, dict[str, float]] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Rates:
        known = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        return cls(path, known)

    def note(self, step: Step, seconds: float) -> None:
        """A step took so long."""
        if step.work > 0.0:
            beyond = max(seconds - step.least, 0.1 * seconds)
            self.measured.setdefault(step.kind, {})[step.scene] = beyond / step.work
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.path.write_text(json.dumps(self.measured, indent=1), encoding="utf-8")

    def seconds(self, step: Step) -> float:
        """How long a step takes: by the scene's own pace, that of others, or the usual one."""
        known = self.measured.get(step.kind, {})
        usual = median(known.values()) if known else USUAL[step.kind]
        return step.least + known.get(step.scene, usual) * step.work


def steps_left(
    name: str,
    folder: Path,
    presets: Sequence[str],
    *,
    samples: Sequence[int],
    reference_samples: int,
) -> list[Step]:
    """What is still to do for a scene: planning alone, until that is done.

    Args:
        name: of the scene.
        folder: of its results.
        presets: wanted ones.
        samples: of a relit pixel; each such number is a picture of its own.
        reference_samples: of a reference's pixel and light, to begin with.
    """
    plan = read_json(folder / "plan.json")
    planned = {} if plan is None else plan["presets"]
    missing = [preset for preset in presets if preset not in planned]
    if plan is None or missing:
        return [Step("plan", name, "", float(len(missing)))]
    left = []
    fewest = plan["pixels"] * reference_samples * plan["renders"]
    for preset in presets:
        pictures = [
            (count, picture_folder(folder, preset, entry["name"], count))
            for entry in plan["views"]
            for count in samples
        ]
        unlit = sum(count for count, at in pictures if not (at / "relit.json").is_file())
        unmeasured = any(not (at / "figures.json").is_file() for _, at in pictures)
        if unlit:
            # What was baked is looked through again: it may have been by an earlier version.
            new = not (folder / preset / "bake.json").is_file()
            cameras, texels = (planned[preset][part] for part in ("cameras", "texels"))
            left.append(Step("bake", name, preset, new * texels, 2 * new * cameras))
            lit = plan["pixels"] * (plan["lights"] + 1)
            left.append(Step("relight", name, preset, unlit * lit))
        if unlit or unmeasured:
            unseen = sum(
                not (folder / entry["name"] / "reference.npz").is_file() for entry in plan["views"]
            )
            # The first preset's figures bring the references.
            first = preset == presets[0]
            unseen = unseen if first else 0
            work = unseen * fewest * 2.0**USUAL_DOUBLINGS
            renders = 2 * unseen * plan["renders"] * (1 + USUAL_DOUBLINGS)
            left.append(Step("measure", name, preset, work, renders))
    return left


def picture_folder(folder: Path, preset: str, view: str, samples: int) -> Path:
    """Where a view's picture with a preset and so many samples is, and what is known of it."""
    return folder / preset / view / _count_name(samples)


def forget_pictures(folder: Path, preset: str, samples: Sequence[int]) -> None:
    """Have all views relit and measured again with some numbers of samples."""
    for count in samples:
        for path in (folder / preset).glob(f"*/{_count_name(count)}/*.json"):
            path.unlink()


def _count_name(samples: int) -> str:
    return f"{samples} samples"


def in_order(steps: Mapping[str, Sequence[Step]], presets: Sequence[str]) -> list[Step]:
    """Plans first, then all scenes in the first preset, then in the next one."""
    every = [step for of_scene in steps.values() for step in of_scene]
    return [step for preset in ("", *presets) for step in every if step.preset == preset]


def describe_plans(plans: Mapping[str, dict[str, Any]], presets: Sequence[str]) -> str:
    """What is to be baked, one line for each scene."""
    lines = []
    for name, plan in plans.items():
        parts = [
            f"{preset}: {plan['presets'][preset]['cameras']} cameras, "
            f"{plan['presets'][preset]['texels'] / 1e6:.0f} M texels"
            for preset in presets
            if preset in plan["presets"]
        ]
        lines.append(
            f"  {name}: {plan['triangles']:,} triangles, {plan['lights']} lights; "
            + "; ".join(parts)
        )
    return "\n".join(lines)


def read_json(path: Path) -> dict[str, Any] | None:
    """A JSON object; None without the file."""
    if not path.is_file():
        return None
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found
