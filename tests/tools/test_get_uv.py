# SPDX-License-Identifier: GPL-3.0-or-later
"""The first thing that runs on a fresh machine, without any network here."""

from __future__ import annotations

import ast
import hashlib
import io
import json
import os
import platform
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tools import get_uv

SCRIPT = Path(get_uv.__file__)
FILENAME = f"uv-{get_uv.PINNED}-py3-none-{get_uv.WHEEL_TAG['x86_64']}.whl"


def fake_uv(folder: Path, version: str) -> Path:
    program = folder / "uv"
    folder.mkdir(parents=True, exist_ok=True)
    program.write_text(f"#!/bin/sh\necho uv {version}\n")
    program.chmod(0o755)
    return program


def wheel_bytes() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        script = f"#!/bin/sh\necho uv {get_uv.PINNED}\n"
        archive.writestr(f"uv-{get_uv.PINNED}.data/scripts/uv", script)
    return buffer.getvalue()


def test_it_is_written_for_python_3_9() -> None:
    ast.parse(SCRIPT.read_text(), feature_version=(3, 9))


@pytest.mark.parametrize(
    ("version", "good"), [("0.13.0", True), ("1.0.1", True), ("0.4.30", False), ("x", False)]
)
def test_only_a_uv_that_understands_the_lock_file_is_taken(
    tmp_path: Path, version: str, good: bool
) -> None:
    assert get_uv.usable(fake_uv(tmp_path, version)) is good


def test_a_good_uv_on_path_is_printed(tmp_path: Path) -> None:
    uv = fake_uv(tmp_path, get_uv.PINNED)
    environment = os.environ | {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    run = subprocess.run(
        [sys.executable, SCRIPT], env=environment, capture_output=True, text=True, check=True
    )
    assert run.stdout == f"{uv}\n"


def serve(folder: Path, wheel: bytes, sha256: str) -> str:
    """A package index in a folder, as a file: address."""
    (folder / "uv").mkdir()
    (folder / FILENAME).write_bytes(wheel)
    entry = {"filename": FILENAME, "url": f"../{FILENAME}", "hashes": {"sha256": sha256}}
    # `file:` addresses have no default page, so the folder's page is a file of its own.
    (folder / "uv" / "page").write_text(json.dumps({"files": [entry]}))
    return folder.as_uri()


@pytest.fixture
def offline(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(get_uv, "PAGE", "/uv/page")
    for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL"):
        monkeypatch.delenv(name, raising=False)
    return monkeypatch


def test_the_wheel_is_unpacked(tmp_path: Path, offline: pytest.MonkeyPatch) -> None:
    wheel = wheel_bytes()
    url = serve(tmp_path, wheel, hashlib.sha256(wheel).hexdigest())
    offline.setenv("PIP_INDEX_URL", url)
    assert get_uv.from_wheel(tmp_path / ".uv")
    assert get_uv.usable(tmp_path / ".uv" / "bin" / "uv")


def test_a_wheel_with_another_hash_is_refused(
    tmp_path: Path, offline: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    offline.setenv("PIP_INDEX_URL", serve(tmp_path, wheel_bytes(), "0" * 64))
    assert not get_uv.from_wheel(tmp_path / ".uv")
    assert "SHA-256" in capsys.readouterr().err
    assert not (tmp_path / ".uv").exists()


def test_an_unreachable_index_is_said(
    tmp_path: Path, offline: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    offline.setenv("PIP_INDEX_URL", (tmp_path / "absent").as_uri())
    assert not get_uv.from_wheel(tmp_path / ".uv")
    assert "could not download uv" in capsys.readouterr().err
