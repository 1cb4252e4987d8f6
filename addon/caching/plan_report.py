# SPDX-License-Identifier: GPL-3.0-or-later
"""What a channel plan saves, in plain values: which channels were asked for, which are left.

The counts are those of figure 5 of Ragan-Kelley et al. (2007), "The Lightspeed Automatic
Interactive Lighting Preview System": values asked for, values that vary over the scene, and those
of them that are no duplicates of others. What is stored are those that vary within a material.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .channels import Channel, channels_of
from .plan import ChannelPlan

# How often each channel was stored in each precision: {"normal": {"half": 14}}.
Precisions = Mapping[str, Mapping[str, int]]

# With the 16 texture units that every GPU gives a shader, four values in each, half of them taken.
SAFE_VALUES = 32

# What reports call surfaces without a material.
_NONE = "(none)"


def asked_channels(plan: ChannelPlan) -> tuple[Channel, ...]:
    """The channel table, for as many lobes as any of the scene's materials has."""
    return channels_of(plan.lobes)


def float32_bytes(plan: ChannelPlan) -> int:
    """Bytes of a texel if each of these channels were stored for it in float32."""
    return 4 * sum(channel.components for channel in asked_channels(plan))


def value_notes(plan: ChannelPlan) -> tuple[str, ...]:
    """A sentence if so much varies over the surfaces that not every GPU can draw it."""
    values = sum(
        plan.components(name) for name in plan.stored if name not in ("depth", "material_id")
    )
    if values <= SAFE_VALUES:
        return ()
    note = (
        f"{values} values vary over the materials' surfaces, and some GPUs draw {SAFE_VALUES} at "
        "once; if relighting refuses, make some of them constant over their material"
    )
    return (note,)


def plan_report(plan: ChannelPlan, precisions: Precisions) -> dict[str, Any]:
    """The channels of a scene: those of the table.

    Args:
        plan: where each lives.
        precisions: in how many cameras each stored channel was written in which precision.

    Returns:
        `asked`, `varying`, `unique` and `stored`, each with the number of `channels` and of their
        `values`, or components; and in `table` an entry for each channel that was asked for:
        `name`, `components`, `lives`, and with it what the way asks for:

        * "stored": `stored_components`, `cameras_by_precision`;
        * "same", as another channel that is stored: `channel`;
        * "constant of each material": `values`, by the materials' names;
        * "constant": `value`;
        * "neutral": `value`, as the scene does not use it.
    """
    asked = asked_channels(plan)
    stored = [c for c in asked if c.name in plan.stored]
    unique = [c for c in asked if c.name in plan.stored or c.name in plan.material_constants]
    varying = [c for c in asked if c in unique or c.name in plan.same]
    return {
        "asked": _count(c.components for c in asked),
        "varying": _count(c.components for c in varying),
        "unique": _count(plan.components(c.name) for c in unique),
        "stored": _count(plan.components(c.name) for c in stored),
        "table": [_entry(channel, plan, precisions) for channel in asked],
    }


def _count(components: Iterable[int]) -> dict[str, int]:
    each = list(components)
    return {"channels": len(each), "values": sum(each)}


def _entry(channel: Channel, plan: ChannelPlan, precisions: Precisions) -> dict[str, Any]:
    name = channel.name
    entry: dict[str, Any] = {"name": name, "components": channel.components}
    if name in plan.stored:
        return entry | {
            "lives": "stored",
            "stored_components": plan.components(name),
            "cameras_by_precision": dict(precisions.get(name, {})),
        }
    if name in plan.same:
        return entry | {"lives": "same", "channel": plan.same[name]}
    if name in plan.material_constants:
        materials = [material or _NONE for material in plan.material_names]
        values = [list(value) for value in plan.material_constants[name]]
        return entry | {
            "lives": "constant of each material",
            "values": dict(zip(materials, values, strict=True)),
        }
    if name in plan.constants:
        return entry | {"lives": "constant", "value": list(plan.constants[name])}
    return entry | {"lives": "neutral", "value": list(channel.neutral)}


def material_report(plan: ChannelPlan) -> list[dict[str, Any]]:
    """Each material's `name` and the sentences that say what of it is `approximated`.

    Surfaces without a material are those of the name "(none)".
    """
    effects: dict[str, list[str]] = {name or _NONE: [] for name in plan.material_names}
    for item in plan.approximations:
        effects.setdefault(item.material, []).append(item.effect)
    return [{"name": name, "approximated": found} for name, found in effects.items()]
