# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m tools.demo_scene OUT.blend`: write the demo's scene."""

from __future__ import annotations

import sys
from pathlib import Path

from . import build

if len(sys.argv) != 2:
    sys.exit("usage: python -m tools.demo_scene OUT.blend")
build(Path(sys.argv[1]))
