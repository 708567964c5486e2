"""Programs from files into banks, with everything that can be wrong about them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from steptwin.errors import Misuse
from steptwin.files.programbanks import ProgramErrors, parse_banks, read_banks
from steptwin.mic488.config import ControllerConfig

Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write_file(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write_file


def test_banks_are_named_or_bank_0() -> None:
    assert parse_banks("--program", ["a.prg", "5=dir/b=c.prg"], 6) == {0: Path("a.prg"), 5: Path("dir/b=c.prg")}
    assert parse_banks("--program", ["x=1.prg"], 6) == {0: Path("x=1.prg")}
    assert parse_banks("--program", [], 6) == {}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["6=a.prg"], "--program 6=a.prg: permitted are banks 0 to 5"),
        (["0=a.prg", "b.prg"], "--program b.prg: bank 0 has a.prg already"),
        (["1="], "--program 1=: expected BANK=FILE, such as 0=machine.prg"),
    ],
)
def test_banks_that_cannot_be(given: list[str], message: str) -> None:
    with pytest.raises(Misuse) as refused:
        parse_banks("--program", given, 6)
    assert str(refused.value) == message


def test_names_of_positions_are_those_of_the_own_bank_or_of_the_only_table(write: Write) -> None:
    program = write("a.prg", "M1 = ON\nMOVEPTP @top\n")
    first, second = write("1.csv", "low;0;x;x;x\ntop;1;x;x;x\n"), write("2.csv", "top;2;x;x;x\n")
    banks = read_banks({0: program, 2: program}, {0: first, 2: second}, ControllerConfig())
    assert sorted(banks.programs) == [0, 2]
    assert banks.positions[2].rows[0].values == (2.0, None, None, None)
    assert banks.programs[0].steps != banks.programs[2].steps
    alone = read_banks({3: program}, {1: first}, ControllerConfig())
    assert alone.programs[3].steps == banks.programs[0].steps
    with pytest.raises(Misuse, match=r"a\.prg names positions: give the table with --positions 3=FILE$"):
        read_banks({3: program}, {0: first, 2: second}, ControllerConfig())


def test_errors_of_all_files_come_at_once(write: Write) -> None:
    wrong, right = write("a.prg", "PABS M1\n"), write("b.prg", "OUT1 = ON\nJUMP NOWHERE\n")
    table = write("a.csv", "top;1\n")
    with pytest.raises(ProgramErrors) as refused:
        read_banks({0: wrong, 1: right}, {0: table}, ControllerConfig())
    codes = {Path(source.name).name: [d.code for d in found] for source, found in refused.value.findings}
    assert codes == {"a.csv": ["W150"], "a.prg": ["W120"], "b.prg": ["W110"]}
    shown = [line.partition(": error ")[0] for line in str(refused.value).splitlines() if ": error " in line]
    assert shown == [f"{table}:1:1", f"{wrong}:1:6", f"{right}:2:6"]


def test_warnings_are_kept_and_stop_nothing(write: Write) -> None:
    banks = read_banks({0: write("a.prg", "PABS M1 5\n")}, {}, ControllerConfig())
    assert [d.code for _, found in banks.findings for d in found] == ["W207"]
    assert banks.programs[0].source.text == "PABS M1 5\n"


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(Misuse, match=r"cannot read .*none\.prg: no such file"):
        read_banks({0: tmp_path / "none.prg"}, {}, ControllerConfig())
