"""The recordings in a folder."""

from __future__ import annotations

import contextlib
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.files.loader import RECORDING_SUFFIX
from steptwin.messages import Message
from steptwin.system import reason

MOST = 200
"""The newest ones."""
HEAD_BYTES = 20_000
"""The part of a recording with its format and its end."""
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,79}")
NAME_FORM = "1 to 80 letters, digits, '-', '_' and '.', the first no '-' and no '.'"
_UNTIL = re.compile(rb'"until_ns": (\d{1,25})')


class SavedRecording(NamedTuple):
    name: str
    """That of the file, without its suffix."""
    size: int
    """Bytes."""
    saved: str
    """ISO 8601."""
    until: Nanos


def saved_recordings(folder: Path) -> list[SavedRecording]:
    """The newest first. Files that are no recordings, or cannot be read, are left out."""
    found: list[SavedRecording] = []
    for path in folder.glob(f"*{RECORDING_SUFFIX}"):
        with contextlib.suppress(Misuse):
            found.append(read_saved(path))
    return sorted(found, key=lambda one: one.saved, reverse=True)[:MOST]


CANNOT_READ_RECORDING = Message("files.cannot-read-recording", "cannot read {path}: {why}")
NO_RECORDING_OF_A_WORLD = Message("files.no-recording-of-a-world", "{path} is not a recording of a world")


def read_saved(path: Path) -> SavedRecording:
    """From the head of a file. Raises `Misuse` where it is no recording, or cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
        about = path.stat()
    except OSError as error:
        raise Misuse(CANNOT_READ_RECORDING(path=path, why=reason(error))) from error
    until = _UNTIL.search(head)
    if b'"steptwin_session"' not in head or until is None:
        raise Misuse(NO_RECORDING_OF_A_WORLD(path=path))
    at = datetime.fromtimestamp(about.st_mtime, UTC).isoformat(timespec="milliseconds")
    return SavedRecording(path.stem, about.st_size, at, int(until[1]))


WRONG_NAME_OF_A_RECORDING = Message("files.wrong-name-of-a-recording", "name = {name!r}: permitted are {form}")


def usual_name(stem: str, at: datetime) -> str:
    """The name of a recording that has been given none. ``stem``: a name of its world, in which other characters become '_'."""
    return f"{re.sub(r'[^A-Za-z0-9_.-]|^[.-]', '_', stem)[:60]}-{at:%Y%m%d-%H%M%S}"


def path_of(folder: Path, name: str) -> Path:
    """Where the recording called ``name`` is, or would be. Raises `Misuse` for what is no name."""
    if not NAME.fullmatch(name):
        raise Misuse(WRONG_NAME_OF_A_RECORDING(name=name, form=NAME_FORM))
    return folder / f"{name}{RECORDING_SUFFIX}"
