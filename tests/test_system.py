"""What systems have and lack; the lack of all at once is tried in ``tests/test_other_systems.py``."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from steptwin.system import is_own, process_exists, sync_directory, user


def test_processes_that_run_and_one_that_cannot() -> None:
    assert process_exists(os.getpid())
    assert process_exists(os.getppid())
    assert not process_exists(2**22 + 1)  # above the highest process id


def test_a_process_of_another_user_exists(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(number: int, signal: int) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "kill", refuse)
    assert process_exists(4711)


def test_files_of_this_user_and_of_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = tmp_path.stat()
    assert is_own(found)
    monkeypatch.setattr(os, "getuid", lambda: found.st_uid + 1)
    assert not is_own(found)
    monkeypatch.delattr(os, "getuid")
    assert user() is None
    assert is_own(found)


def test_directories_are_synced_where_they_can_be_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []
    monkeypatch.setattr(os, "fsync", synced.append)
    sync_directory(tmp_path)
    assert len(synced) == 1
    monkeypatch.delattr(os, "O_DIRECTORY")
    sync_directory(tmp_path)
    assert len(synced) == 1
