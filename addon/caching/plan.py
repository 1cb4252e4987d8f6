# SPDX-License-Identifier: GPL-3.0-or-later
"""Which channels a scene needs, and what each material was cached as."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .channels import CHANNEL_BY_NAME, Channel


@dataclass(frozen=True)
class Approximation:
    """One way in which a material's cached form differs from what Cycles shows.

    Attributes:
        material: its name.
        effect: one sentence, without the material's name.
    """

    material: str
    effect: str

    def __str__(self) -> str:
        return f"material '{self.material}': {self.effect}"


@dataclass(frozen=True)
class ChannelPlan:
    """Where each channel of a scene lives (DESIGN.md section 3).

    A channel is stored in every deep framebuffer, or is one constant for the whole scene, or
    is in neither list because the scene does not need it; it then has its neutral value.

    Attributes:
        stored: names of the stored channels, in the order of the channel table.
        constants: value of each constant channel that is not neutral.
        material_names: the channel `material_id` is 1 + an index into this.
        approximations: what is not cached as Cycles shows it.
    """

    stored: tuple[str, ...]
    constants: dict[str, tuple[float, ...]]
    material_names: tuple[str, ...]
    approximations: tuple[Approximation, ...] = ()

    def __post_init__(self) -> None:
        for name in (*self.stored, *self.constants):
            if name not in CHANNEL_BY_NAME:
                raise ValueError(f"unknown channel {name!r}")
        for name, value in self.constants.items():
            if len(value) != CHANNEL_BY_NAME[name].components:
                raise ValueError(f"channel {name!r} has the constant {value!r}")

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The stored channels' entries of the channel table."""
        return tuple(CHANNEL_BY_NAME[name] for name in self.stored)

    def constant(self, name: str) -> tuple[float, ...] | None:
        """The value of a channel that is not stored; None for a stored one."""
        if name in self.stored:
            return None
        return self.constants.get(name, CHANNEL_BY_NAME[name].neutral)

    def to_json(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        return {
            "stored": list(self.stored),
            "constants": {name: list(value) for name, value in self.constants.items()},
            "material_names": list(self.material_names),
            "approximations": [
                {"material": item.material, "effect": item.effect} for item in self.approximations
            ],
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> ChannelPlan:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        return cls(
            stored=tuple(str(name) for name in data["stored"]),
            constants={
                str(name): tuple(float(x) for x in value)
                for name, value in data["constants"].items()
            },
            material_names=tuple(str(name) for name in data["material_names"]),
            approximations=tuple(
                Approximation(str(item["material"]), str(item["effect"]))
                for item in data["approximations"]
            ),
        )
