"""Characters on their way in: what is ignored, the input buffer and its reports, selection, compression (chapter II)."""

from __future__ import annotations

from typing import Any

import pytest
from m1486_rig import Bench

SIZES = {"A": 12, "B": 32, "C": 12, "E1": 32, "E2": 32}


def inverted(text: str) -> bytes:
    return bytes(~byte & 0xFF for byte in text.encode())


def stalled(kind: str = "A", **options: Any) -> Bench:
    """A chip whose motor runs: nothing is compressed."""
    bench = Bench(kind, **options)
    bench.do("f640000")
    bench.send("r")
    while not bench.chip.drive.is_busy:
        bench.run(ms=1)
    bench.run(ms=50)
    return bench


# ---------------------------------------------------------------------- what is ignored


def test_m_1_comments_and_line_feeds_take_no_memory_and_no_room() -> None:
    bench = stalled()
    bench.raw(b"; a comment longer than the input buffer\r\n;\r\n\n")
    assert (bench.chip.receiver.waiting, bench.sent()) == (0, b"")
    bench.raw(b"u20 ; type letter\r\n")
    assert bench.chip.receiver.waiting == len("u20\r")
    assert bench.finish() == b"\x41"


def test_m_2_blanks_inside_a_command_are_ignored() -> None:
    bench = Bench()
    bench.do(" : 1 2\t3 ", " f")
    assert bench.variable == 123
    assert bench.wrong


def test_either_case_and_empty_lines() -> None:
    bench = Bench()
    assert bench.do("U20", "u20", "", "\r\r") == b"\x42\x42"
    assert bench.wrong == []


# ---------------------------------------------------------------------- the buffer and its reports


@pytest.mark.parametrize("kind", SIZES)
def test_characters_in_the_last_three_bytes_come_back_inverted_and_the_next_is_refused(kind: str) -> None:
    bench = stalled(kind)
    filling = "1234567890" * 4
    size = SIZES[kind]
    if kind.startswith("E"):
        bench.chip.receiver.busy_until = None
    assert bench.raw(b":") == b""
    assert bench.raw(filling[: size - 4].encode()) == b""
    for char in filling[size - 4 : size - 2]:
        assert bench.raw(char.encode()) == inverted(char)
    assert bench.raw(b"\r") == inverted("\r")
    assert bench.chip.receiver.free == 0
    assert bench.raw(b"f") == b"\x5e"
    assert bench.chip.receiver.waiting == size


@pytest.mark.parametrize(("kind", "answer"), [("A", b"\xf2"), ("C", b"\xf2"), ("B", b""), ("E1", b"")])
def test_m_43_the_tenth_character_of_a_line_is_answered_where_the_buffer_holds_twelve(kind: str, answer: bytes) -> None:
    bench = Bench(kind)
    assert bench.raw(b"w16000000") == b""
    assert bench.raw(b"\r") == answer


def test_a_refused_character_is_not_received() -> None:
    bench = stalled("A")
    bench.raw(b"u20\ru20\rw1\r")
    assert bench.raw(b"u20\r") == inverted("u") + b"\x5e\x5e\x5e"
    assert bench.finish() == b"\x41\x41"
    assert bench.raw(b"15\r") == b"\x02"


def test_a_line_longer_than_the_buffer_does_not_block_it() -> None:
    bench = stalled("A")
    answers = bench.raw(b"w" * 14 + b"\r")
    assert answers[-1:] == b"\x5e"
    assert any("longer than the input buffer" in text for text in bench.wrong)
    bench.raw(b"u20\r")
    assert bench.finish() == b"\x41"


def test_compression_stands_still_while_the_motor_runs_but_not_during_a_wait() -> None:
    bench = stalled("B")
    bench.send("u20")
    assert bench.chip.receiver.waiting == 4
    assert bench.finish() == b"\x42"
    bench.send("w1000", "u20")
    assert bench.chip.receiver.waiting == 0
    assert bench.run(0.9) == b""
    assert bench.run(0.2) == b"\x42"


def test_compression_stands_still_during_a_seek() -> None:
    bench = Bench("B")
    bench.pin(B7=0)
    bench.send(")7")
    bench.run(ms=5)
    bench.send("u20")
    assert bench.chip.receiver.waiting == 4
    bench.pin(B7=1)
    assert bench.finish() == b"\x42"


def test_compression_goes_on_inside_brackets() -> None:
    bench = Bench("A")
    bench.send("v100", "f6400", "[", "r")
    bench.run(ms=5)
    assert not bench.chip.drive.is_busy
    bench.send("]")
    bench.run(ms=5)
    assert bench.chip.drive.is_busy
    # A second file: its bracket has to wait for the motor, what follows it not.
    bench.finish()
    bench.send("r")
    bench.raw(b"[")
    assert bench.chip.receiver.waiting == 1
    bench.finish()
    bench.raw(b"\r")
    assert bench.file(*["u20"] * 20) + bench.finish() == b"\x41" * 20


def test_a_second_file_waits_in_the_buffer_while_the_first_moves_the_motor() -> None:
    # Chapter II, Memory: the commands of the next block are limited by the input buffer then.
    bench = Bench("A")
    bench.do("v100", "f64000")
    bench.file("r")
    assert bench.raw(b"[\ru20\ru2") == b""
    assert bench.raw(b"0\r]\r") == inverted("\r]\r")
    assert bench.raw(b"u") == b"\x5e"
    assert bench.finish() == b"\x41\x41"


def test_a_second_file_waits_where_it_would_overwrite_the_first() -> None:
    """M-12: the memory of an A is a ring of 108 bytes; a file of 84 is not done yet when one of 60 comes."""
    bench = Bench("A")
    bench.file("w1000", *["u20"] * 40)
    answers = b""
    for line in ("[", *["u15"] * 30, "]"):
        answers += bench.send(line)
        while bench.chip.receiver.is_stalled:
            answers += bench.run(ms=1)
    assert answers + bench.finish() == b"\x41" * 40 + b"\x02" * 30


def test_a_second_file_is_stored_while_the_first_waits() -> None:
    bench = Bench("A")
    bench.file("w1000", "u15")
    bench.file(*["u20"] * 30)
    assert bench.chip.receiver.waiting == 0
    assert bench.finish() == b"\x02" + b"\x41" * 30


# ---------------------------------------------------------------------- functions 41 and 57


def test_function_41_sends_every_character_back() -> None:
    bench = Bench()
    assert bench.send("t41") == b""
    bench.finish()
    assert bench.raw(b"u20 ;x\r\nk\rxg\r") == b"u20 ;x\r\x42\nk\rxg\r"
    bench.send("c41")
    bench.finish()
    assert bench.raw(b"u20\r") == b"\x42"


def test_function_41_sends_empty_lines_and_the_end_of_lines_that_are_not_read_back() -> None:
    bench = Bench("A")
    bench.do("t41")
    assert bench.raw(b"\r;c\r") == b"\r;c\r"
    bench.do("f640000")
    bench.send("r")
    bench.run(ms=50)
    answers = bench.raw(b"w" * 14)
    assert answers[-1:] == b"\x5e"
    assert bench.raw(b"\r") == b"\r"


def test_function_57_reports_three_free_bytes_and_an_empty_buffer() -> None:
    bench = Bench("A")
    assert bench.do("t57") == b""
    bench.do("v100", "f64000")
    assert bench.send("r") == b"\x7f"
    bench.run(ms=10)
    assert bench.raw(b"u20\ru20\r") == b""
    assert bench.raw(b"u4\r") == inverted("4\r")
    # Three are free when the first line has left, all when the last has.
    assert bench.finish() == b"\x7e\x7f\x41\x41\x00"


def test_function_57_calls_a_buffer_empty_when_no_character_is_in_it() -> None:
    bench = Bench("B")
    bench.do("t57", "v100", "f64000")
    bench.send("r")
    bench.run(ms=10)
    bench.raw(b"u20\ru1")
    assert bench.finish() == b"\x42"
    assert bench.raw(b"5\r") == b"\x7f\x02"


def test_function_57_tells_three_bytes_only_where_fewer_were_free() -> None:
    bench = Bench("A")
    bench.do("t57", "v100", "f64000")
    bench.send("r")
    bench.run(ms=10)
    bench.raw(b"u20\ru4\r")
    assert bench.finish() == b"\x7f\x41\x00"


# ---------------------------------------------------------------------- what acts when received


@pytest.mark.parametrize("command", ["k", "K", " k ", "k ; stop"])
def test_m_27_kill_needs_no_room(command: str) -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.chip.receiver.free == 0
    assert bench.send(command) == b""
    assert bench.chip.drive.is_stopping


def test_m_27_kill_follows_a_character_that_was_refused() -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.raw(b"u") == b"\x5e"
    bench.send("k")
    assert bench.chip.drive.is_stopping
    # The host sends it again when there is room.
    bench.finish()
    assert bench.send("u20") + bench.finish() == b"\x41"


def test_m_27_kill_acts_at_the_end_of_its_line_and_takes_no_room() -> None:
    bench = stalled("A")
    bench.raw(b"k")
    assert not bench.chip.drive.is_stopping
    assert bench.chip.receiver.waiting == 0
    bench.raw(b"\r")
    assert bench.chip.drive.is_stopping


def test_m_27_clear_kill_needs_no_room() -> None:
    bench = Bench("A")
    bench.do("c51", "v100", "f64000")
    bench.send("r")
    bench.run(ms=10)
    bench.send("k")
    bench.run(3.0)
    assert not bench.chip.drive.is_busy
    bench.send(*["w1"] * 27)
    while bench.chip.receiver.free:
        bench.raw(b"w1\r"[: bench.chip.receiver.free])
    bench.sent()
    assert bench.chip.program.is_held
    assert bench.send("C75") == b""
    assert not bench.chip.program.is_held


def test_m_27_a_command_that_begins_like_clear_kill_is_refused_as_a_whole() -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.raw(b"c7") == b""
    assert bench.raw(b"6") == b"\x5e\x5e\x5e"
    assert bench.raw(b"\r") == b"\x5e"
    bench.finish()
    assert bench.wrong == []


@pytest.mark.parametrize("line", [b"u5", b"c1", b"c", b"c7", b"c7x", b"c751", b"u5 ; so"])
def test_m_38_every_character_of_a_line_that_finds_no_room_is_answered_the_cr_too(line: bytes) -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    lost = len(line.split(b" ")[0]) + 1
    assert b"".join(bench.raw(bytes((byte,))) for byte in line + b"\r") == b"\x5e" * lost
    # The same again: nothing of the first one is left.
    assert bench.raw(line + b"\r") == b"\x5e" * lost


@pytest.mark.parametrize("line", [b"", b"; so", b"c75", b"k", b"xf"])
def test_m_38_a_line_that_needs_no_room_is_not_answered(line: bytes) -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.raw(line + b"\r") == b""


def test_m_38_a_cr_that_finds_room_again_is_no_lost_one() -> None:
    bench = stalled("A")
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.raw(b"u5") == b"\x5e\x5e"
    bench.finish()
    assert bench.raw(b"\ru20\r") == b"\x41"


def test_m_27_clear_kill_leaves_the_buffer_again() -> None:
    bench = stalled("B")
    bench.raw(b"w1\r")
    bench.raw(b"c75\r")
    assert bench.chip.receiver.waiting == 3
    assert bench.events("clear-kill")


def test_clear_kill_with_a_zero_before_it_acts_when_it_leaves_the_buffer() -> None:
    """It is the same number, but M-27 is about three characters."""
    bench = Bench("A")
    bench.do("c51")
    bench.file("w5", "u20")
    bench.send("k")
    assert bench.run(1.0) == b""
    assert bench.send("c075") == b"\x41"
    assert (bench.wrong, len(bench.events("clear-kill"))) == ([], 1)


def test_kill_is_an_event() -> None:
    """Whoever watches or records a chip sees K, whether or not there was a motion to stop."""
    bench = Bench()
    bench.send("k")
    bench.run(ms=5)
    bench.send("g+", "r")
    bench.run(ms=50)
    bench.send("K")
    assert [event.text for event in bench.chip.events if event.code in ("kill", "stops")] == ["Kill", "Kill", "stops: Kill"]


def test_m_27_index_needs_no_room() -> None:
    bench = stalled("A", address=3)
    bench.raw(b"w10\rw10\rw10\r")
    assert bench.send("x4") == b""
    assert not bench.chip.receiver.is_listening
    assert bench.raw(b"f") == b""


def test_kill_takes_no_number() -> None:
    bench = Bench()
    bench.send("k5")
    assert bench.wrong == ["wrong data: K5: K takes no number; the program stops"]


# ---------------------------------------------------------------------- selection


def test_after_power_up_a_chip_listens_and_index_chooses() -> None:
    bench = Bench(address=3)
    assert bench.do("u20") == b"\x42"
    assert bench.do("x4", "u20") == b""
    assert bench.do("X3", "u20") == b"\x42"
    assert bench.do("xf", "u20") == b""
    assert bench.do("xg", "u20") == b"\x42"


@pytest.mark.parametrize("wrong", ["x", "xh", "x12", "xgg"])
def test_an_address_that_is_none_is_wrong_data_and_selects_nothing(wrong: str) -> None:
    bench = Bench(address=3)
    bench.send(wrong)
    assert bench.chip.receiver.is_listening
    assert len(bench.wrong) == 1
    bench.send("x4", wrong)
    assert not bench.chip.receiver.is_listening
    assert len(bench.wrong) == 1


def test_e_types_have_no_address_0() -> None:
    bench = Bench("E1", address=3)
    bench.send("x0")
    assert bench.chip.receiver.is_listening
    assert "1 to F" in bench.wrong[0]


def test_a_chip_that_does_not_listen_does_nothing_but_wait_for_its_address() -> None:
    bench = Bench(address=3)
    bench.do("t41")
    bench.send("x4")
    bench.sent()
    assert bench.send("k", "c75", "[", "u20", "k7") == b""
    assert (bench.wrong, bench.events("kill")) == ([], [])
    assert bench.chip.receiver.waiting == 0


# ---------------------------------------------------------------------- EEPROM types


def test_e_types_take_half_a_second_for_each_command_they_write() -> None:
    bench = Bench("E1")
    assert bench.send("u20", "u20") == b""
    assert bench.chip.receiver.waiting == 4
    assert bench.run(0.499) == b""
    assert bench.run(0.001) == b"\x45"
    assert bench.run(0.499) == b""
    assert bench.run(0.001) == b"\x45"


def test_e_types_refuse_what_comes_too_fast() -> None:
    bench = Bench("E1")
    answers = bench.send(*["u20"] * 9)
    assert answers == inverted("20\r")
    assert bench.raw(b"u") == b"\x5e"


def test_resetting_an_e_type_takes_its_time_and_loses_what_arrives_meanwhile() -> None:
    for kind, seconds in (("E1", 1), ("E2", 2)):
        bench = Bench(kind)
        bench.send("\\")
        assert bench.send("t41", "u20") == b""
        bench.run(seconds - 0.001)
        bench.send("u20")
        bench.run(0.001)
        bench.send("u4")
        assert bench.finish() == b"\x00"


# ---------------------------------------------------------------------- wrong data


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("%", "no command begins with"),
        ("v15", "16 to 20 000"),
        ("f0", "1 to 16 000 000"),
        ("rr", "second command"),
        ("@81", "1 to 80"),
    ],
)
def test_m_11_wrong_data_are_dropped_and_named(line: str, reason: str) -> None:
    bench = Bench("B")
    bench.send(line)
    assert len(bench.wrong) == 1
    assert reason in bench.wrong[0]
    assert bench.chip.memory.write == 0


def test_m_11_wrong_data_stop_the_program_unless_function_44_is_on() -> None:
    for continues in (False, True):
        bench = Bench("B")
        bench.do("t44" if continues else "c44")
        bench.send("w100", "u20")
        bench.run(ms=5)
        bench.send("f0")
        assert bench.finish() == (b"\x42" if continues else b"")
        # What comes afterwards is done.
        assert bench.do("u15") == b"\x02"


def test_m_11_a_file_with_wrong_data_does_not_run_unless_function_44_is_on() -> None:
    for continues in (False, True):
        bench = Bench("B")
        bench.do("t44" if continues else "c44")
        assert bench.file("u20", "f0", "u15") + bench.finish() == (b"\x42\x02" if continues else b"")
        assert bench.file("u4") == b"\x00"


def test_m_12_a_file_larger_than_the_memory_is_dropped() -> None:
    bench = Bench("A")
    assert bench.file(*["w1"] * 27) == b""
    bench.finish()
    bench = Bench("A")
    assert bench.send("[", *["w1"] * 27, "u20") == b"\x5e"
    (refused,) = bench.events("file-refused")
    assert refused.text == f"the file is larger than the command memory of {bench.chip.variant.memory_bits} bits"
    assert bench.send("u20", "]") == b""
    assert bench.finish() == b""
    assert bench.do("u20") == b"\x41"


def test_brackets_inside_brackets_and_alone_do_nothing() -> None:
    bench = Bench("B")
    assert bench.do("]", "[", "u20", "[", "u15", "]", "]") == b"\x42\x02"
    assert bench.wrong == []


def test_a_reset_inside_brackets_deletes_the_bracket() -> None:
    bench = Bench("B")
    assert bench.send("[", "u15", "\\", "u20") == b"\x42"
    assert bench.finish() == b""
