from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from steptwin.cli import main
from steptwin.m1486 import findings
from steptwin.m1486.check import check
from steptwin.m1486.commands import TABLE

Run = Callable[..., str]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """What ``steptwin commands m1486`` prints with these options."""

    def run_commands(*options: str) -> str:
        monkeypatch.setattr("sys.argv", ["steptwin", "commands", "m1486", *options])
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        return capsys.readouterr().out

    return run_commands


def test_text_has_one_line_for_each_command(run: Run) -> None:
    lines = run("--variant", "E1").splitlines()
    (jump,) = [line for line in lines if line.startswith("J ")]
    assert " ".join(jump.split()) == "J Jump 1 to 80 (label) yes 16 in program order Goes on at the label. VII.1"
    assert "M1486E1  1 to 80  256" in "\n".join(lines)
    assert "M1486A" not in "\n".join(lines)


def test_without_a_variant_all_are_shown(run: Run) -> None:
    assert "1 to 15 (label) on A, C; 1 to 80 (label) on B, E1, E2" in run()


def test_json_has_every_table(run: Run) -> None:
    data = json.loads(run("--format", "json"))
    counts = {title: len(rows) for title, rows in data.items()}
    assert counts == {
        "Commands": len(TABLE), "Auxiliary functions": 24, "Flags": 2, "Registers": 10, "Bytes to upload": 20, "Microsteps": 7,
        "I/O lines": 21, "Types": 5, "What the checker finds": len(findings.TABLE),
    }  # fmt: skip
    forward = next(row for row in data["Commands"] if row["command"] == "F")
    assert forward == {
        "command": "F", "name": "Forward", "number": "1 to 16 000 000 min. microsteps", "variable": "yes", "bits": "32",
        "acts": "in program order", "effect": "Sets distance and positive direction of the next move.", "section": "VII.2",
    }  # fmt: skip


def test_m_45_commands_that_act_when_received_take_no_memory_as_the_checker_counts(run: Run) -> None:
    shown = {(row["command"], row["name"]): row["bits"] for row in json.loads(run("--format", "json"))["Commands"]}
    for text, name in (("K", "Kill"), ("XG", "indeX all"), ("C75", "Clear kill"), ("X7", "indeX"), ("C80", "Flag off")):
        counted = sum(command.bits for command in check(f"[\n{text}\n]").memory[0].commands)
        assert int(shown[text.rstrip("0123456789"), name]) == counted, text
    assert shown["K", "Kill"] == shown["C", "Clear kill"] == "0"


def test_markdown_tables_have_as_many_cells_as_columns(run: Run) -> None:
    page = run("--format", "md")
    for table in page.split("## ")[1:]:
        rows = [line.replace("\\|", "") for line in table.splitlines() if line.startswith("|")]
        assert len({row.count("|") for row in rows}) == 1
    assert "| `*` | Multiply |" in page


@pytest.fixture
def run_mic488(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """What ``steptwin commands mic488`` prints with these options."""

    def run_commands(*options: str) -> str:
        monkeypatch.setattr("sys.argv", ["steptwin", "commands", "mic488", *options])
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        return capsys.readouterr().out

    return run_commands


def test_programs_of_the_mic488(run_mic488: Run) -> None:
    data = json.loads(run_mic488("--format", "json"))
    statements = {row["statement"] for row in data["Statements"]}
    assert {"SET X = Y op Z", "PABS Mx position", "WAITPOS", "PULSE(OUTn, seconds)"} <= statements
    timer = next(row for row in data["Registers"] if row["register"] == "TIMA1…TIMA16")
    assert timer == {
        "register": "TIMA1…TIMA16", "access": "RW", "unit": "10 ms", "reads": "0…999999", "takes": "0…999999",
        "meaning": "timer counting up every 10 ms, stops at 999999",
    }  # fmt: skip
    assert {"label": "INT_IN20", "label that waits for the statement's end": "HARDINT_IN20",
            "enabled by": "configuration only (Int)"} in data["Interrupts"]  # fmt: skip
    assert len(data["What the checker finds"]) > 60


def test_programs_of_older_firmware(run_mic488: Run) -> None:
    text = run_mic488("--firmware", "1.25", "--format", "md")
    assert "| `$I0…$I499` |" in text
    assert "| `\\|\\|` | SET |" in text
    assert "PULSE" not in text
    assert "HARDINT" not in text


@pytest.mark.parametrize("options", [("mic488", "--variant", "A"), ("m1486", "--firmware", "1.70")])
def test_options_of_the_other_controller_are_refused(monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...]) -> None:
    monkeypatch.setattr("sys.argv", ["steptwin", "commands", *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
