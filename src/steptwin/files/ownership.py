"""Lock files: of what one process at a time may have. POSIX only (flock)."""

from __future__ import annotations

import fcntl
import os
import stat
from errno import ELOOP, EPERM
from pathlib import Path

from steptwin.errors import Misuse


class InUse(Misuse):
    """Somebody else owns it; ``owner`` is a process in words."""

    def __init__(self, path: Path, owner: str) -> None:
        self.owner = owner
        super().__init__(f"{path} is in use by {owner}")


def _open(path: Path) -> int:
    """A lock file of this user, opened or made. Raises `OSError`."""
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK, 0o644)
    except OSError as error:
        if error.errno == ELOOP:
            raise PermissionError(EPERM, f"the lock file {path} is a symbolic link") from None
        raise
    found = os.fstat(file)
    # A second name of the file would be a link as well.
    if found.st_uid == os.getuid() and stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:
        return file
    os.close(file)
    raise PermissionError(EPERM, f"{path} is no lock file of this user")


class Ownership:
    """A lock on the file ``path`` until `release`. The kernel gives it free when the process ends, however it ends.

    Raises `InUse` when another process (or another `Ownership`) has it, `OSError` when the file cannot be made, is a link or
    belongs to another user: what is written into a lock file must not go elsewhere.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        while True:
            self._file = _open(path)
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                number = os.pread(self._file, 32, 0).decode("ascii", "replace").strip()
                os.close(self._file)
                raise InUse(path, f"process {number}" if number else "another process") from None
            if self._is_at_path():
                break
            os.close(self._file)  # its last owner removed it between our two calls
        self.left_behind = os.fstat(self._file).st_size > 0
        """Whether a process that did not end cleanly had it before."""
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, b"%d\n" % os.getpid(), 0)

    def _is_at_path(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), os.lstat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Give it free and take the file away."""
        if self._file < 0:
            return
        if self._is_at_path():
            self.path.unlink()
        os.close(self._file)
        self._file = -1
