"""Programs on a served twin, selected, started, paused and watched by pymodbus. Addresses are those of firmware 1.70."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.peers

EXAMPLES = Path(__file__).parents[2] / "examples" / "mic488"
PROG_BANK_SEL, POS_BANK_SEL, PROGRAM_CTRL, M_STATUS = 10001, 10002, 10003, 10009
STOP, START, PAUSE = 0, 1, 2

#: Counts in $I0, twenty times a second, shows what it has done in $R2 and its bank in $I4.
COUNTER = """\
SET n = 0
$I4 = {bank}
MAIN:
n = n + 1
$I0 = n
$R2 = n / 4
OUT1 = ON
DELAY 0.05
JUMP MAIN
"""
#: Goes to and fro until $I9 is set, then divides by $I10.
TO_AND_FRO = """\
M1 = ON
WHILE $I9 = 0
    MOVEPTP 0
    WAITPOS
    MOVEPTP 1
    WAITPOS
    $I8 = 1
ENDWHILE
$R12 = 1 / $I10
"""


def until(condition: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def output(master: Any, number: int) -> bool:
    return master.client.read_coils(6000, count=8, device_id=1).bits[number - 1]


def test_select_start_pause_continue_stop(serve: Callable[..., Any], connect: Callable[..., Any], tmp_path: Path) -> None:
    for bank in (0, 3):
        (tmp_path / f"{bank}.prg").write_text(COUNTER.format(bank=bank))
    twin = serve("--program", f"0={tmp_path}/0.prg", "--program", f"3={tmp_path}/3.prg")
    master = connect(twin.tcp_port)

    def counted() -> int:
        return master.words(0)[0]

    assert master.words(PROGRAM_CTRL) == [STOP]
    master.word(PROG_BANK_SEL, 3)
    master.word(PROGRAM_CTRL, START)
    until(lambda: counted() >= 3)
    assert (master.words(PROGRAM_CTRL), master.words(M_STATUS), master.words(4)) == ([START], [0], [3])
    words = master.words(0, 4)
    assert master.real(words[2:]) in (words[0] / 4, (words[0] - 1) / 4)

    master.word(PROGRAM_CTRL, PAUSE)
    paused = counted()
    time.sleep(0.2)
    assert (counted(), master.words(PROGRAM_CTRL)) == (paused, [PAUSE])
    assert output(master, 1)
    master.word(PROGRAM_CTRL, START)
    until(lambda: counted() > paused)

    # Another bank counts from the next start.
    master.word(PROG_BANK_SEL, 0)
    assert (master.words(PROGRAM_CTRL), master.words(4)) == ([START], [3])
    master.word(PROGRAM_CTRL, STOP)
    assert master.words(PROGRAM_CTRL) == [STOP]
    assert not output(master, 1)
    master.word(PROGRAM_CTRL, START)
    until(lambda: master.words(4) == [0])
    assert counted() <= 3


def test_empty_banks_and_program_errors(serve: Callable[..., Any], connect: Callable[..., Any], tmp_path: Path) -> None:
    program, table = tmp_path / "go.prg", tmp_path / "go.csv"
    program.write_text(TO_AND_FRO)
    table.write_text("a;20;x;x;x\nb;0;x;x;x\n")
    twin = serve("--program", f"1={program}", "--positions", f"2={table}")
    master = connect(twin.tcp_port)
    for program_bank, position_bank in ((0, 2), (1, 1)):
        master.word(PROG_BANK_SEL, program_bank)
        master.word(POS_BANK_SEL, position_bank)
        master.word(PROGRAM_CTRL, START)
        assert (master.words(PROGRAM_CTRL), master.words(M_STATUS)) == ([STOP], [2])
    assert twin.state()["pins"]["ERR"] == 1.0
    master.word(POS_BANK_SEL, 2)
    master.word(PROGRAM_CTRL, START)
    until(lambda: master.words(8) == [1])
    assert master.words(M_STATUS) == [0]
    master.word(9, 1)
    until(lambda: master.words(M_STATUS) == [2])
    assert master.words(PROGRAM_CTRL) == [STOP]
    assert [line for line in twin.lines if "line 9: division by zero" in line]
    refused = master.client.write_register(PROG_BANK_SEL, 6, device_id=1)
    assert refused.exception_code == 3


def test_an_example_that_starts_at_power_on(serve: Callable[..., Any], connect: Callable[..., Any]) -> None:
    """The slave of the examples answers a master's commands by an interrupt."""
    twin = serve("--program", f"0={EXAMPLES}/slave.prg", "--config", f"{EXAMPLES}/slave.cfg")
    master = connect(twin.tcp_port)
    assert master.words(PROGRAM_CTRL) == [START]
    twin.command("pin", "IN2=1")
    until(lambda: master.words(110, 2) == [2, 0])
    master.reals(104, 1.25, -3.5)
    master.word(100, 3)
    until(lambda: master.words(101) == [3])
    assert master.real(master.words(108, 2)) == -2.25
    twin.command("power-cycle")
    until(lambda: master.words(110, 2) == [2, 0])
    assert (master.words(PROGRAM_CTRL), master.words(101)) == ([START], [0])


def test_wrong_programs_are_not_served(serve: Callable[..., Any], tmp_path: Path) -> None:
    twin = serve()
    program = tmp_path / "wrong.prg"
    program.write_text("M1 = ON\nPABS M1\n")
    checked = twin.command("check", str(program))
    refused = twin.command("serve", "mic488", "--name", "other", "--tcp", "127.0.0.1:0", "--program", str(program))
    assert (checked.returncode, refused.returncode, refused.stdout) == (1, 2, "")
    finding = checked.stdout.rpartition(f"{program}: 1 error")[0]
    assert f"{program}:2:6: error W120" in finding
    assert refused.stderr == finding
