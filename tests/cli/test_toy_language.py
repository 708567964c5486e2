"""The commands for files with a language that only the tests know: the shell knows it neither."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from shell import Shell
from toy.language import TARGETS, registered_language

from steptwin.errors import Misuse
from steptwin.languages import register
from steptwin.languages.contract import FileLanguage


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("way.targets").write_text("100\n-\n")
    return "way.targets"


def test_it_is_checked(file: str, shell: Shell) -> None:
    with registered_language():
        checked = json.loads(shell("check", "--json", file))
        assert (checked["language"], checked["targets"], checked["errors"]) == ("targets", 2, 1)
        assert shell.code == 1
        assert checked["diagnostics"][0]["message"] == "'-' is not a number"
    assert json.loads(shell("check", "--json", file))["language"] == "m1486"  # as all files with unknown suffixes


def test_it_is_run(file: str, shell: Shell) -> None:
    with registered_language():
        assert shell("run", file) == "moves to 100, -\n"
        Path(file).write_text("")
        shell("run", file)
    assert shell.code == 1


def test_what_it_cannot_is_refused(file: str, shell: Shell) -> None:
    with registered_language():
        shell("explain", file)
        assert "cannot explain way.targets: permitted are WBC programs (.prg) and M1486 programs (.m1486)" in shell.errors
        shell("run", file, "--firmware", "1.70")
        assert "--firmware is not for lists of targets" in shell.errors
        shell("run", file, "--show", "edge")
        assert "--show is not for lists of targets" in shell.errors


class Others(FileLanguage):
    name = "other"
    title = "others"
    suffixes = ()

    def __init__(self, suffixes: Sequence[str], *, is_usual: bool = False) -> None:
        self.suffixes = tuple(suffixes)
        self.is_usual = is_usual


def test_names_and_suffixes_are_unique() -> None:
    with registered_language(), pytest.raises(Misuse, match=r"lists of targets have \.targets already"):
        register(Others(TARGETS.suffixes))
    with pytest.raises(Misuse, match="M1486 programs have files with unknown suffixes already"):
        register(Others([".other"], is_usual=True))
