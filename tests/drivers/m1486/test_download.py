"""Blocks and programs: what is typed into a chip, when it is over, what it uploads, which files are refused."""

from __future__ import annotations

from itertools import pairwise

import pytest
from chip_rig import KNOWN, ChipWire, chip_driver, chip_line, typed

from steptwin.controller import SECOND
from steptwin.drivers.m1486 import (
    M1486,
    Busy,
    ChipMoveFailed,
    ChipReason,
    ChipSettings,
    FileGivenUp,
    NoRoom,
)
from steptwin.drivers.m1486.settings import after_reset
from steptwin.drivers.m1486.sync import download_to
from steptwin.drivers.m1486.unit import PATIENCE_NS
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.commands import memory_bits
from steptwin.m1486.lines import DUAL_DAC


def test_a_block_that_is_one_command_too_large() -> None:
    """2032 bits, of which eight are the end of the file and eight are kept free."""
    chip = chip_driver(ChipWire("B"))
    most = (2032 - 8 - 8 - memory_bits("U")) // memory_bits("D")
    with pytest.raises(Misuse, match="the block is larger than the command memory"):
        chip.run_block(["d"] * (most + 1))
    assert chip.run_block(["d"] * most).ok


def test_a_file_may_be_typed_for_longer_than_a_request_may_wait() -> None:
    wire = ChipWire("B")
    chip_driver(wire).download("t80\n" * 700 + "f64\nr")
    assert wire.now > PATIENCE_NS
    assert typed(wire).endswith("f64 r ")


def test_a_program_whose_chip_was_recovered_is_not_held_any_more() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_function(51, False)
    chip.download("[\n@3\nF64000\nR\nJ3\n]")
    wire.sleep(0.3)
    wire.send(b"k\r")  # of another master: the program goes on behind C75
    wire.sleep(1.0)
    chip._driver._unit.shared.is_killed = True
    with pytest.raises(Busy, match="is held by Kill because its function 51 is OFF"):
        chip.counter()
    chip.recover()
    with pytest.raises(Busy, match="is not done with a block of commands"):
        chip.counter()
    # A stop of ours ends it: nothing is left to be recovered.
    chip.stop()
    chip.recover()
    wire.sleep(1.0)
    assert not wire.moving()


@pytest.mark.parametrize(("function", "is_recovered"), [(True, False), (False, True), (None, True)])
def test_a_program_that_is_ended_is_recovered_unless_the_chip_does_so_itself(function: bool | None, is_recovered: bool) -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    if function is not None:
        chip.set_function(51, function)
    chip.download("[\n@3\nF640\nR\nJ3\n]")
    wire.sleep(1.0)
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
        with pytest.raises(
            Busy, match=r"memory: the chip is not at rest: Kill holds it .* C75 was not sent, because function 44 may be ON"
        ):
            chip.stop_program(**options)
        assert seconds <= (wire.now - begin) / SECOND < seconds + 0.95
    with pytest.raises(Busy, match="the chip is held by Kill because its function 51 is OFF"):
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


@pytest.mark.parametrize(
    ("steps", "commands"),
    [(150, "t80 c80 m1 m1"), (49, "[ m1 t80 m1 m1 ]")],
    ids=["commands", "a file"],
)
def test_what_takes_one_of_the_last_places_of_the_buffer_is_followed_by_a_pause(steps: int, commands: str) -> None:
    """In a loop, where nothing may be asked: 12 characters are all that an A holds while it moves. Characters that come back
    inverted are no uploads."""
    wire = ChipWire("A")
    chip = chip_driver(wire)
    chip.configure(**KNOWN)  # type: ignore[arg-type]
    chip.download("\n".join(["l2", f"f{64 * steps}", "r", *commands.split(), "e"]))
    assert chip._driver._unit.shared.uploads == b""
    assert chip.wait().ok
    assert wire.true() == 2 * 64 * steps
    assert "wrong-data" not in wire.codes()


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


def test_a_file_that_cannot_be_given_up_either_is_told() -> None:
    """The cable comes off while it is typed: then it cannot be reset."""
    wire = ChipWire("B")
    chip = chip_driver(wire)

    def sever(data: bytes) -> None:
        wire.severed |= b"f640" in data

    wire.before_each = sever
    with pytest.raises(FileGivenUp, match=r"could not be typed \(.*f640.*\), and the chip not be reset \(.*\): it still waits"):
        chip.download("[\nt80\nf640\nr\n]")


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


@pytest.mark.parametrize("seconds", [1, 20, 50])
def test_short_waits_see_that_wrong_data_have_ended_a_program(seconds: int) -> None:
    """The queries go with it (M-11). They are repeated, but rarely: they lie in the input buffer as long as it runs, and would
    find no room there."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    begin = wire.now
    chip.download(f"[\nF640\nR\nW{1000 * seconds}\n?102\nQ\nR\n]")  # Q3: B10 and B11 are high
    while not (end := chip.wait(0.1, check=False)).ok:
        assert end.reason is ChipReason.OVERDUE
        assert wire.now - begin < 2.2 * max(seconds, 2) * SECOND
    assert wire.now - begin > seconds * SECOND
    assert wire.codes().count("wrong-data") == 1
    assert chip.counter() == 640
    assert not chip.is_busy()


def test_short_waits_see_that_a_block_was_cut_short() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    with pytest.raises(ChipMoveFailed, match="not done yet"):
        chip.run_block(["f640", "r", "w20000", "e"], 0.1)
    ends = [chip.wait(0.1, check=False).reason]
    while ends[-1] is ChipReason.OVERDUE:
        ends.append(chip.wait(0.1, check=False).reason)
        assert len(ends) < 100
    assert ends[-1] is ChipReason.CUT
    assert chip.counter() == 640


PROGRAM = "[\n@1\nf640\nr ; to and fro\nw500\nd\nr\nw500\nj1\n]\n"


def test_a_file_of_another_kind_is_refused_in_a_few_words() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.sent.clear()
    with pytest.raises(Misuse, match=r"^notes.txt is not sent:") as refused:
        chip.download("~\n" * 1000, name="notes.txt")
    assert str(refused.value).count("error M") == 10
    assert str(refused.value).endswith("\nand 990 more errors")
    with pytest.raises(Misuse) as refused:
        chip.download("~\n" * 10)
    assert str(refused.value).count("error M") == 10
    assert "more errors" not in str(refused.value)
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
    begin = wire.now
    with pytest.raises(LineFailure, match="the chip uploaded 0 of 1 bytes within 10 s"):
        chip.uploaded()
    assert wire.now - begin == pytest.approx(10 * SECOND, abs=SECOND // 2)
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


def test_a_block_is_not_typed_into_a_chip_that_moves() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    with pytest.raises(Busy, match="the chip is not done with a run without end: wait for its end or stop it"):
        chip.run_block(["f64"])
    assert "[" not in typed(wire)


def test_how_far_a_download_is_is_told_after_each_command() -> None:
    """Plain commands, then a file, and what stands behind it."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    told: list[tuple[int, int]] = []
    chip.download("T6\nC6\n[\nF64\nR\n]\n", progress=lambda done, total: told.append((done, total)))
    assert told == [(n, 6) for n in (1, 2, 3, 4, 5, 6, 6)]
