"""The directory of running twins: private to the user, wherever the system keeps such directories."""

from __future__ import annotations

import os
import stat
import tempfile
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.live.directory import permissions, private_directory, runtime_directory


@pytest.fixture
def own_directory(tmp_path: Path) -> Path:
    return tmp_path / "steptwin"


def test_a_directory_that_is_none_or_somebody_elses(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = own_directory.with_name("elsewhere")
    elsewhere.mkdir()
    own_directory.symlink_to(elsewhere)
    with pytest.raises(Misuse, match="is not a directory"):
        private_directory(own_directory)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    with pytest.raises(Misuse, match="belongs to another user"):
        private_directory(elsewhere)


def test_a_directory_others_could_enter_is_closed_to_them(own_directory: Path) -> None:
    own_directory.mkdir(mode=0o777)
    own_directory.chmod(0o777)
    private_directory(own_directory)
    assert stat.S_IMODE(own_directory.stat().st_mode) == 0o700


@pytest.mark.parametrize("variable", ["XDG_RUNTIME_DIR", "LOCALAPPDATA"])
def test_the_directory_a_system_has_for_it(variable: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    monkeypatch.setenv(variable, str(tmp_path))
    assert runtime_directory() == tmp_path / "steptwin"


def test_otherwise_the_directory_is_the_users_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.delenv("LOCALAPPDATA", raising=False)
    assert runtime_directory() == Path(tempfile.gettempdir()) / f"steptwin-{os.getuid()}"


def test_where_users_have_no_numbers_and_permissions_no_meaning(own_directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.delattr(os, "getuid")
    assert runtime_directory() == Path(tempfile.gettempdir()) / "steptwin"
    own_directory.mkdir()
    own_directory.chmod(0o777)
    assert permissions(private_directory(own_directory)) == 0o700
