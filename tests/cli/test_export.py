from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.cli import main
from steptwin.cli.export import ExportFormat
from steptwin.controller import SECOND
from steptwin.files.export import FORMATS, write_trace
from steptwin.motion import MotionState, plan_position
from steptwin.simulation.scheduler.trace import Trace, TraceRecord

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit code, output and errors of ``steptwin export``."""

    def run_export(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", "export", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_export


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    recorded = Trace()
    recorded.add(TraceRecord(0, "a", "plan", "1", plan_position(MotionState(0, 0, 0.0, 0.0), 1000, 1000.0, 1000.0, 500.0)))
    write_trace(recorded, tmp_path / "run.jsonl")
    return tmp_path / "run.jsonl"


def test_files_are_named_after_the_trace(run: Run, trace: Path) -> None:
    code, out, _ = run(trace, "--to", "csv", "--to", "vcd", "--period", "100ms")
    assert code == 0
    assert [line.partition(":")[0] for line in out.splitlines()] == [str(trace.with_suffix(s)) for s in (".csv", ".vcd")]
    # 2.5 s of motion.
    assert len(trace.with_suffix(".csv").read_text().splitlines()) == 27


@pytest.mark.parametrize("form", sorted({*FORMATS} - {"glb"}))  # which needs a machine: test_picture.py
def test_every_format_can_be_named(run: Run, trace: Path, form: str) -> None:
    """``jsonl`` into another place: it would replace what is read."""
    where = ("-o", str(trace.with_name(f"other.{form}"))) if form == "jsonl" else ()
    assert run(str(trace), "--to", form, *where)[0] == 0
    assert form in list(ExportFormat)


def test_a_window_of_time_into_a_named_file(run: Run, trace: Path, tmp_path: Path) -> None:
    target = tmp_path / "there" / "part.csv"
    assert run(trace, "-o", target, "--from", "0.5s", "--until", "1500ms", "--period", "500ms")[0] == 0
    lines = target.read_text().splitlines()
    assert [line.partition(",")[0] for line in lines] == ["time_s", "0.5", "1.0", "1.5"]
    assert SECOND == 1_000_000_000


def test_a_directory_is_its_trace(run: Run, trace: Path) -> None:
    trace.rename(trace.with_name("trace.jsonl"))
    assert run(trace.parent, "--to", "html")[0] == 0
    assert trace.with_name("trace.html").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "nothing to write: name formats with --to (html, png,"),
        (["--to", "html", "--from", "soon"], "--from: 'soon' is not a time"),
        (["--to", "csv", "--machine", "b"], "no controller 'b' in the trace: there are a"),
    ],
)
def test_misuse_is_told_in_a_line(arguments: list[str], message: str, run: Run, trace: Path) -> None:
    code, out, err = run(trace, *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
