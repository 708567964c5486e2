"""One owner at a time, found out without asking him."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from steptwin.files.ownership import InUse, Ownership

HOLD = """
import sys
from pathlib import Path
from steptwin.files.ownership import Ownership
owned = Ownership(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_the_second_is_told_who_the_first_is(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    first = Ownership(path)
    with pytest.raises(InUse) as refusal:
        Ownership(path)
    assert str(refusal.value) == f"{path} is in use by process {os.getpid()}"
    first.release()
    Ownership(path).release()


def test_release_removes_the_file(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    owned = Ownership(path)
    owned.release()
    assert not path.exists()
    owned.release()


def test_a_killed_owner_has_left_it_behind(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    command = [sys.executable, "-c", HOLD, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as owner:
        assert owner.stdout is not None
        assert owner.stdout.readline() == "held\n"
        with pytest.raises(InUse, match=f"process {owner.pid}"):
            Ownership(path)
        owner.kill()
    owned = Ownership(path)
    assert owned.left_behind
    owned.release()


def test_a_new_file_was_not_left_behind(tmp_path: Path) -> None:
    owned = Ownership(tmp_path / "lock")
    assert not owned.left_behind
    owned.release()


def test_a_lock_on_a_file_that_was_removed_meanwhile_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The owner removes the file between our opening and our locking it; a third one may have made it anew."""
    path = tmp_path / "lock"
    opened = os.open
    replaced: list[int] = []

    def open_then_replace(*arguments: object, **options: object) -> int:
        file = opened(*arguments, **options)  # type: ignore[arg-type]
        if not replaced:
            path.unlink()
            path.write_text("")
            replaced.append(file)
        return file

    monkeypatch.setattr(os, "open", open_then_replace)
    owned = Ownership(path)
    assert path.read_text() == f"{os.getpid()}\n"
    owned.release()


def test_a_lock_file_that_is_a_link_is_refused_and_its_target_untouched(tmp_path: Path) -> None:
    target = tmp_path / "precious"
    target.write_text("precious")
    (tmp_path / "soft").symlink_to(target)
    (tmp_path / "hard").hardlink_to(target)
    (tmp_path / "nowhere").symlink_to(tmp_path / "new")
    for name, message in (("soft", "is a symbolic link"), ("hard", "is not a lock file"), ("nowhere", "is a symbolic link")):
        with pytest.raises(PermissionError, match=message):
            Ownership(tmp_path / name)
    assert target.read_text() == "precious"
    assert not (tmp_path / "new").exists()


def test_a_lock_file_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lock").write_text("")
    owner = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.raises(PermissionError, match="is not a lock file of this user"):
        Ownership(tmp_path / "lock")


def test_a_lock_file_that_is_a_pipe_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "lock")
    with pytest.raises(PermissionError, match="is not a lock file of this user"):
        Ownership(tmp_path / "lock")
