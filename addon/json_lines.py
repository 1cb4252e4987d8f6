# SPDX-License-Identifier: GPL-3.0-or-later
"""How a background process tells its owner how far it is: one JSON object in a line."""

from __future__ import annotations

import json
import sys
import traceback
from collections.abc import Callable, Mapping
from typing import Any

from .errors import InputError
from .progress import Cancelled, Progress
from .stopping import stop_signals, stoppable


def run_told(work: Callable[[Progress], Mapping[str, Any]]) -> int:
    """Do the work, telling of it on standard output.

    Prints {"progress": share, "message": text} as the work goes on, and {"result": {...}} or
    {"error": text} at its end.

    Args:
        work: gives plain values for the result.

    Returns:
        The exit status: 0, 2 for input that cannot be used, 1 for anything else.
    """
    try:
        with stop_signals():
            result = work(stoppable(_tell))
    except InputError as error:
        return _fail(" ".join(str(error).split()), 2)
    except (Cancelled, KeyboardInterrupt):
        return _fail("stopped", 1)
    except Exception as error:  # noqa: BLE001 - the last resort: the trace is for whoever mends it
        traceback.print_exc()
        return _fail(f"this is a fault in Relume ({type(error).__name__}: {error})", 1)
    _say({"result": result})
    return 0


def _tell(fraction: float, message: str) -> None:
    _say({"progress": fraction, "message": message})


def _fail(message: str, status: int) -> int:
    sys.stderr.write(f"relume: {message}\n")
    sys.stderr.flush()
    _say({"error": message})
    return status


def _say(event: Mapping[str, Any]) -> None:
    sys.stdout.write(json.dumps(event) + "\n")
    sys.stdout.flush()
