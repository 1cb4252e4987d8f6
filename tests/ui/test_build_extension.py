# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

from tools.build_extension import ROOT, SOURCE, build_extension
from tools.extension_wheels import WHEELS, PinnedWheel, fetch_wheels


def toml(path: Path) -> dict[str, Any]:
    with path.open("rb") as file:
        return tomllib.load(file)


def test_blender_accepts_the_zip_and_all_of_it_is_there(tmp_path: Path) -> None:
    wheel = tmp_path / "nothing-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("nothing-1.0.dist-info/RECORD", "")
    target = build_extension(tmp_path / "dist", [wheel])
    with zipfile.ZipFile(target) as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert manifest["wheels"] == [f"./wheels/{wheel.name}"]
    sources = {
        str(path.relative_to(SOURCE))
        for path in SOURCE.rglob("*")
        if path.suffix in {".py", ".glsl"} and "wheels" not in path.parts
    }
    assert sources | {"LICENSE", f"wheels/{wheel.name}"} <= names
    assert not [name for name in names if "__pycache__" in name]
    # What was staged on the way is gone.
    assert [path.name for path in (tmp_path / "dist").iterdir()] == [target.name]


def test_a_bad_manifest_is_refused_and_leaves_no_zip(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "addon"
    source.mkdir()
    text = (SOURCE / "blender_manifest.toml").read_text(encoding="utf-8")
    bad = text.replace('type = "add-on"', 'type = "sausage"')
    assert bad != text
    (source / "blender_manifest.toml").write_text(bad, encoding="utf-8")
    monkeypatch.setattr("tools.build_extension.SOURCE", source)
    with pytest.raises(RuntimeError, match="sausage"):
        build_extension(tmp_path / "dist", [])
    assert list((tmp_path / "dist").iterdir()) == []


def test_one_version_everywhere() -> None:
    manifest = toml(SOURCE / "blender_manifest.toml")
    assert manifest["version"] == toml(ROOT / "pyproject.toml")["project"]["version"]


def test_the_wheels_are_those_that_are_tested() -> None:
    """The tests run with uv.lock's versions; for Python 3.13 with the very same files."""
    locked = {package["name"]: package for package in toml(ROOT / "uv.lock")["package"]}
    for wheel in WHEELS:
        assert locked[wheel.name]["version"] == wheel.version
        if wheel.python == "313":
            hashes = {entry["hash"] for entry in locked[wheel.name]["wheels"]}
            assert f"sha256:{wheel.sha256}" in hashes
    # Blender's own download ships numpy; nothing else that is needed.
    assert {w.name for w in WHEELS if w.python == "314"} == {"embreex", "numpy", "openexr", "scipy"}
    assert {w.name for w in WHEELS if w.python == "313"} == {"embreex", "openexr", "scipy"}


def test_a_damaged_wheel_is_not_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wheel = PinnedWheel("nothing", "1.0", "313", "0" * 64)
    (tmp_path / "nothing-1.0-cp313-cp313-manylinux_2_28_x86_64.whl").write_bytes(b"other")
    assert wheel.find(tmp_path) is None
    monkeypatch.setattr("tools.extension_wheels._download", lambda *_: None)
    with pytest.raises(RuntimeError, match=r"nothing 1\.0"):
        fetch_wheels(tmp_path, (wheel,))
