# SPDX-License-Identifier: GPL-3.0-or-later
"""How many samples a picture has where nobody says."""

from __future__ import annotations

# Of each relit pixel: its error at edges is then below the caching's.
PICTURE_SAMPLES = 16
