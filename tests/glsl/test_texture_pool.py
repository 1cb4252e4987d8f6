# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures are given again once nobody holds them, and never before."""

from __future__ import annotations

from addon.glsl.texture_pool import TexturePool


class Made:
    """Stands for a texture."""


def test_only_what_nobody_holds_is_given_again() -> None:
    pool = TexturePool()
    first = pool.take(8, 4, "RGBA32F", Made)
    other = pool.take(8, 4, "RGBA32F", Made)
    assert other is not first
    also = [first]
    known = id(first)
    del first
    assert id(pool.take(8, 4, "RGBA32F", Made)) not in (known, id(other))
    also.clear()
    # Of another size or format it is not.
    kept = [pool.take(4, 8, "RGBA32F", Made), pool.take(8, 4, "RG32F", Made)]
    assert known not in [id(each) for each in kept]
    held = [pool.take(8, 4, "RGBA32F", Made) for _ in range(2)]
    again = {id(texture) for texture in held}
    assert known in again
    assert len(again) == len(held)
    assert id(other) not in again


def test_idle_textures_have_a_budget() -> None:
    """The oldest go first; what somebody holds does not count."""
    gone: list[str] = []

    class Told:
        def __init__(self, name: str) -> None:
            self.name = name

        def __del__(self) -> None:
            gone.append(self.name)

    # 16, 8, 4, 8 and 4 bytes a texel.
    formats = ("RGBA32F", "RG32F", "R32F", "RGBA16F", "DEPTH_COMPONENT32F")
    pool = TexturePool(16 * 10 + 1)
    held = [pool.take(10, 1, each, lambda each=each: Told(each)) for each in formats]  # type: ignore[misc]
    pool.take(1, 1, "R8", Made)
    assert not gone
    held.clear()
    pool.take(1, 1, "R16", Made)
    # The last three take 160 bytes and the small one 1; a fourth would be too much.
    assert gone == ["RG32F", "RGBA32F"]
    pool.clear()
    assert sorted(gone) == sorted(formats)
