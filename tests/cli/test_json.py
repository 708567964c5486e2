"""What the commands for files print with --json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from steptwin.cli import main

WORLD = """\
[world]
name = "cell"
[[mic488]]
name = "table"
"""


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Any:
    """``told(*arguments)``: exit code and data of a command, in a directory of its own."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[object, Any]:
        monkeypatch.setattr("sys.argv", ["steptwin", *arguments, "--json"])
        with pytest.raises(SystemExit) as ended:
            main()
        out, errors = capsys.readouterr()
        assert errors == ""
        return ended.value.code, json.loads(out)

    return run


def test_a_program_and_its_image(told: Any) -> None:
    Path("p.prg").write_text("OUT1=ON\nM1=ON\n")
    assert told("fmt", "p.prg", "--check") == (1, {"files": ["p.prg"], "not_in_the_style": ["p.prg"]})
    assert told("fmt", "p.prg") == (0, {"files": ["p.prg"], "formatted": ["p.prg"]})
    assert told("fmt", "p.prg") == (0, {"files": ["p.prg"], "formatted": []})
    Path("p.prg").write_text("WAIT IN1 = ON\n")
    built = {"file": "p.prg", "positions": None, "image": "p.wbc", "commands": 1, "rows": 0}
    assert told("build", "p.prg") == (0, built)
    code, data = told("decompile", "p.wbc")
    assert (code, data.pop("text").splitlines()[1:]) == (0, ["WAIT IN1 = 1"])
    assert data == {"file": "p.wbc", "program": None, "positions": None, "rows": 0, "unknown": 0, "inferred": 0}


def test_a_session_and_its_trace(told: Any) -> None:
    Path("w.toml").write_text(WORLD)
    _, ran = told("run", "w.toml", "--for", "10ms", "--session", "s.json")
    code, again = told("replay", "s.json", "--trace", "t.jsonl")
    assert (code, again["same"], again["digest"], again["recorded_digest"]) == (0, True, ran["digest"], ran["digest"])
    assert (again["world"], again["time_s"], again["inputs"], again["files"]) == ("cell", 0.01, 0, ["t.jsonl"])
    assert told("export", "t.jsonl", "--to", "vcd") == (0, [{"file": "t.vcd", "bytes": Path("t.vcd").stat().st_size}])
    recording = json.loads(Path("s.json").read_text())
    Path("s.json").write_text(json.dumps({**recording, "digest": "0" * len(recording["digest"])}))
    code, again = told("replay", "s.json")
    assert (code, again["same"], again["digest"]) == (1, False, ran["digest"])
