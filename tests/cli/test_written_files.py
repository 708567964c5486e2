"""Every command that writes a file leaves the old one whole, or a new one; links and permissions stay as they are.

What happens at each step of a write has tests in ``test_writing.py``. Here the disk is full, and the folder is protected.
"""

from __future__ import annotations

import errno
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer
from campaigns import campaign_file
from history_rig import RecordedWorld
from shell import Shell
from typer.core import TyperOption

from steptwin.cli import app, main
from steptwin.cli.writtenfiles import keep_apart
from steptwin.errors import SteptwinError
from steptwin.files.memory import StateDirectory
from steptwin.files.recording import recording_of, save
from steptwin.files.world import World
from steptwin.live.studio.drawing import WorldArrangement
from steptwin.simulation.describe.arrangement import DrawnPosition

OLD = b"[mic488]\n# the old one\n" * 100
PROGRAM = "if in1=1\nmoveptp 1 2\nendif\nend\n"
IMAGE_OF = "IF IN1 = 1\nDELAY 5\nENDIF\n"
CHIP = "[\n@70\nI1H20\nS200\nV800\nA6000\nR\n]\n"
HALL = """
[world]
name = "hall"
[[mic488]]
name = "table"
[mic488.M1]
unit = "mm"
gear = 800.0
[[script]]
name = "go"
steps = [{ write = { "table.M1_EN" = 1, "table.M1_POS_ABS" = 1 } }, { wait = "1 s" }]
"""


class Way(NamedTuple):
    """What writes ``file``. Its arguments are for the command line; a function gets the folder."""

    file: str
    write: str | Callable[[Path], object]
    old: bytes = OLD


def _arrange(folder: Path) -> object:
    world = World.load(folder / "w.toml")
    there = WorldArrangement(world.spec, ["table"], folder / "arranged.toml").save([DrawnPosition("table", 1, 2)])
    if there.file is None:
        raise OSError(errno.ENOSPC, "")  # the page gets the text instead
    return there


def _save_recording(folder: Path) -> None:
    save(recording_of(World.load(folder / "w.toml")), folder / "s.json")


def _save_memory(folder: Path) -> None:
    with StateDirectory(folder) as state:
        state.save("unit1", b"new")


WAYS = [
    Way("a.prg", "fmt a.prg", PROGRAM.encode()),
    Way("b.wbc", "build image.prg -o b.wbc"),
    Way("b.prg", "decompile image.wbc -o b.prg"),
    Way("b.csv", "decompile image.wbc --positions b.csv"),
    Way("b.m1486", "migrate chip.m1486 --from B --to A2x -o b.m1486"),
    Way("flow.svg", "explain image.prg -o flow.svg"),
    Way("curve.svg", "calc m1486 --distance 1rev --velocity 500 --acceleration 900 -o curve.svg"),
    *(Way(f"t.{form}", f"run w.toml --trace t.{form}") for form in ("jsonl", "html", "svg")),
    Way("s.json", "run w.toml --session s.json"),
    *(Way(f"c.{form}", f"run w.toml --coverage c.{form}") for form in ("info",)),
    Way("r.jsonl", "replay session.json --trace r.jsonl"),
    Way("e.csv", "export trace.jsonl -o e.csv"),
    Way("summary.json", "campaign run doors.toml --runs 1 --jobs 1 --out ."),
    *(Way(f"h.{form}", f"history h.db table.M1.position -o h.{form}") for form in ("csv", "parquet")),
    Way("saved.toml", "serve mic488 --save-world saved.toml"),
    Way("arranged.toml", _arrange, HALL.encode()),
    Way("s.json", _save_recording),
    Way("unit1.image", _save_memory),
]


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What commands read."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "w.toml").write_text(HALL)
    (folder / "image.prg").write_text(IMAGE_OF)
    (folder / "chip.m1486").write_text(CHIP)
    campaign_file(folder)
    recorded = RecordedWorld(HALL)
    recorded.run(0.5)
    recorded.end()
    recorded.written("sqlite:///h.db", folder)
    return folder


def needed_by(write: str) -> list[str]:
    """The commands that make what another one reads."""
    made = {
        "image.wbc": "build image.prg",
        "session.json": "run w.toml --session session.json",
        "trace.jsonl": "run w.toml --trace trace.jsonl",
    }
    return [command for name, command in made.items() if name in write]


@pytest.mark.parametrize("way", WAYS, ids=lambda way: f"{way.file}-{way.write if isinstance(way.write, str) else 'call'}")
def test_the_file_is_the_old_one_or_the_new_one(
    way: Way, inputs: Path, tmp_path: Path, shell: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    far, link = tmp_path / "far" / way.file, tmp_path / way.file
    takes_links = way.file != "arranged.toml"  # requests write through no link
    for command in needed_by(way.write) if isinstance(way.write, str) else ():
        shell(*command.split())
        assert shell.code == 0, shell.errors
    far.parent.mkdir()
    far.write_bytes(way.old)
    far.chmod(0o640)
    if takes_links:
        link.symlink_to(far)
    else:
        far = far.rename(link)
    names = sorted(os.listdir(far.parent))

    def fails() -> str:
        """The reason; nothing if it does not fail."""
        if isinstance(way.write, str):
            shell(*way.write.split())
            return shell.errors if shell.code else ""
        try:
            way.write(tmp_path)
        except (SteptwinError, OSError) as error:
            return str(error)
        return ""

    def full(number: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert "o space left on device" in fails() or way.file == "arranged.toml"
    assert (far.read_bytes(), sorted(os.listdir(far.parent))) == (way.old, names)
    with monkeypatch.context() as patch:
        access = os.access
        patch.setattr(os, "access", lambda path, mode: Path(path) != far.parent and access(path, mode))
        assert "its folder takes no new file" in fails() or way.file == "arranged.toml"
    assert (far.read_bytes(), sorted(os.listdir(far.parent))) == (way.old, names)
    fails()
    assert far.read_bytes() != way.old
    assert link.is_symlink() is takes_links
    assert stat.S_IMODE(far.stat().st_mode) == 0o640


SUFFIX_OPTIONAL = [
    Way("e.csv", "export trace.jsonl --to csv -o e.csv --json"),
    Way("out.svg", "explain image.prg -o out.svg --json"),
    Way("s1.json", "run w.toml --session s1.json --json"),
    Way("t1.jsonl", "run w.toml --trace t1.jsonl --json"),
]
"""The format is known without the name."""
STREAMED = [
    *(way for way in WAYS if isinstance(way.write, str) and way.file not in {"a.prg", "summary.json", "saved.toml"}),
    Way("b.wbc", "build image.prg -o b.wbc --json"),
    *SUFFIX_OPTIONAL,
]


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="no /dev/stdout")
@pytest.mark.parametrize("way", STREAMED, ids=lambda way: str(way.write))
def test_what_is_written_to_the_standard_output_is_alone_there(
    way: Way, inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x").mkdir()

    def run(command: str) -> bytes:
        monkeypatch.setattr("sys.argv", ["steptwin", *command.split()])
        capfdbinary.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, errors = capfdbinary.readouterr()
        assert end.value.code == 0 or command.startswith("migrate"), errors
        return out

    assert isinstance(way.write, str)
    for command in needed_by(way.write):
        run(command)
    run(way.write)
    link = tmp_path / "x" / way.file
    link.symlink_to("/dev/stdout")
    stream = "/dev/stdout" if way in SUFFIX_OPTIONAL else f"x/{way.file}"
    assert run(way.write.replace(way.file, stream)) == (tmp_path / way.file).read_bytes()


READ = {"--positions", "--config", "--certificate", "--key", "--trusted", "--tokens", "--program"}
FOLDERS_AND_LINES = {"--state", "--out", "--pty"}


def test_every_option_that_names_a_file_to_write_keeps_it_apart() -> None:
    """Or the test above does not hold for it."""

    def options(command: Any, path: str = "") -> Iterator[tuple[str, TyperOption]]:
        for name in getattr(command, "commands", ()):
            yield from options(command.get_command(context, name), f"{path} {name}")
        yield from ((path, one) for one in command.params if isinstance(one, TyperOption))

    apart, other = set(), set()
    context = typer.Context(typer.main.get_command(app))
    for command, option in options(context.command):
        where = apart if getattr(option.callback, "__wrapped__", None) is keep_apart else other
        if "path" in option.display_type(context).lower() or option.opts[0] in {"--trace", "--coverage"}:
            where.add((command.strip(), option.opts[0]))
    assert ("decompile", "--positions") in apart
    assert {name for _, name in other} == READ | FOLDERS_AND_LINES


def test_a_log_of_commands_to_the_standard_output_is_not_renamed(tmp_path: Path) -> None:
    """It was, when it was full, and over a pipe the first command failed."""
    python = "from pathlib import Path; from steptwin.access.audit import Audit; "
    python += "from steptwin.files.auditfile import AuditFile\n"
    python += "with AuditFile(Path('/dev/stdout'), 1) as file: file.add({})"
    done = subprocess.run([sys.executable, "-c", python], capture_output=True, check=True, cwd=tmp_path)
    assert done.stdout == b"{}\n"
