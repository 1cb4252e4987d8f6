# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles on the GPU, and the state they are drawn with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import gpu
import numpy as np
from numpy.typing import NDArray


def triangle_batch(attributes: Mapping[str, NDArray[Any]]) -> Any:
    """A batch of triangles from attributes of (3 T, components) float32 or int32 each."""
    return gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer(attributes))


def vertex_buffer(attributes: Mapping[str, NDArray[Any]]) -> Any:
    """A buffer of attributes of (3 T, components) float32 or int32 each."""
    layout = gpu.types.GPUVertFormat()
    for name, values in attributes.items():
        is_integer = values.dtype.kind == "i"
        layout.attr_add(
            id=name,
            comp_type="I32" if is_integer else "F32",
            len=values.shape[1],
            fetch_mode="INT" if is_integer else "FLOAT",
        )
    count = len(next(iter(attributes.values())))
    # Blender's type stubs know sequences only; buffers are taken too, and are far faster.
    vertices: Any = gpu.types.GPUVertBuf(layout, count)
    for name, values in attributes.items():
        dtype = np.int32 if values.dtype.kind == "i" else np.float32
        vertices.attr_fill(name, np.ascontiguousarray(values, dtype=dtype))
    return vertices


@contextmanager
def depth_tested() -> Iterator[None]:
    """Draw both sides of triangles, the nearest surface winning; restores the usual state."""
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.face_culling_set("NONE")
    try:
        yield
    finally:
        gpu.state.depth_test_set("NONE")
        gpu.state.depth_mask_set(False)
