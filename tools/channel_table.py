# SPDX-License-Identifier: GPL-3.0-or-later
"""The channel table as the manual has it: `python -m tools.channel_table` prints it."""

from __future__ import annotations

from addon.caching.channels import CHANNELS, Channel


def channel_table() -> str:
    """A Markdown table of all channels of one lobe and of the whole surface."""
    rows = ["| channel | values | of | unit, space | meaning |", "| --- | --- | --- | --- | --- |"]
    rows += [_row(channel) for channel in CHANNELS]
    return "\n".join(rows) + "\n"


def _row(channel: Channel) -> str:
    owner = "each lobe" if channel.lobe else "the surface"
    unit = " ".join(part for part in (channel.unit, channel.space) if part not in ("1", "none"))
    return (
        f"| `{channel.name}` | {channel.components} | {owner} | {unit or '1'} | {channel.meaning} |"
    )


if __name__ == "__main__":
    print(channel_table(), end="")
