"""``python -m steptwin``, where the command is not in PATH."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.core import TyperGroup
from typer.main import get_command

from steptwin import __version__
from steptwin.cli import GROUPS, app, main


def steptwin(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "steptwin", *arguments], capture_output=True, text=True, check=False)


def test_the_package_runs_as_the_command() -> None:
    assert steptwin("--version").stdout == f"{__version__}\n"


def test_usage_and_errors_are_those_of_the_command() -> None:
    assert "Usage: python -m steptwin [OPTIONS] COMMAND" in steptwin("--help").stdout
    wrong = steptwin("serve", "mic488", "--firmware", "9")
    assert (wrong.returncode, "firmware '9'" in wrong.stderr, "Traceback" in wrong.stderr) == (2, True, False), wrong.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["registers", "mic488", "--format", "x"],
            "Invalid value for '--format': 'x' is not one of 'table', 'csv',",
        ),
        (["commands", "m1487"], "'m1487' is not one of"),
        (["registers", "m1486"], "an M1486 has no registers; 'steptwin commands m1486' shows its commands"),
        (["registers", "m1487"], "no controller 'm1487' with registers; there is mic488"),
    ],
)
def test_choices_that_are_none(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["steptwin", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    told = capsys.readouterr().err
    assert (ended.value.code, message in told, "Value error" in told) == (2, True, False), told


def help_of(*arguments: str) -> str:
    shown = steptwin(*arguments, "-h")
    assert shown.returncode == 0, shown.stderr
    return shown.stdout


def test_every_command_is_in_one_group_of_the_help_with_its_whole_summary() -> None:
    named = [name for group in GROUPS.values() for name in group]
    command = get_command(app)
    assert isinstance(command, TyperGroup)
    assert sorted(named) == sorted({*named}) == sorted(command.commands)
    shown = help_of()
    assert [line[:-1] for line in shown.splitlines() if line.endswith(":") and not line.startswith(" ")] == ["Options", *GROUPS]
    assert "..." not in shown.partition("Options:")[2]


@pytest.mark.parametrize("arguments", [("serve",), ("serve", "mic488"), ("run",), ("get",), ("move",), ("up",)])
def test_help_names_values_and_no_python_types(arguments: tuple[str, ...]) -> None:
    shown = help_of(*arguments)
    assert "<" not in shown, shown
    assert "-h, --help" in shown


def test_a_missing_argument_is_named() -> None:
    wrong = steptwin("run")
    assert wrong.returncode == 2
    assert "Missing argument 'file'" in wrong.stderr
