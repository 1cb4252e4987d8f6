# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a camera's picture that is rendered: Blender's render region."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .view import View

# Pixels about a region that are drawn with it: what its border's pixels take from their neighbours
# is there. Through a lens or a shutter that is what lies as far as the blur goes.
_MARGIN = 4
_MARGIN_OF_BLUR = 32


@dataclass(frozen=True)
class RenderRegion:
    """Columns from `left` to before `right` and rows from `bottom` to before `top`.

    Attributes:
        width, height: of the whole picture, pixels.
        left, bottom, right, top: pixels; row 0 is at the bottom.
        is_cropped: whether the picture that is made is the region alone; else it is whole, with
            nothing outside of the region.
        is_blurred: whether the view is, by its lens or by motion.
    """

    width: int
    height: int
    left: int
    bottom: int
    right: int
    top: int
    is_cropped: bool = False
    is_blurred: bool = False

    @property
    def margin(self) -> int:
        """Pixels on each side that are drawn beside the region."""
        return _MARGIN_OF_BLUR if self.is_blurred else _MARGIN

    @property
    def edges(self) -> tuple[int, int, int, int]:
        """Left, bottom, right and top, pixels."""
        return self.left, self.bottom, self.right, self.top

    def of(self, whole: View) -> View:
        """What is drawn of a whole picture's view: the region and its margin."""
        m = self.margin
        return whole.region(self.left - m, self.bottom - m, self.right + m, self.top + m)

    def cut(self, drawn: NDArray[np.float32]) -> NDArray[np.float32]:
        """(h, w, C), the region alone, of what was drawn (h + 2 margins, w + 2 margins, C)."""
        return drawn[self.margin : -self.margin, self.margin : -self.margin]

    def picture(self, drawn: NDArray[np.float32], empty: ArrayLike = 0.0) -> NDArray[np.float32]:
        """The picture that is made of what was drawn.

        Args:
            drawn: (h + 2 margins, w + 2 margins, C).
            empty: a pixel's (C,) values outside of the region.

        Returns:
            (h, w, C) or, whole, (height, width, C).
        """
        inside = self.cut(drawn)
        if self.is_cropped:
            return inside
        whole = np.empty((self.height, self.width, drawn.shape[-1]), dtype=np.float32)
        whole[:] = empty
        whole[self.bottom : self.top, self.left : self.right] = inside
        return whole
