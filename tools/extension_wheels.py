# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheels that the extension carries, and how they are fetched.

Blender 5.2's own download has Python 3.13 and ships numpy; Debian's has Python 3.14 and
ships none of these. Blender installs only the wheels that fit its own Python.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from addon.progress import Progress, silent

PIP = "pip==26.3"  # uv itself has no command that downloads wheels
PLATFORMS = ("manylinux_2_27_x86_64", "manylinux_2_28_x86_64")


@dataclass(frozen=True)
class PinnedWheel:
    """One wheel file for Linux on x86-64.

    Attributes:
        name: the project's name as in wheel file names, lower case.
        version: the same as in uv.lock.
        python: major and minor version without the dot, as in "cp313".
        sha256: of the file, hexadecimal.
    """

    name: str
    version: str
    python: str
    sha256: str

    def find(self, folder: Path) -> Path | None:
        """The file in this folder, if it is there and undamaged."""
        tag = f"cp{self.python}"
        for path in sorted(folder.glob(f"{self.name}-{self.version}-{tag}-{tag}-*.whl")):
            if hashlib.sha256(path.read_bytes()).hexdigest() == self.sha256:
                return path
        return None


WHEELS = (
    PinnedWheel("embreex", "4.4.0.post1", "313",
                "83165d2bb0436ab9b07d8e7236a0f2509c7868b3a85f2fbd8c41b4d023e88e38"),
    PinnedWheel("embreex", "4.4.0.post1", "314",
                "cb799b02e9b140b6e64a6e5a4caf476494ea12c67828d92709effcec990fc47f"),
    PinnedWheel("numpy", "2.5.5", "314",
                "c48960d420e90cf305cb1fde0d4e6082cc90512cda87a9acf0b6e04e91cf4abe"),
    PinnedWheel("openexr", "3.5.3", "313",
                "0f1c9790e2b57dbbcde9f74d1788e18cb627333066101d63bbfc6be091ff24fa"),
    PinnedWheel("openexr", "3.5.3", "314",
                "dd27c20ccfdcd1d8eade0c35f1c5d4502e2a81fcf78c52130aa55619abd11aa5"),
    PinnedWheel("scipy", "1.18.1", "313",
                "fdaf5ea890a6183d0565f51a61799d67081bd5b1cf03c5f4b3fd3732108625c9"),
    PinnedWheel("scipy", "1.18.1", "314",
                "ac0333bdf38309aa3dcbe7e3fa7ea29e7a2c37c6ea306a757b700ded8e4596ad"),
)  # fmt: skip


def fetch_wheels(
    folder: Path, wheels: tuple[PinnedWheel, ...] = WHEELS, progress: Progress = silent
) -> tuple[Path, ...]:
    """The wheel files, downloading into `folder` those that it lacks.

    Raises:
        RuntimeError: pip could not download one, or it is not the pinned file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    for index, wheel in enumerate(wheels):
        progress(
            index / len(wheels),
            f"{wheel.name} {wheel.version} for CPython {wheel.python[0]}.{wheel.python[1:]}",
        )
        path = wheel.find(folder)
        if path is None:
            _download(wheel, folder)
            path = wheel.find(folder)
        if path is None:
            raise RuntimeError(f"pip left no {wheel.name} {wheel.version} in {folder}")
        found.append(path)
    progress(1.0, "all wheels are there")
    return tuple(found)


def _download(wheel: PinnedWheel, folder: Path) -> None:
    uv = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("get_uv.py"))],
        stdout=subprocess.PIPE, text=True, check=True,
    ).stdout.strip()  # fmt: skip
    with tempfile.TemporaryDirectory() as scratch:
        # Hashes can be given to pip in a file only; --require-hashes refuses any other file.
        requirements = Path(scratch) / "requirements.txt"
        requirements.write_text(
            f"{wheel.name}=={wheel.version} --hash=sha256:{wheel.sha256}\n", encoding="utf-8"
        )
        command = [uv, "tool", "run", "--quiet", "--from", PIP, "pip", "download", "--quiet"]
        command += ["--no-deps", "--require-hashes", "--only-binary", ":all:"]
        command += ["--implementation", "cp", "--abi", f"cp{wheel.python}"]
        command += ["--python-version", wheel.python, "--dest", str(folder)]
        for platform in PLATFORMS:
            command += ["--platform", platform]
        command += ["--requirement", str(requirements)]
        result = subprocess.run(command, stdout=sys.stderr, check=False)
    if result.returncode != 0:
        raise RuntimeError(f"pip could not download {wheel.name} {wheel.version}; see above")
