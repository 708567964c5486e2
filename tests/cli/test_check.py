from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.cli import main

Run = Callable[..., tuple[int, str, str]]
EXAMPLES = Path(__file__).parents[2] / "examples" / "m1486"


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """``steptwin check`` with these arguments: exit code, standard output, standard error."""

    def run_check(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["steptwin", "check", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run_check


@pytest.fixture
def program(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str, name: str = "wrong.m1486") -> Path:
        file = tmp_path / name
        file.write_bytes(text.encode())
        return file

    return write


def test_a_sound_program(run: Run) -> None:
    code, out, err = run(EXAMPLES / "example2.m1486")
    assert (code, err) == (0, "")
    assert out.splitlines() == [
        f"{EXAMPLES / 'example2.m1486'}: 0 errors, 0 warnings",
        "M1486A, Step & Direction interface",
        "command memory: 168 of 864 bits in [ ], 168 bits in total",
    ]


def test_errors_give_exit_code_1_and_warnings_do_not(run: Run, program: Callable[..., Path]) -> None:
    file = program("F640\nV25000\nU7\n")
    code, out, _ = run(file)
    assert code == 1
    assert out.startswith(
        f"{file}:2:2: error M110: V 25 000 is out of range\n  2 | V25000\n    |  ^^^^^\n    = 16 to 20 000 step/s\n"
    )
    assert f"{file}: 1 error, 1 warning\n" in out
    assert run(program("U7\n"))[0] == 0


def test_variant_and_interface_decide(run: Run, program: Callable[..., Path]) -> None:
    file = program("[\n@16\nC9\nJ16\n]\n")
    assert run(file)[0] == 1
    assert run(file, "--variant", "b")[0] == 0
    assert run(file, "--variant", "e12x", "--interface", "dual")[0] == 0
    code, out, _ = run(file, "--variant", "B", "--interface", "two")
    assert code == 1
    assert "B9 belongs to the Two DACs interface" in out


def test_memory_of_each_command(run: Run) -> None:
    _, out, _ = run(EXAMPLES / "example6.m1486", "--memory")
    lines = out.splitlines()
    assert "command memory of chip 7: 128 of 864 bits in [ ], 128 bits in total" in lines
    assert "    10    32    160    F" in lines
    assert "     4    16     48  L20" in lines


def test_json(run: Run, program: Callable[..., Path]) -> None:
    file = program("[\nF64 5\n=0\n]\n")
    code, out, _ = run(file, "--variant", "E1", "--interface", "dual", "--json")
    assert code == 1
    assert json.loads(out) == {
        "version": 1,
        "file": str(file),
        "language": "m1486",
        "errors": 2,
        "warnings": 1,
        "diagnostics": [
            {
                "file": str(file), "line": 2, "column": 2, "end_line": 2, "end_column": 6, "severity": "error", "code": "M111",
                "message": "F 645 is not a multiple of 16", "hint": "with M4 a microstep is 16 minimum microsteps",
                "fix": {"line": 2, "column": 2, "end_line": 2, "end_column": 6, "text": "640"},
            },
            {
                "file": str(file), "line": 2, "column": 2, "end_line": 2, "end_column": 6, "severity": "warning", "code": "M202",
                "message": "blank inside a number, read as 645", "hint": None,
                "fix": {"line": 2, "column": 2, "end_line": 2, "end_column": 6, "text": "645"},
            },
            {
                "file": str(file), "line": 3, "column": 2, "end_line": 3, "end_column": 3, "severity": "error", "code": "M110",
                "message": "= 0 is out of range", "hint": "1 to 16 000 000 min. microsteps",
                "fix": {"line": 3, "column": 1, "end_line": 3, "end_column": 3, "text": "C100"},
            },
        ],
        "variant": "E1",
        "interface": "dual",
        "memory": [
            {
                "address": None,
                "limit_bits": 2000,
                "total_bits": 64,
                "file_bits": [64],
                "commands": [
                    {"line": 1, "column": 1, "command": "[", "bits": 0, "in_file": False},
                    {"line": 2, "column": 1, "command": "F645", "bits": 32, "in_file": True},
                    {"line": 3, "column": 1, "command": "=0", "bits": 32, "in_file": True},
                    {"line": 4, "column": 1, "command": "]", "bits": 0, "in_file": True},
                ],
            }
        ],
    }  # fmt: skip


def test_json_members_are_described(run: Run) -> None:
    page = (EXAMPLES.parents[1] / "docs/reference/check-json.md").read_text()
    _, out, _ = run(EXAMPLES / "example6.m1486", "--json")
    data = json.loads(out)
    chip = data["memory"][0]
    members = [*data, *chip, *chip["commands"][0]]
    assert [member for member in members if f"`{member}`" not in page] == []


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("/nowhere.m1486",), "cannot read /nowhere.m1486: no such file or directory"),
        (("gate.wbc",), "gate.wbc is a compiled image: steptwin decompile makes a program of it"),
        ((EXAMPLES,), f"cannot read {EXAMPLES}: it is a directory, not a file"),
        ((EXAMPLES / "example1.m1486", "--variant", "Z"), "no M1486 variant is called 'Z'; there are A, B, C, E1, E2, A2x"),
        ((EXAMPLES / "example1.m1486", "--interface", "usb"), "no driver interface is called 'usb'; there are sd, dual, two"),
    ],
)
def test_wrong_use_gives_exit_code_2_and_prints_nothing(run: Run, arguments: tuple[object, ...], text: str) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert text in err


def test_files_in_other_encodings(run: Run, tmp_path: Path) -> None:
    for encoding in ("utf-8-sig", "latin-1"):
        file = tmp_path / f"{encoding}.txt"
        file.write_bytes("R ; zpět".replace("ě", "é").encode(encoding))
        assert run(file)[0] == 0


def test_a_world_is_checked_with_its_files(run: Run, program: Callable[..., Path]) -> None:
    file = program('[[mic488]]\nname = "a"\nprogram = "a.prg"\n[[axis]]\nname = "x"\ndrive = "b.M1"\n', "w.toml")
    used = program("M1 = ON\nPRINT M1\nPRINT M2\nHOME M1 10\n", "a.prg")
    code, out, _ = run(file)
    assert code == 1
    assert f"{file}:3:1: error D010: a file has errors: {used}:2:1: error W137: WBC has no PRINT" in out
    assert f"{used}:3:1: error W137: WBC has no PRINT" in out
    assert f"{file}:6:1: error D009: nothing is called 'b'" in out
    assert out.endswith(f"{file}: 3 errors, 0 warnings\n")
    used.write_text("M1 = ON\nHOME M1 10\n")
    file.write_text('[[mic488]]\nname = "a"\nprogram = "a.prg"\n')
    code, out, _ = run(file)
    assert (code, out.splitlines()[-1]) == (0, f"{file}: 0 errors, 1 warning")
    assert f"{used}:2:1: warning W219" in out
    sound = program('[[mic488]]\nname = "a"\n', "sound.toml")
    assert run(sound) == (0, f"{sound}: 0 errors, 0 warnings\n", "")
    outside = program('[[mic488]]\nname = "a"\nprogram = "../a.prg"\n', "outside.toml")
    assert "../a.prg is outside the folder of the description" in run(outside)[1]


def test_a_position_table_is_checked(run: Run, program: Callable[..., Path]) -> None:
    file = program("PICK;1;2;3;4\nPICK;1;2;x;x\n", "t.csv")
    code, out, _ = run(file)
    assert (code, out.splitlines()[-1]) == (1, "2 positions")
    assert f"{file}:2:1: error W152: PICK is already the name of row 0" in out
    assert run(file, "--variant", "B")[2] == "steptwin: --variant is not for position tables\n"


def test_a_configuration_is_checked(run: Run, program: Callable[..., Path]) -> None:
    file = program("[Axis0]\nGear=100\nAcc=-1\n", "t.cfg")
    code, out, _ = run(file, "--json")
    data = json.loads(out)
    assert (data["language"], data["firmware"]) == ("config", "1.70")
    assert [(one["line"], one["severity"]) for one in data["diagnostics"] if one["line"] == 3] == [(3, "error")]
    assert code == 1
