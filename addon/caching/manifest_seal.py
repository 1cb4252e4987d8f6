# SPDX-License-Identifier: GPL-3.0-or-later
"""The seal of a manifest: a checksum of all that it says, inside it.

A flipped bit in a manifest may well leave valid JSON, with another number in it. The seal tells.
It is over the values and not over the text, so that the layout of the text does not matter.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

_KEY = "sha256"


def sealed(values: Mapping[str, Any]) -> dict[str, Any]:
    """These plain values with their seal, which takes the place of an earlier one."""
    return {**values, _KEY: _digest(values)}


def has_seal(values: Mapping[str, Any]) -> bool:
    """Whether there is one, be it right or wrong."""
    return _KEY in values


def is_sealed(values: Mapping[str, Any]) -> bool:
    """Whether the values have a seal and are what was sealed."""
    return values.get(_KEY) == _digest(values)


def _digest(values: Mapping[str, Any]) -> str:
    content = {key: value for key, value in values.items() if key != _KEY}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()
