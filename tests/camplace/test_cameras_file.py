# SPDX-License-Identifier: GPL-3.0-or-later
"""The cameras file: every bit back, or a clear sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from addon.camplace.aim import look
from addon.camplace.camera import WIDEST, CachingCamera
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


def _matrix(**entries: float) -> list[list[float]]:
    """The identity with some entries changed, such as m03=1.0."""
    matrix = np.eye(4)
    for name, value in entries.items():
        matrix[int(name[1]), int(name[2])] = value
    return matrix.tolist()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"world_from_camera": np.zeros((4, 4)).tolist()}, "not a rotation"),
        ({"world_from_camera": _matrix(m00=2.0)}, "not a rotation"),
        ({"world_from_camera": _matrix(m00=1e300)}, "not a rotation"),
        ({"world_from_camera": _matrix(m00=-1.0)}, "not a rotation"),
        ({"world_from_camera": _matrix(m01=0.001)}, "not a rotation"),
        ({"world_from_camera": _matrix(m30=1.0)}, "not a rotation"),
        ({"world_from_camera": _matrix(m33=2.0)}, "not a rotation"),
        ({"world_from_camera": _matrix(m03=np.nan)}, "finite 4x4"),
        ({"world_from_camera": [[10**400] * 4] * 4}, "finite 4x4"),
        ({"world_from_camera": [[1.0]]}, "4x4"),
        ({"fov": 0.0}, "fov"),
        ({"fov": -1.0}, "fov"),
        ({"fov": 2.2}, "fov"),
        ({"fov": 60.0}, "fov"),
        ({"fov": np.nan}, "fov is not finite"),
        ({"fov": "wide"}, "fov is 'wide'"),
        ({"near": -0.1}, "clips"),
        ({"near": 1e6}, "clips"),
        ({"near": 1e5 / 3.0}, "clips"),
        ({"near": np.nan}, "near is not finite"),
        ({"near": None}, "near is None"),
        ({"far": np.inf}, "far is not finite"),
        ({"far": 10**400}, "far is not finite"),
        ({"far": 0.0}, "clips"),
        ({"resolution": 0}, "resolution"),
        ({"resolution": -512}, "resolution"),
        ({"resolution": 511.5}, "resolution"),
        ({"resolution": np.inf}, "resolution"),
        ({"id": -1}, "id is -1"),
        ({"id": 1.5}, "id is 1.5"),
        ({"id": True}, "id is True"),
        ({"source": -1}, "source"),
        ({"kind": "FISHEYE"}, "kind"),
    ],
)
def test_cameras_that_cannot_be_are_refused(
    change: dict[str, Any], says: str, tmp_path: Path
) -> None:
    data = to_json(_cameras())
    data["cameras"][1].update(change)
    path = tmp_path / "shot.json"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError, match=says) as error:
        read_cameras(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    "change",
    [
        {"fov": float(WIDEST)},
        {"fov": float(np.nextafter(WIDEST, 3.0))},
        {"near": 0.0},
        {"near": 1, "far": 2},
        {"resolution": 1},
        {"world_from_camera": _matrix(m01=1e-5, m03=-1e6)},
    ],
)
def test_cameras_at_the_limits_are_read(change: dict[str, Any]) -> None:
    data = to_json(_cameras())
    data["cameras"][1].update(change)
    assert from_json(data, "shot.json")[1].to_json() == data["cameras"][1]


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
