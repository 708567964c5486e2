"""``python -m steptwin``, where the command is not in PATH."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.core import TyperGroup
from typer.main import get_command

from steptwin import __version__
from steptwin.cli import COMMANDS, app, commandgroup, main
from steptwin.cli.commandgroup import LONGEST_SUMMARY


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


def every_command() -> dict[str, Any]:
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    context = typer.Context(group)
    return {name: group.get_command(context, name) for name in group.list_commands(context)}


def test_the_help_shows_the_first_sentence_of_every_command_in_its_group() -> None:
    summaries = {name: summary for group in COMMANDS.values() for name, summary in group.items()}
    assert len(summaries) == sum(map(len, COMMANDS.values()))
    assert summaries == {name: each.get_short_help_str(LONGEST_SUMMARY) for name, each in every_command().items()}
    shown = help_of()
    assert [line[:-1] for line in shown.splitlines() if line.endswith(":") and not line.startswith(" ")] == ["Options", *COMMANDS]
    assert "..." not in shown.partition("Options:")[2]


def test_a_module_of_the_command_line_with_a_command_is_in_the_help() -> None:
    names = {name.replace("-", "_") for group in COMMANDS.values() for name in group}
    files = Path(commandgroup.__file__).parent.glob("*.py")
    assert names == {file.stem for file in files if re.search(r"^(def command\(|command = )", file.read_text(), re.MULTILINE)}


@pytest.mark.parametrize("arguments", [("serve",), ("serve", "mic488"), ("run",), ("get",), ("move",), ("up",)])
def test_help_names_values_and_no_python_types(arguments: tuple[str, ...]) -> None:
    shown = help_of(*arguments)
    assert "<" not in shown, shown
    assert "-h, --help" in shown


def test_a_missing_argument_is_named() -> None:
    wrong = steptwin("run")
    assert wrong.returncode == 2
    assert wrong.stderr == "steptwin: Missing argument 'FILE'; usage: python -m steptwin run -h\n"


def failed(arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> tuple[object, str, str]:
    monkeypatch.setattr("sys.argv", ["steptwin", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    out, errors = capsys.readouterr()
    return ended.value.code, out, errors


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "missing.prg"],
        ["fmt", "missing.prg"],
        ["build", "missing.prg"],
        ["decompile", "missing.wbc"],
        ["run", "missing.prg"],
        ["explain", "missing.prg"],
        ["migrate", "missing.prg", "--to", "1.40"],
        ["run", "missing.m1486"],
        ["run", "missing.toml"],
        ["send", "missing.m1486"],
        ["run", "missing.json"],
        ["up", "missing.toml"],
        ["replay", "missing.json"],
        ["why", "missing.json", "table.OUT3"],
        ["export", "missing.jsonl", "--to", "csv"],
        ["serve", "mic488", "--config", "missing.cfg"],
        ["serve", "m1486", "--program", "missing.m1486"],
        ["record", "missing.txt"],
        ["diff", "missing.txt", "other.txt"],
        ["info", "-d", "/dev/none,config=missing.cfg"],
    ],
)
def test_a_missing_file_is_the_same_everywhere(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name = next(part for argument in arguments for part in argument.split("=") if part.startswith("missing"))
    message = f"cannot read {name}: no such file or directory"
    assert failed(arguments, monkeypatch, capsys) == (2, "", f"steptwin: {message}\n")
    if arguments[0] not in ("up", "serve", "record"):
        code, out, errors = failed([*arguments, "--json"], monkeypatch, capsys)
        assert (code, out, json.loads(errors)) == (2, "", {"error": message, "code": 2})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["info", "--nothing"], "No such option: --nothing; usage: steptwin info -h"),
        (
            ["calc", "mic488", "--gear", "5mm"],
            "Invalid value for '--gear': '5mm': expected a number, without a unit; usage: steptwin calc -h",
        ),
        (["nothing"], "No such command 'nothing'; usage: steptwin -h"),
        (["fmt", "--check"], "Missing argument 'FILES'; usage: steptwin fmt -h"),
    ],
)
def test_usage_errors_are_one_line(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert failed(arguments, monkeypatch, capsys) == (2, "", f"steptwin: {message}\n")
    code, out, errors = failed([*arguments, "--json"], monkeypatch, capsys)
    assert (code, out, json.loads(errors)) == (2, "", {"error": message, "code": 2})


def test_errors_in_files_have_their_place_and_nothing_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, text in (("w.toml", "[worlds]\n"), ("p.prg", "WAIT\n")):
        (tmp_path / name).write_text(text)
        code, out, errors = failed(["run", str(tmp_path / name)], monkeypatch, capsys)
        assert (code, out, errors.startswith(f"{tmp_path / name}:1:1: error ")) == (2, "", True), errors


def test_json_of_every_command_is_documented() -> None:
    named = {name for name, each in every_command().items() if any("--json" in option.opts for option in each.params)}
    page = (Path(__file__).parents[2] / "docs/reference/command-line.md").read_text().partition("## JSON of each command")[2]
    first = " ".join(row.split("|")[1] for row in page.splitlines() if row.startswith("|"))
    documented = set(re.findall(r"`([a-z-]+)`", first))
    assert named <= documented


def test_without_a_command_it_names_what_to_try() -> None:
    shown = steptwin()
    assert shown.returncode == 0, shown.stderr
    named = re.findall(r"^  steptwin (\w+)", shown.stdout, re.MULTILINE)
    assert len(named) == 3
    assert set(named) <= set(every_command())
