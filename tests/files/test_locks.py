"""Locks by flock and by what Windows has for it, for which `other_system` has a stand-in."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import pytest
from other_system import msvcrt_stand_in

from steptwin.files import locks
from steptwin.files.locks import lock, unlock
from steptwin.files.ownership import InUse, Ownership


@pytest.fixture(params=["flock", "msvcrt"], autouse=True)
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "msvcrt":
        monkeypatch.setitem(sys.modules, "msvcrt", msvcrt_stand_in())
        monkeypatch.setattr(locks, "fcntl", None)


@contextmanager
def opened(path: Path) -> Generator[int]:
    file = os.open(path, os.O_RDWR | os.O_CREAT)
    try:
        yield file
    finally:
        os.close(file)


def test_a_file_is_locked_once(tmp_path: Path) -> None:
    with opened(tmp_path / "lock") as one, opened(tmp_path / "lock") as other:
        lock(one)
        with pytest.raises(BlockingIOError):
            lock(other)
        assert os.read(other, 1) == b""  # others read it all the same


def test_a_closed_file_can_be_locked_by_another(tmp_path: Path) -> None:
    with opened(tmp_path / "lock") as other, opened(tmp_path / "lock") as third:
        with opened(tmp_path / "lock") as one:
            lock(one)
            unlock(one)
        lock(other)
        with pytest.raises(BlockingIOError):
            lock(third)


def test_an_owner_is_named_and_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    owned = Ownership(path)
    with pytest.raises(InUse, match=f"in use by process {os.getpid()}"):
        Ownership(path)
    owned.release()
    assert list(tmp_path.iterdir()) == []
    again = Ownership(path)
    assert not again.left_behind
    again.release()


def test_a_file_that_is_open_cannot_be_removed_on_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is removed when it has been closed."""
    path = tmp_path / "lock"
    owned = Ownership(path)
    remove = Path.unlink
    tries: list[Path] = []

    def refuse_once(self: Path, missing_ok: bool = False) -> None:
        tries.append(self)
        if len(tries) == 1:
            raise PermissionError(13, "The process cannot access the file because it is being used by another process")
        remove(self, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse_once)
    owned.release()
    assert (tries, path.exists()) == ([path, path], False)
