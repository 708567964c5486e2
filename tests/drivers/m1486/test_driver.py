"""The driver against chips in virtual time: what it types, how motions end, what it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from chip_rig import ChipWire, Fault, chip_driver, chip_line

from steptwin.drivers import SentLate, Unconfirmed
from steptwin.drivers.m1486 import (
    M1486,
    Busy,
    ChipMoveFailed,
    ChipReason,
    ChipSettings,
    DoubtfulMove,
    NoEcho,
    NoRoom,
    PositionUnknown,
    Restarted,
)
from steptwin.drivers.m1486.settings import after_reset
from steptwin.drivers.m1486.sync import download_to
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.commands import memory_bits
from steptwin.m1486.lines import DUAL_DAC
from steptwin.machine import SECOND

KNOWN = {"start_stop": 200, "acceleration": 5000, "velocity": 1000, "profile": 25000, "microstep": 4, "qualification": 1}


def typed(wire: ChipWire) -> str:
    """What was sent, CR as a blank."""
    return b"".join(data for _, data in wire.sent).decode().replace("\r", " ")


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda c: c.configure(velocity=20_001), "velocity = 20001: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.configure(start_stop=15), "start_stop = 15: M1486B takes 16 to 1950 step/s"),
        (lambda c: c.configure(microstep=3), "microstep = 3: M1486B takes 1, 2, 4, 8, 16, 32, 64"),
        (lambda c: c.configure(microstep=16, qualification=1), "M16 and Q1 do not go together: with M16 go Q4"),
        (lambda c: c.move_to(-1.0), "position -1 step is outside 0 to 250000 step"),
        (lambda c: c.move_by(250_001.0), "distance 250001 step is outside ±250000 step"),
        (lambda c: c.move_by(0.25), "0.25 step is 16 minimum microsteps, which is not a whole full step"),
        (lambda c: c.seek(1, 22), "the line to seek = 22: M1486B takes 1 to 21"),
        (lambda c: c.set_output(22, True), "no line 22"),
        (lambda c: c.set_function(41, False), "function 41 is used by this driver: it stays ON"),
        (lambda c: c.command("f16000001"), "F16000001 is out of range"),
        (lambda c: c.command("r"), "'r' is not a command to type alone"),
        (lambda c: c.command("zz"), "'zz' is not a command: 'z' begins a second command (Zero) on this line"),
        (lambda c: c.command(""), "'' is not a command"),
        (lambda c: c.configure(velocity=15.5), "velocity = 15.5: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.set_position(math.inf), "inf step is not a position"),
        (lambda c: c.move_by(math.nan), "nan step is not a distance"),
        (lambda c: c.inputs(1, 10), "10 lines from B1 on = 20: M1486B takes"),
        (lambda c: c.inputs(20, 3), "3 lines from B20 on = 203: M1486B takes"),
        (lambda c: c.set_flag(87, True), "no user flag 87: they are 80 to 86"),
        (lambda c: c.set_function(64, True), "no function 64: they are 40 to 63"),
        (lambda c: c.set_function(57, True), "function 57 is used by this driver: it stays OFF"),
        (lambda c: c.seek(0, 3), "direction 0: permitted are 1 and -1"),
        (lambda c: c.uploaded(0), "0 bytes: at least 1"),
        (lambda c: c.uploaded(1), "no program of the chip was started here"),
        (lambda c: c.run_block(["f64", "\\"]), "has no place in a block"),
        (lambda c: c.run_block(["f64"] * 64), "the block is larger than the command memory of M1486B, 2032 bits"),
        (lambda c: c.download("v99999\nq"), "program is not sent:"),
        (lambda c: c.run_block(["f64"], timeout_s=-1.0), "a time to wait of -1 s is outside 0 to 1000000 s"),
        (lambda c: c.wait(float("nan")), "a time to wait of nan s is outside"),
        (lambda c: c.uploaded(1, float("inf")), "a time to wait of inf s is outside"),
        (lambda c: c.start_program(81), "the label = 81"),
        (lambda c: c.run(0), "direction 0"),
        (lambda c: c.set_variable(1 << 24), "the internal variable = 16777216: M1486B takes 0 to"),
        (lambda c: c.configure(velocity=math.inf), "velocity = inf: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.configure(velocity=math.nan), "velocity = nan: M1486B takes 16 to 20 000 step/s"),
        (lambda c: c.set_variable(-1), "the internal variable = -1: M1486B takes 0 to"),
        (lambda c: c.move_to(250_001.0), "position 250001 step is outside 0 to 250000 step"),
        (lambda c: c.move_by(-250_001.0), "distance -250001 step is outside ±250000 step"),
    ],
)
def test_misuse_is_told_before_anything_is_typed(call: object, text: str) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.sent.clear()
    with pytest.raises(Misuse) as caught:
        call(chip)  # type: ignore[operator]
    assert text in str(caught.value)
    assert wire.sent == []


# ---------------------------------------------------------------------- motion


def test_a_move_takes_the_time_it_was_computed_to_take() -> None:
    wire = ChipWire("B", interface=DUAL_DAC)
    chip = chip_driver(wire, steps_per_unit=40.0, unit="mm")
    chip.configure(**KNOWN)
    wire.sent.clear()
    chip.move_to(20.0)
    assert typed(wire).endswith("g51200 r ")
    expected = ChipSettings(**KNOWN).travel_s(51_200, chip.variant)
    end = chip.wait()
    assert str(end) == "the chip: target reached at 20 mm"
    assert expected is not None
    train = wire.chip.drive.train.profile
    assert ((train.end or 0) - train.start) / SECOND == pytest.approx(expected, abs=1e-6)
    chip.move_by(-7.5)
    assert chip.wait().position == 12.5
    assert wire.true() == 12.5 * 40 * 64


def test_the_position_is_not_known_while_it_moves_nor_after_a_stop() -> None:
    """M-28, M-16."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(5000.0)
    with pytest.raises(Busy, match="the chip is not done with a move: wait for its end or stop it"):
        chip.position()
    chip.stop()
    assert chip.wait(check=False).reason is ChipReason.STOPPED
    with pytest.raises(PositionUnknown, match="shows its target, not where it was stopped"):
        chip.position()
    with pytest.raises(PositionUnknown):
        chip.move_to(10.0)
    place = wire.true()
    chip.move_by(10.0)
    assert chip.wait().ok
    assert wire.true() == place + 640
    chip.set_position(100.0)
    assert chip.position() == 100.0


def test_a_run_without_end() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(-1, velocity=300)
    wire.sleep(2.0)
    with pytest.raises(Misuse, match="runs without end: give timeout_s"):
        chip.wait()
    assert chip.wait(0.5, check=False).reason is ChipReason.OVERDUE
    chip.stop()
    end = chip.wait(check=False)
    assert end.reason is ChipReason.STOPPED
    assert end.position == (wire.true() & 0xFFFFFF) / 64
    assert wire.true() < -500 * 64


def test_a_seek() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.at(0.9, lambda: wire.chip.set_pin("B2", 0, wire.now))
    chip.seek(-1, 2)
    assert chip.wait().reason is ChipReason.SOUGHT
    assert -200 * 64 < wire.true() < -100 * 64


def test_limit_ends_a_move_early() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**{**KNOWN, "microstep": 1})
    chip.move_by(5000.0)
    wire.at(1.0, lambda: wire.chip.set_pin("LIMIT", 0, wire.now))
    with pytest.raises(ChipMoveFailed, match=r"ended early \(LIMIT, or Kill from another program\)"):
        chip.wait()
    with pytest.raises(PositionUnknown):
        chip.position()
    chip.set_limit(False)
    chip.move_by(-100.0)
    assert chip.wait().ok
    chip.set_limit(True)
    wire.chip.set_pin("LIMIT", 1, wire.now)
    chip.run(1)
    wire.at(1.0, lambda: wire.chip.set_pin("LIMIT", 0, wire.now))
    assert chip.wait(5.0, check=False).reason is ChipReason.LIMIT


def test_a_chip_held_by_kill_is_recovered() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_function(51, False)
    chip.run(1)
    chip.stop()
    wire.sleep(1.0)
    with pytest.raises(Busy, match="is held by Kill because its function 51 is OFF: recover it"):
        chip.position()
    chip.recover()
    assert chip.position() == wire.true() / 64


def test_a_move_that_is_late_is_overdue() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(5000.0)
    end = chip.wait(1.0, check=False)
    assert (end.reason, end.position) == (ChipReason.OVERDUE, None)
    assert chip.wait().reason is ChipReason.TARGET


def test_a_move_of_nothing_is_over_at_once_and_types_nothing() -> None:
    """R would make the move before once more."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.move_by(700.0)
    chip.wait()
    wire.sent.clear()
    for move in (lambda: chip.move_by(0.0), lambda: chip.move_to(700.0)):
        move()
        end = chip.wait()
        assert (end.reason, end.position) == (ChipReason.TARGET, 700.0)
    assert not {"r", "h"} & set(typed(wire).split())
    assert wire.true() == 700 * 64


def test_settings_typed_by_hand_are_known_again() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    function = chip._driver._unit.notes.function
    chip.configure(**KNOWN)
    chip.command("s300")
    assert (chip.settings.start_stop, chip.settings.velocity) == (300, KNOWN["velocity"])
    chip.set_variable(400)
    chip.command("v")
    assert chip.settings.velocity is None, "it is what the variable was"
    for text, on in (("c51", False), ("t51", True), ("c52", True)):
        chip.command(text)
        assert function(51) is on, text
    assert function(52) is False


@pytest.mark.parametrize(("command", "is_once"), [("+5", True), (":5", False)])
def test_a_command_whose_cr_may_have_been_heard_is_typed_again_where_that_does_no_harm(command: str, is_once: bool) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.put(Fault("to host", len("u20|B") + len(command), "drop"))
    if is_once:
        with pytest.raises(LineFailure, match="it is unknown whether"):
            chip.command(command)
    else:
        chip.command(command)
    assert wire.faults[0].met
    assert chip.variable() == 5


def test_what_is_reset_by_force_brakes_before() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    wire.sent.clear()
    chip.reset(force=True)
    assert typed(wire).split()[0] == "k"
    assert not wire.moving()


def test_a_block_that_is_one_command_too_large() -> None:
    """2032 bits, of which eight are the end of the file and eight are kept free."""
    chip = chip_driver(ChipWire("B"))
    most = (2032 - 8 - 8 - memory_bits("U")) // memory_bits("R")
    with pytest.raises(Misuse, match="the block is larger than the command memory"):
        chip.run_block(["r"] * (most + 1))


# ---------------------------------------------------------------------- programs


def test_a_program_whose_chip_was_recovered_is_not_held_any_more() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_function(51, False)
    chip.download("[\n@3\nF64000\nR\nJ3\n]")
    wire.sleep(0.3)
    chip.stop()
    wire.sleep(1.0)
    with pytest.raises(Busy, match="is held by Kill because its function 51 is OFF"):
        chip.counter()
    chip.recover()
    with pytest.raises(Busy, match="is not done with a block of commands"):
        chip.counter()


@pytest.mark.parametrize(("function", "is_recovered"), [(True, False), (False, True), (None, True)])
def test_a_program_that_is_ended_is_recovered_unless_the_chip_does_so_itself(function: bool | None, is_recovered: bool) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    if function is not None:
        chip.set_function(51, function)
    chip.download("[\n@3\nF640\nR\nJ3\n]")
    wire.sleep(1.0)
    if function is None:
        chip._driver._unit.notes.functions = None
    wire.sent.clear()
    chip.stop_program()
    assert ("c75" in typed(wire).split()) is is_recovered
    wire.sleep(5.0)
    assert not wire.moving()
    assert not chip.is_busy()


def test_a_program_that_wrong_data_does_not_end_is_told_in_the_time_given() -> None:
    """Function 44 ON."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_function(44, True)
    chip.set_function(51, False)
    chip.download("[\n@3\nF640\nR\nW100\nJ3\n]")
    wire.sleep(1.0)
    for options, seconds in (({}, 10.0), ({"timeout_s": 3.0}, 3.0)):
        begin = wire.now
        with pytest.raises(Busy, match="memory: the chip continues: function 44 is ON, LIMIT is low, or it is still braking"):
            chip.stop_program(**options)
        assert seconds <= (wire.now - begin) / SECOND < seconds + 0.95
    with pytest.raises(Busy, match="the chip does not answer yet"):
        chip.counter()


@pytest.mark.parametrize("kind", ["A", "B"])
def test_questions_between_commands_come_when_the_buffer_may_be_full_and_not_before(kind: str) -> None:
    """What may lie in the input buffer leaves room for a question and three characters more."""
    wire = ChipWire(kind)
    chip = chip_driver(wire)
    room = chip.variant.input_bits // 8 - 3 - len("u20|")
    lines = [f"f{10**n * 64 // 64 * 64}" if n % 2 else "t80" for n in (0, 1, 2, 3, 1, 2, 0, 0, 3, 1, 0, 2, 2, 1, 3, 0, 0, 1)] * 3
    wire.sent.clear()
    chip.download("\n".join(lines))
    pieces = [piece.split() for piece in typed(wire).split("u20 ")[1:]]
    assert [line for piece in pieces for line in piece] == lines
    for piece, following in pairwise(pieces):
        held = sum(len(line) + 1 for line in piece)
        assert held <= room or len(piece) == 1
        assert held + len(following[0]) + 1 > room


def test_a_program_may_stop_the_motor_at_once() -> None:
    """K is not put behind what waits in the chip."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.download("g+\nr\nk\n")
    wire.sleep(2.0)
    assert not wire.moving()
    assert typed(wire).split()[-1] == "k"


def test_a_program_that_resets_the_chip_waits_for_what_it_does_and_leaves_it_as_at_power_up() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)
    chip.download("f640\nr\n\\\nt80")
    assert wire.codes().count("moves") == 1
    assert wire.true() == 640
    assert chip.counter() == 0
    assert chip.flags()[80]


def test_settings_after_a_reset_are_those_of_power_up() -> None:
    chip = chip_driver(ChipWire("B", interface=DUAL_DAC))
    chip.configure(**KNOWN)
    chip.reset()
    assert chip.settings == after_reset(chip.variant, DUAL_DAC)
    assert chip.settings != ChipSettings()


def test_a_chip_that_takes_no_more_for_a_minute_is_told() -> None:
    wire = ChipWire("A")
    chip = chip_driver(wire)
    begin = wire.now
    with pytest.raises(Busy, match="memory: the chip takes no more characters: it is not done with a block of commands"):
        chip.download("g+\nr\n" + "f64\n" * 10)
    assert 60.0 <= (wire.now - begin) / SECOND < 65.0


def test_a_program_is_not_typed_into_a_chip_that_moves() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    wire.sent.clear()
    with pytest.raises(Busy):
        chip.download("t80")
    assert "t80" not in typed(wire)


def test_a_byte_that_came_in_time_is_taken_at_the_end_of_the_time() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.download("[\nW1000\nU2\n]")
    wire.sleep(5.0)
    assert chip.uploaded(1, timeout_s=0.0) == b"\0"


def test_a_block_is_done_when_its_last_command_is() -> None:
    wire = ChipWire("A")
    chip = chip_driver(wire)
    begin = wire.now
    end = chip.run_block(["f640", "r", "w1500", "d", "r", "t3"])
    assert end.reason is ChipReason.DONE
    assert wire.now - begin > 1.5 * SECOND
    assert wire.true() == 0
    assert [event.text for _, event in wire.happened if event.code == "moves"][1].startswith("moves -640")


@pytest.mark.parametrize("kind", ["A", "B"])
@pytest.mark.parametrize(
    ("commands", "moved"),
    [
        (["f6400", "e"], 0),  # E outside a loop
        ([":1", "v", "f6400", "r"], 0),  # V1
        (["f640", "r", ":15", "q", "r"], 640),  # Q15
    ],
)
def test_a_block_that_a_command_of_it_ends_is_not_done(kind: str, commands: list[str], moved: int) -> None:
    """What the chip was asked meanwhile goes with the block, so it is asked again."""
    wire = ChipWire(kind)
    chip = chip_driver(wire)
    begin = wire.now
    with pytest.raises(ChipMoveFailed, match=r"cut short .*\(a command was wrong data when it was executed") as failed:
        chip.run_block(commands)
    assert failed.value.end.reason is ChipReason.CUT
    assert wire.true() == moved
    assert wire.now - begin < 5 * SECOND
    assert chip.run_block(["f640", "r"]).ok
    assert chip.counter() == moved + 640


def test_a_block_that_ends_late_is_seen_to_have_ended() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    begin = wire.now
    with pytest.raises(ChipMoveFailed, match="cut short"):
        chip.run_block(["w12000", "e"])
    assert 12 * SECOND < wire.now - begin < 20 * SECOND
    with pytest.raises(Misuse, match="no program of the chip was started here"):
        chip.uploaded(1)


PROGRAM = "[\n@1\nf640\nr ; to and fro\nw500\nd\nr\nw500\nj1\n]\n"


def test_a_file_of_another_kind_is_refused_in_a_few_words() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.sent.clear()
    with pytest.raises(Misuse, match=r"^notes.txt is not sent:") as refused:
        chip.download("~\n" * 1000, name="notes.txt")
    assert str(refused.value).count("error M") == 10
    assert str(refused.value).endswith("\nand 990 more errors")
    assert wire.sent == []


def test_a_program_is_downloaded_runs_and_is_ended() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    seen: list[tuple[int, int]] = []
    chip.download(PROGRAM, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (10, 10)
    wire.sleep(5.0)
    assert wire.codes().count("moves") > 5
    assert chip.is_busy()
    with pytest.raises(Busy):
        chip.move_by(1.0)
    chip.stop_program()
    count = wire.codes().count("moves")
    wire.sleep(5.0)
    assert wire.codes().count("moves") == count
    assert not wire.moving()
    chip.start_program(1)
    wire.sleep(5.0)
    assert wire.codes().count("moves") > count + 2
    chip.reset(force=True)
    assert chip.position() == 0.0


def test_what_a_program_uploads_is_read() -> None:
    """Its position after each move, and every byte there is: 7FH and 7EH are none of function 57 here."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    with pytest.raises(Misuse, match="no program of the chip was started here"):
        chip.uploaded()
    chip.download("[\n@1\nf640\nr\nu1\nw300\nj1\n]\n")
    assert chip.uploaded(3) == bytes((640 * move & 0xFF) for move in (1, 2, 3))
    wire.sleep(10.0)
    assert chip.uploaded(2, 0.0) == bytes((640 * move & 0xFF) for move in (4, 5))
    chip.stop_program()
    chip.download("[\n:32382\nu4\nu5\n]\n")
    assert chip.wait().ok
    with pytest.raises(LineFailure, match="the chip uploaded 2 of 3 bytes within 1 s"):
        chip.uploaded(3, 1.0)
    assert chip.uploaded(2) == bytes((0x7E, 0x7E))
    assert chip.variable() == 0x7E7E
    with pytest.raises(Misuse, match="0 bytes: at least 1"):
        chip.uploaded(0)


def test_uploads_of_two_programs_cannot_be_told_apart() -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    chips = [M1486(line, 0), M1486(line, 7)]
    for chip in chips:
        chip.open()
        chip.download("[\n@1\nw900\nu1\nj1\n]\n")
    with pytest.raises(Misuse, match="another chip runs a program too"):
        chips[0].uploaded()
    chips[0].stop_program()
    assert chips[1].uploaded() == b"\0"


def test_a_file_for_an_eeprom_is_paced_and_kept() -> None:
    """Chapter II: half a second for each command, a second to erase."""
    wire = ChipWire("E1", (3,))
    chip = chip_driver(wire, 3)
    assert wire.codes().count("wrong-data") == 0
    begin = wire.now
    chip.download(PROGRAM)
    assert wire.now - begin > (1.0 + 10 * 0.5) * SECOND
    assert "wrong-data" not in wire.codes()
    wire.sleep(3.0)
    wire.chip.power_cycle(wire.now)
    wire.happened.clear()
    wire.sleep(3.0)
    assert "moves" in wire.codes()
    with pytest.raises(Misuse, match="writes what is in"):
        chip.run_block(["f64"])


def test_plain_commands_are_typed_as_the_buffer_takes_them() -> None:
    """Example 1 of the manual and more moves than the twelve characters of an A hold."""
    wire = ChipWire("A")
    chip = chip_driver(wire)
    answers = chip.download("\\\nf12800\nr\nb6400\nr\nf640\nr\nd\nr\nu2\n")
    wire.sleep(10.0)
    assert answers == bytes([6400 >> 8])
    assert wire.true() == 6400
    assert "wrong-data" not in wire.codes()


@pytest.mark.parametrize(
    ("program", "steps"),
    [
        ("l3\n[\nf640\nr\ne\n]", 30),
        ("f640\nr\nl3\n[\nf640\nr\n]\nb64\nr\ne", 40 - 3),
        ("l2\nf640\nr\nm1\nl2\n[\nb64\nr\ne\n]\nt6\ne", 20 - 4),
        ("@3\n[\nf640\nr\nt80\n]\nb64\nr\ni2l3", 9),
    ],
)
def test_nothing_is_asked_where_a_loop_or_a_jump_comes_by_again(program: str, steps: int) -> None:
    """A question typed there would be part of it: every turn would upload a byte, and take a place in the memory."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)  # type: ignore[arg-type]
    wire.sent.clear()
    chip.download(program)
    lines = program.split("\n")
    begin = next(n for n, line in enumerate(lines) if line[0] in "l@")
    assert " ".join(lines[begin:]) in typed(wire)
    assert chip.wait().ok
    assert wire.true() == steps * 64
    assert "wrong-data" not in wire.codes()


def test_example_6_of_the_manual_needs_both_its_chips() -> None:
    text = "x0\n:0\n[\nl3\nc1\nt1\n+64\nf\nr\ne\n]\nx7\n[\nf640\nr\n]\n"
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    chips = [M1486(line, 0), M1486(line, 7)]
    for chip in chips:
        chip.open()
    download_to(chips, text)
    assert [chip.wait().reason for chip in chips] == [ChipReason.DONE] * 2
    assert (wire.true(0), wire.true(7)) == (64 + 128 + 192, 640)
    with pytest.raises(Misuse, match="it names chip 7, which is not on this line"):
        download_to(chips[:1], text)
    with pytest.raises(Misuse, match="no X before F64 selects its chip"):
        download_to(chips, "f64\nr\nx0\nr\n")
    download_to(chips, "f64\nr\nx0\nr\n", first=chips[1])
    assert [chip.wait().reason for chip in chips] == [ChipReason.DONE] * 2
    assert (wire.true(0), wire.true(7)) == (2 * 192 + 128 + 64, 704)


def test_a_program_is_for_chips_of_one_type() -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    chips = [M1486(line, 0, variant="B"), M1486(line, 7, variant="B2x")]
    for chip in chips:
        chip.open()
    with pytest.raises(Misuse, match="chip 0 is an M1486B, chip 7 an M1486B2x"):
        download_to(chips, "x0\nr\nx7\nr\n")


def test_a_chip_that_has_no_room_refuses_and_the_command_is_named() -> None:
    """The buffer of an A is full of what another host has typed while it moves."""
    wire = ChipWire("A")
    chip = chip_driver(wire)
    chip.move_by(5000.0)
    wire.chain.receive(b"f640\rf64\r", wire.now)
    wire.sleep(0.2)
    with pytest.raises(NoRoom, match=r"'the chip: u20' was refused: the input buffer has no room \(5EH\)"):
        chip.wait()
    chip.stop()
    wire.sleep(1.0)
    assert chip.counter() >= 0


# ---------------------------------------------------------------------- nobody there


def test_who_does_not_echo_is_told() -> None:
    wire = ChipWire("B", (7,))
    with pytest.raises(NoEcho, match="chip 3 does not echo: it is off, has another address or baud rate"):
        chip_driver(wire, 3)


@pytest.mark.parametrize("call", [lambda c: c.move_to(0.25), lambda c: c.move_by(-0.25), lambda c: c.position()])
def test_a_chip_that_was_switched_off_is_not_moved_with_what_it_was_set_to(call: Callable[[M1486], object]) -> None:
    """With M1 it would drop f16 as wrong data, and R would make the default move of a thousand steps."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(microstep=4)
    chip.set_position(100.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted, match="chip 7 was switched off or reset meanwhile"):
        call(chip)
    assert wire.true() == 0
    assert chip.settings == ChipSettings()
    assert chip.counter() == 0
    with pytest.raises(PositionUnknown):
        chip.position()


def test_after_a_restart_a_busy_chip_is_not_held_by_an_earlier_kill() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.set_function(51, False)
    chip.run(1)
    chip.stop()
    wire.sleep(1.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted):
        chip.variable()
    chip.set_function(51, False)
    chip.run(1)
    with pytest.raises(Busy, match="chip 7 is not done with a run without end: wait for its end or stop it"):
        chip.variable()


def test_after_a_restart_the_motion_before_it_is_over() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.sleep(1.0)
    wire.chip.power_cycle(wire.now)
    with pytest.raises(Restarted):
        chip.flags()
    assert chip.wait().reason is ChipReason.REST


def test_a_chip_that_is_switched_off_between_the_distance_and_the_run_does_not_move() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(microstep=4)

    def cycle(data: bytes) -> None:
        if data == b"r":
            wire.before_each = None
            wire.chip.power_cycle(wire.now)

    wire.before_each = cycle
    with pytest.raises(Restarted):
        chip.move_by(0.25)
    wire.sleep(5.0)
    assert wire.true() == 0


def test_a_cut_line_is_told() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.run(1)
    wire.severed = True
    with pytest.raises(Unconfirmed, match="chip 7 could not be stopped: it cannot be reached and continues its last command"):
        chip.stop()
    assert chip.wait(1.0, check=False).reason in (ChipReason.COMMUNICATION, ChipReason.STOPPED)
    wire.severed = False
    chip.stop()
    wire.sleep(1.0)
    assert not wire.moving()


def test_a_line_that_is_cut_when_a_move_begins_leaves_it_in_doubt() -> None:
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)

    def cut(data: bytes) -> None:
        wire.severed = wire.severed or (data == b"\r" and wire.sent[-1][1] == b"r")

    wire.before_each = cut
    with pytest.raises(DoubtfulMove, match="it is unknown whether chip 7 has begun a move") as caught:
        chip.move_by(10.0)
    assert caught.value.uncertain
    wire.before_each, wire.severed = None, False
    wire.sleep(2.0)
    assert chip.counter() == wire.true() == 0


def test_a_move_that_was_sent_too_late_is_stopped_and_said_to_be_so() -> None:
    """The process is suspended while it writes the CR of the command that moves."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(**KNOWN)
    begin = wire.true()

    def suspend(data: bytes) -> None:
        if data == b"\r" and wire.sent[-1][1] == b"r":
            wire.before_each = None
            wire.sleep(70.0)

    wire.before_each = suspend
    with pytest.raises(SentLate, match="was sent more than"):
        chip.move_by(500.0)
    wire.sleep(2.0)
    assert not wire.moving()
    assert 0 <= wire.true() - begin < 64 * 30
    assert chip.wait(check=False).reason is ChipReason.STOPPED


def test_a_chip_that_cannot_be_told_to_stop_is_told_with_the_first_cause() -> None:
    """That nothing came back to Kill, whatever was tried afterwards."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    wire.severed = True
    with pytest.raises(Unconfirmed) as caught:
        chip.stop()
    assert "(memory: no answer to 'chip 7: k' within 0.5 s" in str(caught.value)
    assert "does not echo" not in str(caught.value)
    assert "does not echo" in str(caught.value.__cause__)


def test_what_is_not_stored_takes_no_time_of_the_memory() -> None:
    """An E type writes commands into its EEPROM; C75 acts when it is received."""
    wire = ChipWire("E1")
    chip = chip_driver(wire)
    wire.sleep(5.0)
    notes = chip._driver._unit.notes
    chip.recover()
    assert notes.ready_at <= wire.now
    chip.set_flag(80, True)
    assert notes.ready_at > wire.now


def test_a_block_is_not_typed_into_a_chip_that_moves() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    with pytest.raises(Busy, match="the chip is not done with a run without end: wait for its end or stop it"):
        chip.run_block(["f64"])
    assert "[" not in typed(wire)


def test_an_end_says_how_long_it_was_waited_for() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)
    chip.move_by(100.0)
    wire.sleep(0.1)
    begin = wire.now
    end = chip.wait()
    assert end.after_s == pytest.approx((wire.now - begin) / SECOND, abs=0.05)
    assert 0.1 < end.after_s < 10.0


def test_how_far_a_download_is_is_told_after_each_command() -> None:
    """Plain commands, then a file, and what stands behind it."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    told: list[tuple[int, int]] = []
    chip.download("T6\nC6\n[\nF64\nR\n]\n", progress=lambda done, total: told.append((done, total)))
    assert told == [(n, 6) for n in (1, 2, 3, 4, 5, 6, 6)]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"steps_per_unit": 0.0}, "steps_per_unit = 0: must be above 0"),
        ({"steps_per_unit": -1.0}, "steps_per_unit = -1: must be above 0"),
        ({"steps_per_unit": math.inf}, "steps_per_unit = inf: must be above 0"),
        ({"steps_per_unit": math.nan}, "steps_per_unit = nan: must be above 0"),
        ({"timeout_s": 0.0}, "a time-out of 0 s is outside 0 to 60 s"),
        ({"timeout_s": 60.5}, "a time-out of 60.5 s is outside 0 to 60 s"),
        ({"address": 16}, "address 16: permitted are 0 to 15"),
        ({"address": -1}, "address -1: permitted are 0 to 15"),
        ({"origin_u": -1}, "origin_u = -1: permitted are 0 to 16000000 minimum microsteps"),
        ({"origin_u": 16_000_001}, "origin_u = 16000001: permitted are 0 to 16000000 minimum microsteps"),
    ],
)
def test_what_is_no_chip(options: dict[str, float], text: str) -> None:
    with pytest.raises(Misuse) as caught:
        M1486(chip_line(ChipWire("B")), **options)  # type: ignore[arg-type]
    assert str(caught.value) == text


@pytest.mark.parametrize("options", [{"timeout_s": 60.0}, {"address": 0}, {"address": 15}, {"origin_u": 16_000_000}])
def test_what_is_just_a_chip(options: dict[str, float]) -> None:
    assert M1486(chip_line(ChipWire("B")), **options).unit == "step"  # type: ignore[arg-type]


def test_how_long_a_move_takes_is_known_when_all_settings_are() -> None:
    """A B type at 12 MHz; with M16 V cannot be more than 750 full steps/s (Q4), with Q1 it can."""
    settings = ChipSettings(start_stop=200, acceleration=5000, velocity=1000, profile=25000, qualification=1)
    chip = chip_driver(ChipWire("B"))
    # 96 full steps up to 1000/s in 0.16 s, as many down, 808 between.
    assert settings.travel_s(1000 * 64, chip.variant) == pytest.approx(0.16 + 0.16 + 0.808)
    for name in ("start_stop", "acceleration", "velocity", "profile", "qualification"):
        assert settings.with_(**{name: None}).travel_s(64_000, chip.variant) is None


def test_the_face_for_threads_passes_all_its_arguments_on() -> None:
    said: list[str] = []
    chip = M1486(
        "/dev/none", 7, baud=9600, variant="C", steps_per_unit=40.0, unit="mm", origin_u=640, timeout_s=0.75, log=said.append
    )
    driver = chip._driver
    assert (chip.address, chip.unit, chip.place) == (7, "mm", "/dev/none")
    assert (driver.scale_u, driver.origin_u, driver._unit.timeout_ns) == (2560.0, 640, 750_000_000)
    assert driver._variant is not None
    assert driver._variant.name == "C"
    talk = driver._unit.talk
    assert talk.wire_ns(1) == pytest.approx(10 * SECOND / 9600, abs=1)
    talk.start(ChipRequest(None, "t6"), 0, urgent=False)
    assert len(said) == 1
    assert said[0].endswith("t6")
