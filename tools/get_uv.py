#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints the path of a usable `uv`, bringing one into the checkout where there is none.

Run by the Makefile with whatever Python the machine has, before anything is installed: only
the standard library, and nothing newer than Python 3.9. In this order it takes

1. a `uv` on PATH, if it is new enough for the lock file;
2. the one that an earlier run left in `.uv/`;
3. pip's, installed into `.uv/` (pip's own settings choose the index; `--target` touches no
   installed environment, so an externally managed Python, PEP 668, is no obstacle);
4. the wheel itself, from the package index, checked against the index's SHA-256. Debian ships
   Python without pip and ensurepip.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import platform
import shutil
import stat
import subprocess
import sys
import urllib.error
import urllib.parse
import urllib.request
import zipfile
from pathlib import Path
from typing import Any, Optional

PINNED = "0.13.9"
# An older uv may call the lock file, which this series wrote, outdated.
OLDEST = (0, 13)
# Where an index keeps a project's list of files (PEP 503).
PAGE = "/uv/"
FOLDER = Path(__file__).resolve().parent.parent / ".uv"
# The newest manylinux tag that uv is published for, by machine.
WHEEL_TAG = {
    "x86_64": "manylinux_2_17_x86_64.manylinux2014_x86_64",
    "aarch64": "manylinux_2_17_aarch64.manylinux2014_aarch64",
}


def say(message: str) -> None:
    """Tell the person; standard output is for the path alone."""
    print("get_uv: " + message, file=sys.stderr, flush=True)


def version_of(uv: Path) -> Optional[tuple[int, ...]]:
    """The version that this program reports, or None when it does not run or is no uv."""
    try:
        result = subprocess.run(
            [str(uv), "--version"], capture_output=True, text=True, timeout=60, check=True
        )
        name, number = result.stdout.split()[:2]
        return tuple(int(part) for part in number.split(".")[:3]) if name == "uv" else None
    except (OSError, ValueError, subprocess.SubprocessError):
        return None


def usable(uv: Path) -> bool:
    version = version_of(uv)
    return version is not None and version >= OLDEST


def from_pip(target: Path) -> bool:
    """Have pip put uv into `target`; False when there is no pip or it could not."""
    probe = subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True)
    if probe.returncode != 0:
        return False
    say(f"installing uv {PINNED} into {target} with pip")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--no-deps", "--upgrade", "--target", str(target), f"uv=={PINNED}"]
    return subprocess.run(command, stdout=sys.stderr).returncode == 0


def index_url() -> str:
    """The package index that the machine's settings name, else PyPI."""
    for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"):
        if os.environ.get(name):
            return os.environ[name].rstrip("/")
    return "https://pypi.org/simple"


def find_wheel(page: dict[str, Any], filename: str) -> tuple[str, str]:
    """The address and SHA-256 of a file on a PEP 691 index page. Raises LookupError."""
    for entry in page.get("files", []):
        if entry.get("filename") == filename:
            return entry["url"], entry["hashes"]["sha256"]
    raise LookupError(f"the index has no {filename}")


def unpack(wheel: bytes, target: Path) -> None:
    """Write the wheel's uv program to `target`/bin/uv. Raises LookupError without one."""
    with zipfile.ZipFile(io.BytesIO(wheel)) as archive:
        programs = [name for name in archive.namelist() if name.endswith(".data/scripts/uv")]
        if not programs:
            raise LookupError("the wheel holds no uv program")
        place = target / "bin" / "uv"
        place.parent.mkdir(parents=True, exist_ok=True)
        part = place.with_suffix(".part")
        part.write_bytes(archive.read(programs[0]))
        part.chmod(part.stat().st_mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
        part.replace(place)


def from_wheel(target: Path) -> bool:
    """Download the wheel with the standard library; False, with the reason, when it fails."""
    tag = WHEEL_TAG.get(platform.machine())
    if tag is None:
        say(f"uv has no wheel for {platform.machine()}; install uv by hand and put it on PATH")
        return False
    filename = f"uv-{PINNED}-py3-none-{tag}.whl"
    page_url = index_url() + PAGE
    say(f"downloading {filename} from {page_url}")
    request = urllib.request.Request(
        page_url, headers={"Accept": "application/vnd.pypi.simple.v1+json"}
    )
    try:
        with urllib.request.urlopen(request, timeout=120) as answer:
            address, sha256 = find_wheel(json.load(answer), filename)
        with urllib.request.urlopen(urllib.parse.urljoin(page_url, address), timeout=300) as answer:
            wheel = answer.read()
        if hashlib.sha256(wheel).hexdigest() != sha256:
            raise LookupError("the downloaded wheel does not have the index's SHA-256")
        unpack(wheel, target)
    except (OSError, ValueError, LookupError, zipfile.BadZipFile) as error:
        say(f"could not download uv: {error}")
        return False
    return True


def main() -> int:
    """Print the path; 1 when no uv could be had."""
    on_path = shutil.which("uv")
    if on_path and usable(Path(on_path)):
        print(on_path)
        return 0
    local = FOLDER / "bin" / "uv"
    if not usable(local) and not from_pip(FOLDER) and not from_wheel(FOLDER):
        say("no uv: install python3-pip, or put uv (https://docs.astral.sh/uv/) on PATH")
        return 1
    if not usable(local):
        say(f"{local} does not run here; remove {FOLDER} and try again")
        return 1
    print(local)
    return 0


if __name__ == "__main__":
    sys.exit(main())
