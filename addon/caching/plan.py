# SPDX-License-Identifier: GPL-3.0-or-later
"""Which channels a scene needs, where each lives, and what each material was cached as."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .channels import CHANNEL_BY_NAME, Channel

Values = tuple[float, ...]


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

    A channel is stored in every deep framebuffer, or is one constant for the whole scene or for
    each material, or is the same as a stored one; one that is none of these is not needed, and
    has its neutral value.

    Attributes:
        stored: names of the stored channels, in the order of the channel table.
        constants: value of each constant channel that is not neutral.
        material_names: the channel `material_id` is 1 + an index into this.
        approximations: what is not cached as Cycles shows it.
        material_constants: for each channel that is a constant in every material, but not the
            same one, its value in each material.
        same: for each channel that equals a stored one in every material, that one's name.
        grey: stored channels whose three components are equal; one is stored.
        lobes: most lobes that any material has, at least 1.
        mesh_normals: for each stored normal, whether it is in each material the one that the mesh
            itself interpolates, so that it need not be read from texels; none in older caches.
    """

    stored: tuple[str, ...]
    constants: Mapping[str, Values]
    material_names: tuple[str, ...]
    approximations: tuple[Approximation, ...] = ()
    material_constants: Mapping[str, tuple[Values, ...]] = field(default_factory=dict)
    same: Mapping[str, str] = field(default_factory=dict)
    grey: frozenset[str] = frozenset()
    lobes: int = 1
    mesh_normals: Mapping[str, tuple[bool, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in (*self.stored, *self.constants, *self.material_constants, *self.same):
            if name not in CHANNEL_BY_NAME:
                raise ValueError(f"unknown channel {name!r}")
            if CHANNEL_BY_NAME[name].lobe > self.lobes:
                raise ValueError(f"channel {name!r} is of a lobe beyond {self.lobes}")
        for name, values in self._constants():
            if len(values) != CHANNEL_BY_NAME[name].components:
                raise ValueError(f"channel {name!r} has the constant {values!r}")
        for name, every in {**self.material_constants, **self.mesh_normals}.items():
            if len(every) != len(self.material_names):
                raise ValueError(f"channel {name!r} is not given for every material")
        if not (set(self.same.values()) | self.grey | set(self.mesh_normals)) <= set(self.stored):
            raise ValueError("a channel is said to be one that is not stored")

    def _constants(self) -> list[tuple[str, Values]]:
        of_materials = [(n, v) for n, every in self.material_constants.items() for v in every]
        return [*self.constants.items(), *of_materials]

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The stored channels' entries of the channel table."""
        return tuple(CHANNEL_BY_NAME[name] for name in self.stored)

    def components(self, name: str) -> int:
        """How many components are stored of a channel."""
        return 1 if name in self.grey else CHANNEL_BY_NAME[name].components

    def constant(self, name: str) -> Values | None:
        """The one value of a channel in the whole scene; None for one that varies."""
        if name in self.stored or name in self.material_constants or name in self.same:
            return None
        return self.constants.get(name, CHANNEL_BY_NAME[name].neutral)

    def uses(self, name: str) -> bool:
        """Whether a channel is anything else than neutral anywhere."""
        return self.constant(name) != CHANNEL_BY_NAME[name].neutral

    def to_json(self) -> dict[str, Any]:
        """Plain values for the manifest."""
        return {
            "stored": list(self.stored),
            "constants": {name: list(value) for name, value in self.constants.items()},
            "material_names": list(self.material_names),
            "approximations": [
                {"material": item.material, "effect": item.effect} for item in self.approximations
            ],
            "material_constants": {
                name: [list(value) for value in every]
                for name, every in self.material_constants.items()
            },
            "same": dict(self.same),
            "grey": sorted(self.grey),
            "lobes": self.lobes,
            "mesh_normals": {name: list(every) for name, every in self.mesh_normals.items()},
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> ChannelPlan:
        """Raises KeyError, TypeError or ValueError on anything that to_json() did not write."""
        return cls(
            stored=tuple(str(name) for name in data["stored"]),
            constants={str(name): _values(value) for name, value in data["constants"].items()},
            material_names=tuple(str(name) for name in data["material_names"]),
            approximations=tuple(
                Approximation(str(item["material"]), str(item["effect"]))
                for item in data["approximations"]
            ),
            material_constants={
                str(name): tuple(_values(value) for value in every)
                for name, every in data["material_constants"].items()
            },
            same={str(name): str(other) for name, other in data["same"].items()},
            grey=frozenset(str(name) for name in data["grey"]),
            lobes=int(data["lobes"]),
            mesh_normals={
                str(name): tuple(bool(x) for x in every)
                for name, every in data.get("mesh_normals", {}).items()
            },
        )


def _values(data: Any) -> Values:
    return tuple(float(x) for x in data)
