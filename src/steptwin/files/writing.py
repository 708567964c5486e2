"""Writing of files: every one that steptwin writes is replaced as a whole (`new_content`).

The new content is written beside the file, synced, and renamed onto it: at any moment — ``kill -9``, power loss, full disk — the
old or the new file is there whole. Mode, owner, access control list and attributes of the user are kept, or the file is left
alone. A symbolic link stays one, and its target is replaced; other names of the same file (hard links) keep the old content.
Pipes, devices and open descriptors (``/dev/stdout``) have no old content: they are written directly.

A killed process leaves ``.NUMBER.unfinished`` beside the file. Windows syncs no directories: after power loss the content before
the last write may be there.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import secrets
import stat
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from steptwin.system import HAS_OWNERS, PIPE_FLAGS, WRITE_FLAGS, sync_directory

UNFINISHED = ".unfinished"
"""How the name of a file ends that a killed process has left."""
PRIVATE = 0o600
"""Permissions of a file that only its owner can read."""
MOST_LINKS = 40
"""Symbolic links that lead one to the next; Linux follows as many."""
_ACCESS = "system.posix_acl_access"
_KEPT = (_ACCESS, "system.nfs4_acl", "user.")
"""Beginnings of the names of extended attributes that are kept. The others belong to the system."""


@contextmanager
def new_content(path: Path, permissions: int = 0o666) -> Generator[IO[bytes]]:
    """Open what is the content of ``path`` from the end of the block on. After an error in the block the file is as it was.

    Missing folders are made. ``permissions`` are those of a file that did not exist, less the user's mask. Raises `OSError`, also
    for a file that is write-protected, or lies in a folder that takes no new file.
    """
    if (stream := directly(path)) is not None:
        with stream:
            yield stream
        return
    target = _target(path)
    assert isinstance(target, Path)  # noqa: S101
    old = _stat(target)
    _refuse_protected(target, old)
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_name(f".{secrets.token_hex(8)}{UNFINISHED}")
    number = os.open(unfinished, WRITE_FLAGS | os.O_CREAT | os.O_EXCL, permissions if old is None else PRIVATE)
    try:
        with os.fdopen(number, "wb") as file:
            if old is not None:
                _keep(target, old, number)
            yield file
            file.flush()
            os.fsync(number)
        unfinished.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            unfinished.unlink()
        raise
    sync_directory(target.parent)


@contextmanager
def new_text(path: Path) -> Generator[IO[str]]:
    """`new_content` `as_text`."""
    with new_content(path) as file, as_text(file) as text:
        yield text


@contextmanager
def as_text(file: IO[bytes]) -> Generator[IO[str]]:
    """Write text in UTF-8 to a file that stays open. Line ends are written as they are."""
    text = io.TextIOWrapper(file, "utf-8", newline="")
    try:
        yield text
    finally:
        text.detach()


def remove_unfinished(folder: Path) -> None:
    """Remove what killed processes have left in a folder that belongs to this process alone. Raises `OSError`."""
    for path in folder.glob(f".*{UNFINISHED}"):
        path.unlink(missing_ok=True)


def directly(path: Path) -> IO[bytes] | None:
    """Open a pipe, a device or an open descriptor, without waiting for a program that reads from it; None for a path that names
    none. Raises `OSError`."""
    target = _target(path)
    if isinstance(target, int):
        sys.stdout.flush()  # what was printed before comes first
        return os.fdopen(os.dup(target), "wb")
    old = _stat(target)
    if old is None or stat.S_ISREG(old.st_mode):
        return None
    number = os.open(target, PIPE_FLAGS)
    if hasattr(os, "set_blocking"):
        os.set_blocking(number, True)
    return os.fdopen(number, "wb")


def is_standard_output(path: Path) -> bool:
    """Whether a path names what the standard output of this process is."""
    try:
        target = _target(path)
        found = os.fstat(target) if isinstance(target, int) else target.stat()
        return os.path.samestat(found, os.fstat(1))
    except (OSError, ValueError):  # it is refused when it is written
        return False


def is_written_directly(path: Path) -> bool:
    """Whether a path names a pipe, a device or an open descriptor."""
    try:
        target = _target(path)
        old = None if isinstance(target, int) else _stat(target)
    except OSError:  # it is refused when it is written
        return False
    return isinstance(target, int) or (old is not None and not stat.S_ISREG(old.st_mode) and not stat.S_ISDIR(old.st_mode))


def check_content(path: Path) -> None:
    """Check in advance that `new_content` can begin; missing folders are permitted. Raises `OSError`."""
    target = _target(path)
    if isinstance(target, int):
        return
    old = _stat(target)
    if old is not None and stat.S_ISDIR(old.st_mode):
        raise IsADirectoryError(errno.EISDIR, "a directory")
    if old is not None and not stat.S_ISREG(old.st_mode):
        place = target
    else:
        _refuse_protected(target, old)
        place = next(folder for folder in target.parents if folder.exists())
        if not place.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "not a directory")
    if not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, "not writable")


def _refuse_protected(target: Path, old: os.stat_result | None) -> None:
    """A file that is there must be writable, though it is replaced, and so must its folder. Raises `OSError`."""
    if old is None:
        return
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, "not writable")
    if not os.access(target.parent, os.W_OK):
        raise OSError("it can only be replaced as a whole, and its folder takes no new file")


def _target(path: Path) -> Path | int:
    """Where a name leads through symbolic links: a path that is not one, or the number of an open descriptor."""
    own = {"/dev/fd", f"/proc/{os.getpid()}/fd"}
    for _ in range(MOST_LINKS):
        folder = Path(os.path.realpath(path.parent))
        if str(folder) in own and path.name.isdecimal():
            return int(path.name)
        path = folder / path.name
        if not path.is_symlink():
            return path
        path = folder / path.readlink()
    raise OSError(errno.ELOOP, "symbolic links that lead to each other")


def _stat(target: Path) -> os.stat_result | None:
    try:
        return target.stat()
    except FileNotFoundError:
        return None


def _keep(target: Path, old: os.stat_result, number: int) -> None:
    """Give the new file what the old one has beside its content. Raises `OSError` where that is not possible."""
    if not HAS_OWNERS:
        return
    new = os.fstat(number)
    if (old.st_uid, old.st_gid) != (new.st_uid, new.st_gid):
        try:
            os.fchown(number, old.st_uid, old.st_gid)
        except PermissionError:
            raise OSError(f"its owner {old.st_uid} and group {old.st_gid} could not be kept") from None
    os.fchmod(number, stat.S_IMODE(old.st_mode))
    if not hasattr(os, "listxattr"):
        return
    kept = {name: os.getxattr(target, name) for name in _attributes(target) if name.startswith(_KEPT)}
    if _ACCESS in _attributes(number) and _ACCESS not in kept:
        os.removexattr(number, _ACCESS)  # that of the folder
    for name, value in kept.items():
        try:
            os.setxattr(number, name, value)
        except OSError:
            raise OSError(f"its attribute {name} could not be kept") from None


def _attributes(of: Path | int) -> list[str]:
    """The names of the extended attributes of a file; none where its file system has none."""
    try:
        return os.listxattr(of)
    except OSError as error:
        if error.errno == errno.ENOTSUP:
            return []
        raise
