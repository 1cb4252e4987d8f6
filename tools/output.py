# SPDX-License-Identifier: GPL-3.0-or-later
"""What a verb prints: its result on standard output, everything else on standard error."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any, TextIO

from addon.progress import Progress

# A log grows by at most one line in this many seconds while a step goes on.
LOG_INTERVAL_S = 2.0


@contextmanager
def standard_output() -> Iterator[TextIO]:
    """Give the real standard output, and send everybody else's to standard error.

    Blender prints from C ("Saved: ...", "Fra:1 Mem: ..."), so `sys.stdout` alone is not
    enough: the file descriptor itself is exchanged while the context is open.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with (
            os.fdopen(kept, "w", encoding="utf-8", closefd=False) as real,
            redirect_stdout(sys.stderr),
        ):
            yield real
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


# Where a result says which of its figures could not be computed.
NOT_COMPUTED = "not_computed"


def to_json(result: dict[str, Any]) -> str:
    """One JSON object.

    JSON holds no infinite numbers: the PSNR of identical pictures becomes null, as do figures
    over no pixels. A figure that is not a number is a fault, and must not pass for one of
    these: it becomes null too, so that a long run's other figures are not lost, but the object
    then has NOT_COMPUTED, a list of the places of such figures ("views.0.whole.flip").
    """
    faults: list[str] = []
    plain = _finite(result, (), faults)
    if faults:
        plain[NOT_COMPUTED] = faults
    return json.dumps(plain, allow_nan=False, indent=2, ensure_ascii=False)


def _finite(value: Any, place: tuple[str, ...], faults: list[str]) -> Any:
    """The same, with plain containers and finite numbers only; `faults` gets those of NaNs."""
    if isinstance(value, dict):
        return {str(k): _finite(item, (*place, str(k)), faults) for k, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item, (*place, str(i)), faults) for i, item in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        if math.isnan(value):
            faults.append(".".join(place))
        return None
    return value


def progress_on(stream: TextIO) -> Progress:
    """A Progress that draws one line on a terminal, and writes a sparse log elsewhere."""
    terminal = stream.isatty()
    last = {"time": -math.inf}

    def show(fraction: float, message: str) -> None:
        now = time.monotonic()
        done = fraction >= 1.0
        if terminal:
            filled = round(24 * min(max(fraction, 0.0), 1.0))
            bar = "#" * filled + "." * (24 - filled)
            stream.write(f"\r\x1b[K[{bar}] {100 * fraction:3.0f} %  {message}")
            stream.write("\n" if done else "")
        elif done or now - last["time"] >= LOG_INTERVAL_S:
            stream.write(f"[{100 * fraction:3.0f} %] {message}\n")
            last["time"] = now
        stream.flush()

    return show
