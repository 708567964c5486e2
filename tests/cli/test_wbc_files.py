"""check, fmt, build and decompile on files of WBC programs, as a user calls them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.cli import main

Run = Callable[..., tuple[int, str, str]]
EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"
PROGRAM = "M1 = ON\nHOME M1 -20\nWAITPOS\nMOVEPTP @top\nOUT1 = ON\n"
TABLE = "home;0;x;x;x\ntop;10,5;x;x;x\n"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """``steptwin`` with these arguments: exit code, standard output, standard error."""

    def run_command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_command


@pytest.fixture
def file(tmp_path: Path) -> Callable[[str, str | bytes], Path]:
    def write(name: str, content: str | bytes) -> Path:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write


File = Callable[[str, "str | bytes"], Path]
NAMES = ("pick_and_place", "feeder", "xy_plot", "press", "slave", "gate")


@pytest.mark.parametrize("name", NAMES)
def test_examples_check_clean(run: Run, name: str) -> None:
    arguments: list[object] = ["check", EXAMPLES / f"{name}.prg", "--config", EXAMPLES / f"{name}.cfg"]
    if (EXAMPLES / f"{name}.csv").exists():
        arguments += ["--positions", EXAMPLES / f"{name}.csv"]
    code, out, err = run(*arguments)
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == f"{EXAMPLES / name}.prg: 0 errors, 0 warnings"


def test_examples_are_in_the_style(run: Run) -> None:
    assert {path.stem for path in EXAMPLES.glob("*.prg")} == set(NAMES)
    assert run("fmt", "--check", *EXAMPLES.glob("*.prg")) == (0, "", "")


def test_check_names_the_file_of_each_finding(run: Run, file: File) -> None:
    program = file("a.prg", "M1 = ON\nPABS M1\n")
    table = file("a.csv", "top;1;2\n")
    config = file("a.cfg", "[Axis0]\nGear=zero\n")
    code, out, _ = run("check", program, "--positions", table, "--config", config, "--firmware", "1.25")
    assert code == 1
    assert f"{program}:2:6: error W120: PABS lacks the position" in out
    assert f"{table}:1:1: error W150: 3 columns instead of 5" in out
    assert f"{config}:2:6: error C006" in out
    assert "3 errors, 0 warnings" in out
    assert "MIC488 firmware 1.23, 2 executable lines of 1000" in out


def test_check_as_json(run: Run, file: File) -> None:
    program, table = file("a.prg", "OUT9 = 1\n"), file("a.csv", "top;1;2;3;?\n")
    code, out, _ = run("check", program, "--positions", table, "--json")
    data = json.loads(out)
    assert code == 1
    assert (data["language"], data["firmware"], data["executable_lines"], data["limit_lines"]) == ("wbc", "1.70", 1, 4000)
    assert (data["errors"], data["warnings"]) == (2, 0)
    found = [(d["file"], d["code"], d["line"], d["column"]) for d in data["diagnostics"]]
    assert found == [(str(program), "W140", 1, 1), (str(table), "W151", 1, 11)]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("check", "a.prg", "--variant", "A"), "--variant is not for WBC programs"),
        (("check", "a.m1486", "--firmware", "1.70"), "--firmware is not for M1486 programs"),
        (("check", "a.prg", "--firmware", "1.10"), "firmware '1.10' is not known: give 1.23 or newer"),
        (("check", "a.prg", "--positions", "none.csv"), "cannot read none.csv: no such file or directory"),
        (("check", "a.prg", "--config", "none.cfg"), "cannot read none.cfg: no such file or directory"),
        (("check", "none.prg"), "cannot read none.prg: no such file or directory"),
        (("fmt", "a.m1486"), "cannot format a.m1486: permitted are WBC programs (.prg)"),
        (("build", "a.wbc"), "a.wbc is a compiled image already: steptwin decompile makes a program of it"),
        (("build", "none.prg"), "cannot read none.prg: no such file or directory"),
        (("build", "named.prg"), "named.prg names positions: give the table with --positions"),
        (("build", "a.prg", "-o", "a.prg/a.wbc"), "cannot write a.prg/a.wbc: not a directory"),
        (("decompile", "a.prg"), "not a compiled image: 8 bytes instead of 20094"),
        (("decompile", "none.wbc"), "cannot read none.wbc: no such file or directory"),
    ],
)
def test_wrong_use(run: Run, file: File, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    file("a.prg", "OUT1 = 1")
    file("named.prg", "MOVEPTP @top\nM1 = ON\n")
    file("a.m1486", "f10\n")
    with contextlib.chdir(tmp_path):
        code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert "Traceback" not in err


def test_fmt_writes_the_style_and_nothing_else(run: Run, file: File) -> None:
    ugly = file("a.prg", b"\xef\xbb\xbfm1=on\r\nif in1=1 // \xc5\xbc\r\nend\r\nendif\r\n\r\n")
    assert run("fmt", "--check", ugly) == (1, f"{ugly}: not in the style\n", "")
    assert run("fmt", ugly) == (0, f"{ugly}: formatted\n", "")
    assert ugly.read_bytes() == b"\xef\xbb\xbfm1 = on\r\nIF in1 = 1  // \xc5\xbc\r\n    END\r\nENDIF\r\n"
    assert run("fmt", "--check", ugly) == (0, "", "")


@pytest.mark.parametrize("comment", [b"\xbf\xea", b"\x81\x98"], ids=["cp1250", "any bytes"])
def test_fmt_keeps_the_encoding(run: Run, file: File, comment: bytes) -> None:
    program = file("a.prg", b"m1=on // " + comment + b"\n")
    assert run("fmt", program)[0] == 0
    assert program.read_bytes() == b"m1 = on  // " + comment + b"\n"


@pytest.mark.parametrize(
    ("mark", "encoding"),
    [(b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8")],
    ids=["UTF-16", "UTF-16 big-endian", "UTF-8"],
)
def test_fmt_and_check_read_unicode_as_windows_saves_it(run: Run, file: File, mark: bytes, encoding: str) -> None:
    program = file("a.prg", mark + "m1=on // zażółć\r\nend\r\n".encode(encoding))
    assert run("check", program)[0] == 0
    assert run("fmt", program) == (0, f"{program}: formatted\n", "")
    assert program.read_bytes() == mark + "m1 = on  // zażółć\r\nEND\r\n".encode(encoding)


def test_fmt_leaves_the_end_mark_of_dos_where_it_is(run: Run, file: File) -> None:
    program = file("a.prg", b"m1=on\r\nend\x1a")
    assert run("check", program)[0] == 0
    assert run("fmt", program)[0] == 0
    assert program.read_bytes() == b"m1 = on\r\nEND\r\n\x1a"


NO_TEXT = {
    "all bytes": bytes(range(256)) * 8,
    "UTF-16 without mark": "M1 = ON\r\n".encode("utf-16-le"),
    "half UTF-16": b"\xff\xfeM\x00\x00\xd8x\x00",
    "control characters": b"\x01\x02\x03M1 = ON\n",
}


@pytest.mark.parametrize("content", NO_TEXT.values(), ids=NO_TEXT)
@pytest.mark.parametrize(
    "arguments",
    [
        ("fmt", "x.prg"),
        ("check", "x.prg"),
        ("build", "x.prg"),
        ("run", "x.prg"),
        ("check", "x.m1486"),
        ("run", "x.m1486"),
        ("check", "good.prg", "--positions", "x.csv"),
        ("run", "good.prg", "--positions", "x.csv"),
    ],
    ids=" ".join,
)
def test_what_is_no_text_is_refused_in_one_sentence(
    run: Run, file: File, tmp_path: Path, arguments: tuple[str, ...], content: bytes
) -> None:
    file("good.prg", "END\n")
    name = arguments[-1]
    file(name, content)
    with contextlib.chdir(tmp_path):
        code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith(f"steptwin: {name} ")
    assert "not a text file" in err or "UTF-16" in err
    assert (tmp_path / name).read_bytes() == content


def test_build_and_decompile_come_back_to_the_same_bytes(run: Run, file: File, tmp_path: Path) -> None:
    program, table = file("a.prg", PROGRAM), file("a.csv", TABLE)
    image = tmp_path / "a.wbc"
    assert run("build", program, "--positions", table) == (0, f"{image}: 5 commands, 2 positions\n", "")
    assert len(image.read_bytes()) == 20_094
    source = tmp_path / "b.prg"
    assert run("decompile", image, "-o", source) == (0, f"{source}: everything known\n", "")
    assert source.read_text().splitlines()[1:] == [
        "SET M1 = 1",
        "HOME M1 -20",
        "WAITPOS",
        "MOVEPTP @P1",
        "SET OUT1 = 1",
    ]
    assert (tmp_path / "b.csv").read_text() == "P0;0;x;x;x\nP1;10.5;x;x;x\n"
    again = tmp_path / "c.wbc"
    assert run("build", source, "--positions", tmp_path / "b.csv", "-o", again)[0] == 0
    assert again.read_bytes() == image.read_bytes()


def test_wbc_40_build_and_decompile_say_what_is_inferred(run: Run, file: File, tmp_path: Path) -> None:
    program = file("a.prg", "M1 = ON\nPABS M1 5\nWAITPOS\n")
    code, out, err = run("build", program)
    assert (code, out) == (1, "")
    assert "error W160: PABS has no documented form in the image" in err
    assert "--inferred writes it in a form that was never seen" in err
    image, source = tmp_path / "a.wbc", tmp_path / "b.prg"
    assert run("build", program, "--inferred") == (0, f"{image}: 3 commands, 0 positions\n", "")
    summary = "1 statement marked as inferred: build takes them with --inferred"
    assert run("decompile", image, "-o", source) == (0, f"{source}: {summary}\n", "")
    assert source.read_text().splitlines()[1:] == ["SET M1 = 1", "PABS M1 5  // inferred", "WAITPOS"]
    code, out, err = run("run", image, "--until", "idle")
    assert code == 0
    assert "warning W260: 1 statement is inferred" in err
    assert "M1 moves to 5 imp" in out


def test_decompile_overwrites_no_table_it_was_not_told_of(run: Run, file: File, tmp_path: Path) -> None:
    image = tmp_path / "a.wbc"
    run("build", file("a.prg", PROGRAM), "--positions", file("a.csv", TABLE), "-o", image)
    code, _, err = run("decompile", image, "-o", tmp_path / "a.prg")
    assert code == 2
    assert "a.csv exists already: name the position table with --positions" in err
    assert (tmp_path / "a.csv").read_text() == TABLE
    assert (tmp_path / "a.prg").read_text() == PROGRAM
    code, out, err = run("decompile", image)
    assert (code, out.splitlines()[2]) == (0, "HOME M1 -20")
    assert "2 positions: write them with --positions" in err


def test_build_shows_what_it_cannot_encode(run: Run, file: File, tmp_path: Path) -> None:
    code, out, err = run("build", file("a.prg", "M1 = ON\nPABS M1 5\n"))
    assert (code, out) == (1, "")
    assert "a.prg:2:1: error W160: PABS has no documented form in the image" in err
    assert not (tmp_path / "a.wbc").exists()


def test_build_refuses_a_program_with_errors(run: Run, file: File, tmp_path: Path) -> None:
    code, _, err = run("build", file("a.prg", "WAIT\n"))
    assert code == 1
    assert "error W113" in err
    assert run("build", file("b.prg", "OUT1 = 1\n"), "--positions", file("b.csv", "a;1\n"))[0] == 1
    assert list(tmp_path.glob("*.wbc")) == []


def test_run_plays_a_program(run: Run, file: File) -> None:
    program, table = file("a.prg", PROGRAM), file("a.csv", TABLE)
    config = file("a.cfg", "[Axis0]\nUnit=3\nGear=10\nVel=50\nAcc=500\nInKL=0\n")
    arguments = ("run", program, "--positions", table, "--config", config, "--travel", "m1=-2..")
    code, out, err = run(*arguments)
    assert (code, err) == (0, "")
    assert "M1 moves to 10.5 mm 4 MOVEPTP @top" in " ".join(out.split())
    assert "the program has ended" in out
    code, out, _ = run(*arguments, "--json", "--for", "50ms", "--statement-time", "10ms")
    data = json.loads(out)
    assert (code, data["ended"], data["virtual_s"], data["state"]["program"]["line"]) == (0, "limit", 0.05, 3)


def test_run_says_what_is_wrong(run: Run, file: File) -> None:
    code, _, err = run("run", file("a.prg", "WAIT\n"))
    assert (code, "/a.prg:1:1: error W113" in err, "steptwin:" in err) == (2, True, False), err
    code, out, err = run("run", file("b.prg", "$I0 = 1 / $I1\n"))
    assert (code, err) == (1, "")
    assert "an error has stopped the program in line 1: division by zero" in out
    assert run("run", file("c.prg", ""), "--variant", "A")[0] == 2
    assert run("run", file("d.m1486", ""), "--travel", "M1=1..2") == (2, "", "steptwin: --travel is not for M1486 programs\n")
    assert run("run", file("c.prg", ""), "--statement-time", "2s")[0] == 2
