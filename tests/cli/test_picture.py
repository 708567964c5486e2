from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples/worlds"
HOIST = EXAMPLES / "hoist/hoist.toml"
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit code, output and errors of ``steptwin``."""

    def run_main(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_main


def test_a_recording_and_its_description_have_one_picture(run: Run, tmp_path: Path) -> None:
    session = tmp_path / "s.json"
    assert run("run", HOIST, "--for", "3s", "--session", session)[0] == 0
    for source, name in ((HOIST, "one.svg"), (session, "other.svg")):
        code, out, _ = run("picture", source, "--at", "2.5", "-o", tmp_path / name)
        assert (code, out) == (0, f"{tmp_path / name}: hoist at 2.5 s\n")
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "other.svg").read_bytes()
    assert run("picture", HOIST, "--at", "0.5", "-o", tmp_path / "other.svg")[0] == 0
    assert (tmp_path / "one.svg").read_bytes() != (tmp_path / "other.svg").read_bytes()
    code, _, err = run("picture", session, "--at", "3.5s", "-o", tmp_path / "late.svg")
    assert (code, err) == (2, "steptwin: the recording ends at 3 s, before 3.5 s\n")


def test_a_run_that_ends_before_the_moment(run: Run, tmp_path: Path) -> None:
    ends = tmp_path / "ends.toml"
    ends.write_text(HOIST.read_text("utf-8") + '[[script]]\nname = "end"\nat = "1 s"\nsteps = [{ stop = "enough" }]\n', "utf-8")
    (tmp_path / "hoist.prg").write_bytes((EXAMPLES / "hoist/hoist.prg").read_bytes())
    code, _, err = run("picture", ends, "--at", "2s", "-o", tmp_path / "p.svg")
    assert (code, err) == (2, f"steptwin: {ends} ends at 1 s (enough), before 2 s\n")
    assert not (tmp_path / "p.svg").exists()


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (("-o", "p.bmp"), "cannot write p.bmp: pictures are .svg or .png"),
        (("-o", "/proc/p.svg"), "cannot write /proc/p.svg: "),
        (("-o", "p.svg", "--view", "below"), "'below' is not one of 'iso', 'front', 'side', 'top'"),
        (("-o", "p.svg", "--at", "soon"), "--at: 'soon' is not a time"),
        ((), "Missing option '--output' / '-o'"),
    ],
)
def test_wrong_options(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], error: str) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = run("picture", HOIST, *options)
    assert code == 2
    assert error in err
    assert not any(tmp_path.iterdir())


def test_formats_of_a_machine_in_space(run: Run, tmp_path: Path) -> None:
    """A trace that was written as lines can become a timeline with the machine and a glTF file later; without space it cannot."""
    trace = tmp_path / "t.jsonl"
    assert run("run", HOIST, "--for", "2s", "--trace", trace)[0] == 0
    code, _, _ = run("export", trace, "--to", "glb", "--to", "html", "--until", "1s")
    assert code == 0
    assert trace.with_suffix(".glb").read_bytes()[:4] == b"glTF"
    assert "steptwinScene" in trace.with_suffix(".html").read_text("utf-8")
    flat = tmp_path / "f.glb"
    world = tmp_path / "flat.toml"
    world.write_text('[[mic488]]\nname = "table"\n', "utf-8")
    code, _, err = run("run", world, "--for", "1s", "--trace", flat)
    assert code == 2
    assert "this trace has no machine in space" in err
    assert not flat.exists()


def test_a_timeline_without_the_script_says_so(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("steptwin.languages.run_world", "steptwin.files.export.timeline"):
        monkeypatch.setattr(f"{module}.scene_script", lambda: None)
    code, _, err = run("run", HOIST, "--for", "1s", "--trace", tmp_path / "t.html")
    assert code == 0
    assert "the script that draws machines in space has not been built" in err
    assert '"scene":null' in (tmp_path / "t.html").read_text("utf-8")
