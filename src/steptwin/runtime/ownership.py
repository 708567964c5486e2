"""Lock files: of what one process at a time may have. POSIX only (flock)."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from steptwin.errors import Misuse


class InUse(Misuse):
    """Somebody else owns it; ``owner`` is a process in words."""

    def __init__(self, path: Path, owner: str) -> None:
        self.owner = owner
        super().__init__(f"{path} is in use by {owner}")


class Ownership:
    """A lock on the file ``path`` until `release`. The kernel gives it free when the process ends, however it ends.

    Raises `InUse` when another process (or another `Ownership`) has it, `OSError` when the file cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        while True:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
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
            return os.path.samestat(os.fstat(self._file), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self, *, remove: bool = True) -> None:
        """Give it free. ``remove`` takes the file away too."""
        if self._file < 0:
            return
        if remove and self._is_at_path():
            self.path.unlink()
        os.close(self._file)
        self._file = -1
