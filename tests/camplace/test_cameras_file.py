# SPDX-License-Identifier: GPL-3.0-or-later
"""The cameras file: every bit back, or a clear sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.camplace.aim import look
from addon.camplace.camera import CachingCamera
from addon.camplace.cameras_file import from_json, read_cameras, to_json, write_cameras
from addon.errors import InputError


def _cameras() -> tuple[CachingCamera, ...]:
    rng = np.random.default_rng(0)
    return tuple(
        CachingCamera(
            id=number,
            world_from_camera=look(rng.normal(size=3) * 1e6, rng.normal(size=3), np.eye(3)[2]),
            fov=float(rng.uniform(0.1, 2.0)),
            near=1e-3 / 3.0,
            far=1e5 / 3.0,
            resolution=512,
            kind="PERSPECTIVE",
            source=number,
        )
        for number in range(3)
    )


def test_round_trip_keeps_every_bit(tmp_path: Path) -> None:
    path = tmp_path / "cameras.json"
    write_cameras(path, _cameras())
    for back, camera in zip(read_cameras(path), _cameras(), strict=True):
        assert back.to_json() == camera.to_json()
        assert (back.world_from_camera == camera.world_from_camera).all()
    assert [p.name for p in tmp_path.iterdir()] == ["cameras.json"]


@pytest.mark.parametrize(
    "change",
    [
        {"schema": "something"},
        {"version": 0},
        {"cameras": []},
        {"cameras": [{"id": 1}]},
        {"cameras": 3},
        {"cameras": None},
    ],
)
def test_what_it_did_not_write_is_refused_by_name(change: dict[str, Any]) -> None:
    data = {**json.loads(json.dumps(to_json(_cameras()))), **change}
    with pytest.raises(InputError, match=r"shot\.json"):
        from_json(data, "shot.json")


def test_two_cameras_of_one_id_are_refused() -> None:
    camera = _cameras()[0]
    with pytest.raises(InputError, match="id"):
        from_json(to_json((camera, camera)), "shot.json")


def test_files_that_are_no_cameras_file(tmp_path: Path) -> None:
    for name, content in (("empty", b""), ("binary", b"\xff\xfe\x00"), ("list", b"[1]")):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(InputError, match=name):
            read_cameras(path)
    with pytest.raises(InputError, match="missing"):
        read_cameras(tmp_path / "missing")


def test_a_place_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_cameras(tmp_path / "no such folder" / "cameras.json", _cameras())
    assert list(tmp_path.iterdir()) == []
