# SPDX-License-Identifier: GPL-3.0-or-later
"""What a channel plan saves, in plain values: which channels were asked for, which are left.

The counts are those of figure 5 of Ragan-Kelley et al. (2007), "The Lightspeed Automatic
Interactive Lighting Preview System": values asked for, values that vary over the scene, and those
of them that are no duplicates of others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .channels import CHANNELS, Channel
from .plan import ChannelPlan

# How often each channel was stored in each precision: {"normal": {"half": 14}}.
Precisions = Mapping[str, Mapping[str, int]]

# Bytes of a texel if every channel of the table were stored for it in float32.
FLOAT32_BYTES = 4 * sum(channel.components for channel in CHANNELS)


def plan_report(plan: ChannelPlan, precisions: Precisions) -> dict[str, Any]:
    """The channels of a scene: those of the table.

    Args:
        plan: where each lives.
        precisions: in how many cameras each stored channel was written in which precision.

    Returns:
        `asked`, `varying`, `unique` and `stored`, each with the number of `channels` and of their
        `values`, or components; and in `table` an entry for each channel that was asked for:
        `name`, `components`, `lives` ("stored", "constant" or "neutral"), and with it
        `cameras_by_precision` or the `value`.
    """
    stored = [channel for channel in CHANNELS if channel.name in plan.stored]
    return {
        "asked": _count(CHANNELS),
        "varying": _count(stored),
        "unique": _count(stored),
        "stored": _count(stored),
        "table": [_entry(channel, plan, precisions) for channel in CHANNELS],
    }


def _count(channels: Iterable[Channel]) -> dict[str, int]:
    components = [channel.components for channel in channels]
    return {"channels": len(components), "values": sum(components)}


def _entry(channel: Channel, plan: ChannelPlan, precisions: Precisions) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": channel.name, "components": channel.components}
    if channel.name in plan.stored:
        return entry | {
            "lives": "stored",
            "cameras_by_precision": dict(precisions.get(channel.name, {})),
        }
    if channel.name in plan.constants:
        return entry | {"lives": "constant", "value": list(plan.constants[channel.name])}
    return entry | {"lives": "neutral", "value": list(channel.neutral)}


def material_report(plan: ChannelPlan) -> list[dict[str, Any]]:
    """Each material's `name` and the sentences that say what of it is `approximated`.

    Surfaces without a material are those of the name "(none)".
    """
    effects: dict[str, list[str]] = {name or "(none)": [] for name in plan.material_names}
    for item in plan.approximations:
        effects.setdefault(item.material, []).append(item.effect)
    return [{"name": name, "approximated": found} for name, found in effects.items()]
