"""The runtime directory of a user: control endpoints, links to pseudo terminals, locks."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.system import is_own, user


def runtime_directory() -> Path:
    """The directory of control endpoints and pty links of this user's twins; it need not exist.

    ``XDG_RUNTIME_DIR`` on Linux, ``LOCALAPPDATA`` on Windows, which are private to the user; otherwise, as on macOS, a directory
    for temporary files.
    """
    for variable in ("XDG_RUNTIME_DIR", "LOCALAPPDATA"):
        base = os.environ.get(variable)
        if base:
            return Path(base) / "steptwin"
    number = user()
    return Path(tempfile.gettempdir()) / ("steptwin" if number is None else f"steptwin-{number}")


def private_directory(path: Path) -> Path:
    """Make ``path`` private to this user. Raises `Misuse` if it is not a directory or belongs to another user."""
    path.mkdir(mode=0o700, parents=True, exist_ok=True)
    if permissions(path) & 0o077:
        path.chmod(0o700)
    return path


NO_DIRECTORY = Message("live.no-directory", "{path} is not a directory")
DIRECTORY_OF_ANOTHER = Message("live.directory-of-another", "{path} belongs to another user")


def permissions(path: Path) -> int:
    """The permission bits of a directory; 0o700 where they mean nothing (Windows: access follows the directory above).

    Raises `Misuse` if it is not a directory or belongs to another user.
    """
    found = path.lstat()
    if not stat.S_ISDIR(found.st_mode):
        raise Misuse(NO_DIRECTORY(path=path))
    if not is_own(found):
        raise Misuse(DIRECTORY_OF_ANOTHER(path=path))
    return 0o700 if user() is None else stat.S_IMODE(found.st_mode)
