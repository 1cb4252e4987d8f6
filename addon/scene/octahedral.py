# SPDX-License-Identifier: GPL-3.0-or-later
"""Unit vectors as two 16-bit numbers.

The sphere is projected on the octahedron |x| + |y| + |z| = 1, whose lower half is folded outward
into the corners of the square [-1, 1]^2 (Cigolle et al., A Survey of Efficient Representations
for Independent Unit Vectors, 2014). In steps of 1/32767 the direction is off by 7e-5 at most, a
third of what three half-precision numbers leave; the axes are exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Steps on either side of 0.
_STEPS = 32767

# Of both numbers.
NORMAL_BYTES = 4

# A sampler gives the code's share of 65535.
GLSL = f"""vec3 octahedral_normal(vec2 share)
{{
  vec2 folded = (share * 65535.0 - {_STEPS}.0) / {_STEPS}.0;
  vec3 n = vec3(folded, 1.0 - abs(folded.x) - abs(folded.y));
  float below = max(-n.z, 0.0);
  n.x += n.x >= 0.0 ? -below : below;
  n.y += n.y >= 0.0 ? -below : below;
  return normalize(n);
}}
"""


def to_codes(normal: NDArray[np.floating]) -> NDArray[np.uint16]:
    """(..., 2) codes of (..., 3) vectors of any length; the middle for no vector."""
    exact = normal.astype(np.float64)
    size = np.abs(exact).sum(axis=-1, keepdims=True)
    flat = exact / np.where(size > 0.0, size, 1.0)
    x, y, z = flat[..., 0], flat[..., 1], flat[..., 2]
    below = np.stack([np.copysign(1.0 - np.abs(y), x), np.copysign(1.0 - np.abs(x), y)], axis=-1)
    folded = np.where(z[..., None] < 0.0, below, flat[..., :2])
    return np.rint(folded * _STEPS + _STEPS).astype(np.uint16)


def from_codes(codes: NDArray[np.uint16]) -> NDArray[np.float32]:
    """(..., 3) unit vectors from what `to_codes` made."""
    folded = (codes.astype(np.float64) - _STEPS) / _STEPS
    x, y = folded[..., 0], folded[..., 1]
    z = 1.0 - np.abs(x) - np.abs(y)
    below = np.maximum(-z, 0.0)
    normal = np.stack([x - np.copysign(below, x), y - np.copysign(below, y), z], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(normal, dtype=np.float32)


def to_words(normal: NDArray[np.float32]) -> NDArray[np.uint32]:
    """(..., 1): both codes of each vector in one number, as files hold them."""
    codes = to_codes(normal).astype(np.uint32)
    return codes[..., :1] | (codes[..., 1:] << np.uint32(16))


def from_words(words: NDArray[np.uint32]) -> NDArray[np.float32]:
    """(..., 3) unit vectors from what `to_words` made."""
    codes = np.concatenate([words & np.uint32(0xFFFF), words >> np.uint32(16)], axis=-1)
    return from_codes(codes.astype(np.uint16))
