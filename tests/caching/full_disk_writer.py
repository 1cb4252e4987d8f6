# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a cache where there is less and less room, and checks it each time.

    python -m tests.caching.full_disk_writer DISK

DISK is a small file system. Ends with 0 if all held; says how many writes failed and how many
succeeded.
"""

from __future__ import annotations

import sys
from pathlib import Path

from addon.caching.store import CacheStore
from addon.errors import InputError

from .killed_writer import COUNT, begun, generation_of, picture

# What these file systems give away at once.
PAGE = 4096


def _leave(disk: Path, pages: int) -> None:
    """Fill the disk but for so many pages."""
    filling = disk / "filling"
    filling.unlink(missing_ok=True)
    with filling.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(PAGE))
        except OSError:
            size = file.tell()
        file.truncate(max(0, size - pages * PAGE))


def _is_refused(folder: Path, number: int, generation: int) -> bool:
    """Whether a camera cannot be written for want of room, which must be said clearly."""
    try:
        CacheStore.open(folder).add_camera(picture(number, generation))
    except InputError as error:
        text = str(error)
        assert str(folder) in text
        assert "the disk is full; free some space and do this again" in text
        assert "\n" not in text
        return True
    return False


def _main(disk: Path) -> None:
    folder = disk / "cache"
    store = begun(folder)
    for number in (0, 1):
        store.add_camera(picture(number, 1))
    now, refused, written = 1, 0, 0
    pages = 0
    # From no room at all to enough for a new picture and a new manifest.
    while written < 3:
        _leave(disk, pages)
        pages += 1
        if _is_refused(folder, 0, now + 1):
            refused += 1
        else:
            now, written = now + 1, written + 1
        assert not list(folder.rglob(".*.part"))
        again = CacheStore.open(folder)
        assert [generation_of(again, number) for number in (0, 1)] == [now, 1]
    assert refused > 3
    # A bake that goes on until there is no more room, and then with room again.
    (disk / "filling").unlink()
    _leave(disk, 2 * pages)
    store = begun(folder, resume=True)
    failed = next(n for n in range(2, COUNT) if _is_refused(folder, n, 1))
    done = {number: now if number == 0 else 1 for number in range(failed)}
    assert set(CacheStore.open(folder).manifest.finished) == set(done)
    (disk / "filling").unlink()
    store = begun(folder, resume=True)
    assert {number: generation_of(store, number) for number in store.manifest.finished} == done
    for number in range(failed, COUNT):
        store.add_camera(picture(number, 1))
    assert len(CacheStore.open(folder).cameras) == COUNT
    assert len(list((folder / "cameras").iterdir())) == COUNT
    print(f"{refused} refused, {written} written")


if __name__ == "__main__":
    _main(Path(sys.argv[1]))
