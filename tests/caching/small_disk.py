# SPDX-License-Identifier: GPL-3.0-or-later
"""A real file system of few bytes, mounted where only the processes that run on it see it."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

_MEMORY = "mount -t tmpfs -o size={size} relume {disk}"
_IMAGE = (
    "truncate -s {size} {disk}.image && mkfs.ext4 -q -m 0 {disk}.image "
    "&& mount -o loop {disk}.image {disk}"
)

# The first that the system permits: in memory, for anyone or for root; a file as a disk.
_WAYS = ((("unshare", "-rm"), _MEMORY), (("unshare", "-m"), _MEMORY), (("unshare", "-m"), _IMAGE))


def on_a_small_disk(
    disk: Path, size: int, command: Sequence[object]
) -> subprocess.CompletedProcess[str]:
    """Run a command that finds a file system of so many bytes at `disk`, an empty folder.

    Skips the test where nobody may mount one.
    """
    reasons = []
    for isolated, how in _WAYS:
        mount = how.format(size=size, disk=disk)
        script = f'{mount} || exit 97; exec "$@"'
        words = [*isolated, "sh", "-c", script, "sh", *map(str, command)]
        try:
            run = subprocess.run(words, capture_output=True, text=True, timeout=250, check=False)
        except FileNotFoundError as error:
            reasons.append(str(error))
            continue
        if run.returncode != 97 and "unshare failed" not in run.stderr:
            return run
        reasons.append(run.stderr.strip().splitlines()[-1] if run.stderr else "no reason told")
    pytest.skip(f"no small file system can be mounted: {'; '.join(reasons)}")
