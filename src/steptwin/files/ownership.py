"""Lock files for resources that one process at a time may use."""

from __future__ import annotations

import contextlib
import os
import stat
from errno import ELOOP, EPERM
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.locks import lock, unlock
from steptwin.system import LOCK_FLAGS, is_own


class InUse(Misuse):
    """Another process owns it; ``owner`` describes that process."""

    def __init__(self, path: Path, owner: str) -> None:
        self.owner = owner
        super().__init__(f"{path} is in use by {owner}")


def _open(path: Path) -> int:
    """A lock file of this user, opened or made. Raises `OSError`."""
    try:
        file = os.open(path, LOCK_FLAGS, 0o644)
    except OSError as error:
        if error.errno == ELOOP:
            raise PermissionError(EPERM, f"the lock file {path} is a symbolic link") from None
        raise
    found = os.fstat(file)
    # A second name of the file would be a link as well.
    if is_own(found) and stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:
        return file
    os.close(file)
    raise PermissionError(EPERM, f"{path} is not a lock file of this user")


def _content(file: int) -> bytes:
    os.lseek(file, 0, os.SEEK_SET)
    return os.read(file, 32)


class Ownership:
    """A lock on the file ``path`` until `release`. The system releases it at any end of the process.

    Raises `InUse` when another process (or another `Ownership`) has it, `OSError` when the file cannot be made, is a link or
    belongs to another user: what is written into a lock file must not go elsewhere.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        while True:
            self._file = _open(path)
            try:
                lock(self._file)
            except BlockingIOError:
                number = _content(self._file).decode("ascii", "replace").strip()
                os.close(self._file)
                raise InUse(path, f"process {number}" if number else "another process") from None
            if self._is_at(self._file):
                break
            os.close(self._file)  # its last owner removed it between our two calls
        self.left_behind = os.fstat(self._file).st_size > 0
        """Whether the last owner did not end cleanly."""
        os.ftruncate(self._file, 0)
        os.lseek(self._file, 0, os.SEEK_SET)
        os.write(self._file, b"%d\n" % os.getpid())

    def _is_at(self, file: int) -> bool:
        """Whether the open file is still the one at the path."""
        try:
            return os.path.samestat(os.fstat(file), os.lstat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Release it and remove the file."""
        if self._file < 0:
            return
        file, self._file = self._file, -1
        is_removed = not self._is_at(file)
        if not is_removed:
            os.ftruncate(file, 0)
            with contextlib.suppress(PermissionError, FileNotFoundError):  # Windows removes no open files; somebody else has
                self.path.unlink()
                is_removed = True
        unlock(file)
        os.close(file)
        if not is_removed:
            with contextlib.suppress(OSError):  # another process has it by now
                self.path.unlink()
