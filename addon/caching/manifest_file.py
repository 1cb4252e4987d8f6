# SPDX-License-Identifier: GPL-3.0-or-later
"""The manifest on the disk: a sealed JSON file, which says what form its cache has."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..whole_file import replacing
from .file_record import BAKE_AGAIN, unreadable
from .manifest import Manifest
from .manifest_seal import has_seal, is_sealed, sealed

SCHEMA = "relume-cache"
SCHEMA_VERSION = 2
MANIFEST_NAME = "manifest.json"


def write_manifest(folder: Path, manifest: Manifest, remedy: str) -> None:
    """Replace the manifest in a cache's folder.

    Raises:
        InputError: it cannot be written; the message ends with the `remedy`.
    """
    values = {"schema": SCHEMA, "version": SCHEMA_VERSION, **manifest.to_json()}
    text = json.dumps(sealed(values), indent=1) + "\n"
    with replacing(folder / MANIFEST_NAME, remedy) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_manifest(folder: Path) -> Manifest:
    """The manifest in a cache's folder.

    Raises:
        InputError: there is none, or it is of another version, damaged or unreadable.
    """
    path = folder / MANIFEST_NAME
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{folder} holds no Relume cache; bake one there first") from error
    except OSError as error:
        raise unreadable(path, error) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is damaged ({error}); {BAKE_AGAIN}") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise InputError(f"{path} is not a Relume cache's manifest; choose another folder")
    _require_version(path, data.get("version"))
    if not has_seal(data):
        raise InputError(
            f"{path} has no seal: a version of Relume wrote it that is older than this one; "
            f"{BAKE_AGAIN}"
        )
    if not is_sealed(data):
        raise InputError(f"{path} is damaged: it was changed after it was written; {BAKE_AGAIN}")
    try:
        return Manifest.from_json(data)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        # The seal says that it is what was written.
        raise InputError(
            f"{path} was written by another version of Relume, older or newer than this one, "
            f"which does not know its form ({error!r}); {BAKE_AGAIN}"
        ) from error


def _require_version(path: Path, version: Any) -> None:
    """Raises InputError for another version than this Relume's."""
    if version == SCHEMA_VERSION:
        return
    if not isinstance(version, int) or isinstance(version, bool):
        raise InputError(f"{path} is damaged: it has the version {version!r}; {BAKE_AGAIN}")
    newer = version > SCHEMA_VERSION
    raise InputError(
        f"{path} is of {'a newer' if newer else 'an older'} version of Relume: the cache has form "
        f"{version}, and this Relume reads form {SCHEMA_VERSION}; "
        + (f"update Relume, or {BAKE_AGAIN}" if newer else BAKE_AGAIN)
    )
