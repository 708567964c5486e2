"""The one folder in which clients of a service may have files written. Their user may not be the one whose files these are."""

from __future__ import annotations

from pathlib import Path

from steptwin.errors import Misuse
from steptwin.inputfiles import format_path
from steptwin.messages import Message
from steptwin.system import reason

NOT_IN_THE_FOLDER = Message("files.not-in-the-folder", "cannot write {path}: {why}")
ONLY_INTO_THE_FOLDER = Message("files.only-into-the-folder", "cannot write {path}: requests write into {folder} only")
NOT_THROUGH_A_LINK = Message("files.not-through-a-link", "cannot write {path}: it is a link, and requests write through none")


def path_in_folder(folder: Path, name: str) -> Path:
    """The path of the file ``name`` in ``folder`` or below it; ``name`` may be absolute.

    Raises `Misuse` for a place elsewhere, also one that a link leads to, and for a file that is a link or has a second name.
    """
    path = folder / name
    try:
        parent = path.parent.resolve()
        is_within = parent.is_relative_to(folder.resolve())
        is_circle = any(place.is_symlink() for place in (parent, *parent.parents))  # Python 3.13 leaves it as it is
        is_link = is_circle or path.is_symlink() or (path.is_file() and path.stat().st_nlink > 1)
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        raise Misuse(NOT_IN_THE_FOLDER(path=format_path(path), why=reason(error))) from None
    if not is_within or path.name in ("", ".."):
        raise Misuse(ONLY_INTO_THE_FOLDER(path=format_path(path), folder=folder))
    if is_link:
        raise Misuse(NOT_THROUGH_A_LINK(path=format_path(path)))
    return path
