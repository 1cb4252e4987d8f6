# SPDX-License-Identifier: GPL-3.0-or-later
"""The twin of addon/glsl/lib/perlin.glsl: Blender's normalized fBM in 3D, lacunarity 2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The twelve directions to the middles of a cube's edges, and four of them again, in the order of
# the hash's last four bits.
_SLOPES = np.array(
    [
        (1, 1, 0), (-1, 1, 0), (1, -1, 0), (-1, -1, 0), (1, 0, 1), (-1, 0, 1), (1, 0, -1),
        (-1, 0, -1), (0, 1, 1), (0, -1, 1), (0, 1, -1), (0, -1, -1), (1, 1, 0), (0, -1, 1),
        (-1, 1, 0), (0, -1, -1),
    ],
    dtype=np.float64,
)  # fmt: skip


def noise_texture(p: Array, detail: float, roughness: float) -> Array:
    """(…) the Factor at (…, 3) places."""
    octaves = [signed_noise(p * 2.0**k) for k in range(int(detail) + 2)]
    weights = roughness ** np.arange(len(octaves))

    def upto(count: int) -> Array:
        total = sum(w * o for w, o in zip(weights[:count], octaves, strict=False))
        return np.asarray(0.5 + 0.5 * total / weights[:count].sum())

    whole, rest = int(detail) + 1, detail % 1.0
    return (1.0 - rest) * upto(whole) + rest * upto(whole + 1)


def signed_noise(p: Array) -> Array:
    far = np.where(np.abs(p) >= 1e6, 0.5, 0.0)
    return 0.982 * perlin(np.fmod(p, 1e5) + far)


def perlin(p: Array) -> Array:
    """Improved Perlin noise (K. Perlin, 2002)."""
    cell = np.floor(p).astype(np.int64)
    f = p - cell
    fade = ((6.0 * f - 15.0) * f + 10.0) * f**3
    total = np.zeros(p.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        slope = _SLOPES[_hash(cell + corner) & 15]
        share = np.prod(np.where(np.array(corner) == 1, fade, 1.0 - fade), axis=-1)
        total = total + share * np.sum(slope * (f - corner), axis=-1)
    return total


def _hash(cell: NDArray[np.int64]) -> NDArray[np.uint32]:
    """B. Jenkins' lookup3 of three words: final() alone."""
    with np.errstate(over="ignore"):
        start = np.uint32(0xDEADBEEF + (3 << 2) + 13)
        a, b, c = (start + cell[..., axis].astype(np.uint32) for axis in range(3))
        words = [a, b, c]
        for target, source, bits in (
            (2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24),
        ):  # fmt: skip
            turned = words[source] << np.uint32(bits) | words[source] >> np.uint32(32 - bits)
            words[target] = (words[target] ^ words[source]) - turned
    return words[2]
