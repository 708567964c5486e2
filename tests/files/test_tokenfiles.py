"""Files of tokens, by who can read them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tokens import tokens_file

from steptwin.access.roles import Role
from steptwin.access.tokens import Token
from steptwin.errors import Misuse
from steptwin.files.tokenfiles import tokens_in

TEXT = "engineer anna anna-0123456789abcdef\n"


@pytest.mark.parametrize("mode", [0o600, 0o400, 0o700])
def test_a_file_of_the_owner_alone_is_taken(mode: int, tmp_path: Path) -> None:
    assert tokens_in(tokens_file(tmp_path, TEXT, mode)) == (Token(Role.ENGINEER, "anna", "anna-0123456789abcdef"),)


@pytest.mark.parametrize("mode", [0o604, 0o640, 0o644, 0o620, 0o602, 0o666])
def test_a_file_that_others_can_read_or_change_is_refused(mode: int, tmp_path: Path) -> None:
    path = tokens_file(tmp_path, TEXT, mode)
    with pytest.raises(Misuse) as refused:
        tokens_in(path)
    message = f"{path}: other users can read or change these tokens (mode {mode:04o}): chmod 600 {path}"
    assert str(refused.value) == message


@pytest.mark.parametrize(("mode", "is_taken"), [(0o400, True), (0o640, True), (0o644, False), (0o660, False)])
def test_the_administrator_may_let_the_group_of_a_service_read(
    mode: int, is_taken: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if os.getuid() != 0:
        pytest.skip("only the administrator can make such a file")
    path = tokens_file(tmp_path, TEXT, mode)
    monkeypatch.setattr("steptwin.system.user", lambda: 65534)
    if is_taken:
        assert tokens_in(path)
    else:
        with pytest.raises(Misuse, match="chmod"):
            tokens_in(path)


def test_what_is_wrong_in_it_is_named_with_its_path(tmp_path: Path) -> None:
    path = tokens_file(tmp_path, "boss x 0123456789abcdef\n")
    with pytest.raises(Misuse, match=f"^{path}, line 1: no role 'boss'"):
        tokens_in(path)
    with pytest.raises(Misuse, match="no-such-file"):
        tokens_in(tmp_path / "no-such-file")
