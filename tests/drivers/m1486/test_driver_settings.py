"""What a driver finds out about a chip in virtual time, and how it switches what a chip has."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from chip_rig import ChipWire, Fault, chip_driver, chip_line

from steptwin.controller import SECOND
from steptwin.drivers import Unconfirmed
from steptwin.drivers.exchange import Job
from steptwin.drivers.m1486 import M1486, AsyncM1486, Busy, Garbled, NoEcho, WrongType
from steptwin.drivers.m1486.lines import TALK
from steptwin.drivers.m1486.talk import INVALID_COMMAND, ChipRequest
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.lines import DUAL_DAC
from steptwin.m1486.variants import variant


@pytest.mark.parametrize(
    ("kind", "title"), [("A", "M1486A"), ("B", "M1486B"), ("C", "M1486C"), ("E1", "M1486E1"), ("E2", "M1486E2")]
)
def test_the_type_is_found(kind: str, title: str) -> None:
    chip = chip_driver(ChipWire(kind, interface=DUAL_DAC))
    assert (chip.variant.title, chip.status().type, chip.interface(), chip.byte(16)) == (title, title, DUAL_DAC, 1)


@pytest.mark.parametrize("kind", ["B", "E1", "E2"])
def test_a_chip_that_echoes_already_is_known_again_by_the_next_program(kind: str) -> None:
    """It does at once what every connection types before its questions; an E type takes half a second for each."""
    wire = ChipWire(kind, (1,))
    for _ in range(3):
        chip = M1486(chip_line(wire), 1)
        chip.open()
        assert (chip.variant.name, chip.byte(16)) == (kind, 1)


def test_another_type_than_expected_is_refused() -> None:
    with pytest.raises(WrongType, match="the chip reports that it is an M1486B, not M1486A"):
        chip_driver(ChipWire("B"), variant="A")
    assert chip_driver(ChipWire("B2x"), variant="B2x").variant.clock == 2


@pytest.mark.parametrize("named", ["B", None])
def test_a_chip_that_could_not_be_opened_is_what_it_was_before(named: str | None) -> None:
    """On a line that stays open: a type that was named wrongly is forgotten, one that was found stays."""
    wire = ChipWire("B", (7,))
    line = chip_line(wire)
    with pytest.raises(WrongType):
        M1486(line, 7, variant="A").open()
    chip = M1486(line, 7)
    chip.open()
    chip.run(1)
    with pytest.raises(Busy):
        M1486(line, 7).open()
    assert chip.variant.name == "B"
    wire.chip.variant = variant("C")  # another chip in its place
    chip.stop()
    wire.sleep(2.0)
    with pytest.raises(WrongType):
        M1486(line, 7, variant=named).open()
    M1486(line, 7).open()
    assert chip.variant.name == "C"


def test_reading() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire, steps_per_unit=40.0, unit="mm", origin_u=64_000)
    wire.chip.drive.set_counter(0x123456, wire.now)
    wire.chip.unit.variable = 0xABCDEF
    wire.chip.unit.flags[3] = True
    assert chip.counter() == 0x123456
    assert chip.position() == (0x123456 - 64_000) / 64 / 40
    assert chip.variable() == 0xABCDEF
    assert [flag for flag, on in chip.flags().items() if on] == [83]
    assert [number for number, on in chip.functions().items() if on] == [41, *range(48, 56)]
    wire.chip.set_pin("B2", 0, wire.now)
    assert chip.inputs(1, 4) == (True, False, True, True)


def test_switches() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_output(6, False)
    chip.set_flag(85, True)
    chip.set_limit(False)
    assert wire.chip.pins()["B6"] == 0
    assert chip.flags()[85]
    assert chip.functions()[42]
    chip.set_variable(77)
    assert chip.variable() == 77
    chip.command("T6")
    assert wire.chip.pins()["B6"] == 1


WAKING = {
    # Chip, address asked for: what is typed until it is known whether it echoes, with "|" for CR.
    "alone": ("B", 15, None, f"xg|xg|xg|xg|xg|t41|xg|{''.join(f'x{n:x}|' for n in range(1, 16))}xg|x1|"),
    "addressed": ("B", 7, 7, "xg|xg|x7|x7|xg|xg|t41|x7|x7|x7|"),
    "an E type, which is given its time": ("E1", 7, 7, "xg|xg|x7|x7|xg|xg|t41|x7|x7|xg|xg|t41|x7|x7|x7|"),
    "another chip echoes, this one is not there": ("B", 7, 5, "xg|xg|x5|x5|xg|xg|t41|x5|x5|xg|xg|t41|x5|x5|xg|xg|"),
    "nobody is there": ("B", None, 7, "xg|xg|x7|x7|xg|xg|t41|x7|x7|xg|xg|t41|x7|x7|xg|xg|"),
    "nobody is there, without address": ("B", None, None, "xg|xg|xg|xg|xg|t41|xg|xg|xg|t41|xg|xg|xg|"),
}  # fmt: skip


@pytest.mark.parametrize("case", WAKING)
def test_what_is_typed_to_wake_a_chip(case: str) -> None:
    """Lines that get no echo are given their CR later, so that nothing stands in front of what comes next."""
    kind, there, asked, expected = WAKING[case]
    wire = ChipWire(kind, (15 if there is None else there,))
    wire.severed = there is None
    chip = M1486(chip_line(wire), asked)
    if there is not None and asked in (None, there):
        chip.open()
    else:
        with pytest.raises(NoEcho):
            chip.open()
    assert b"".join(data for _, data in wire.sent).decode().replace("\r", "|").partition("u20")[0] == expected


def test_after_an_ordinary_session_no_letter_is_expected_and_a_stray_one_counts() -> None:
    """It may be the echo of something that stands in front of the next command now: that is spoilt first."""
    wire = ChipWire("B", (7,))
    chip = chip_driver(wire, 7)
    chip.configure(microstep=1)
    chip.move_by(10.0)
    assert chip.wait().ok
    chip.status()
    talk = chip._driver.line.shared[TALK]
    assert (talk.surplus, talk.owed, talk.dirty) == (0, {}, False)
    wire.inject(b"B")
    wire.sleep(0.1)
    wire.sent.clear()
    assert chip.counter() == 640
    assert wire.sent[0][1] == INVALID_COMMAND


def test_of_the_functions_those_are_found_that_a_stop_depends_on() -> None:
    """One from each of the three bytes that tell of them; reports (57) are switched off, for they look like answers."""
    wire = ChipWire("E1")
    first = chip_driver(wire)
    for number in (42, 51, 60):
        first.set_function(number, not first.functions()[number])
    expected = first.functions()
    chip = chip_driver(wire)
    shared = chip._driver._unit.shared
    assert [number for number, on in expected.items() if on] == [41, 42, *(48, 49, 50), *range(52, 56), 60]
    known = {number: on for number, on in expected.items() if number < 48}
    assert {number: shared.function(number) for number in expected} == dict.fromkeys(expected) | known
    wire.chain.receive(b"t57\r", wire.now)
    wire.sleep(2.0)
    wire.unread = b""
    reporting = chip_driver(wire)
    assert reporting._driver._unit.shared.function(57) is None
    assert not wire.chip.unit.on(57)
    assert reporting.functions() == expected


def test_the_status_has_each_number_that_was_read_in_its_place() -> None:
    """Counter and variable of 24 bits, flags, functions: no byte is that of its neighbour. A command that may change them makes
    them unknown."""
    wire = ChipWire("B", interface=DUAL_DAC)
    chip = chip_driver(wire, steps_per_unit=2.0, unit="mm", origin_u=128)
    wire.chip.drive.set_counter(0x0A0B0C, wire.now)
    wire.chip.unit.variable = 0x1D2E3F
    wire.chip.unit.flags[0] = wire.chip.unit.flags[6] = True
    nothing = chip.status()
    assert (nothing.position, nothing.variable, nothing.flags, nothing.functions, nothing.series) == (None,) * 5
    chip.counter(), chip.variable(), chip.flags(), chip.functions()
    status = chip.status()
    assert (status.counter_u, status.variable, status.unit, status.is_position_valid) == (0x0A0B0C, 0x1D2E3F, "mm", True)
    assert status.position == (0x0A0B0C - 128) / 128
    assert [number for number, on in (status.flags or {}).items() if on] == [80, 86]
    assert [number for number, on in (status.functions or {}).items() if on] == [41, *range(48, 56)]
    assert (chip.flags(), chip.functions()) == (status.flags, status.functions)
    chip.configure(velocity=500)
    assert chip.known() == status
    chip.set_flag(80, False)
    assert chip.status() == nothing


def test_an_output_whose_number_was_cut_short_by_a_semicolon_is_in_doubt() -> None:
    """The chip hears ``t1;`` for ``t16``: what makes other lines no command is a comment then, and B1 may have been switched."""
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.set_output(1, False)
    wire.put(Fault("to chip", len("u20|") + len("t1"), "semicolon"))
    with pytest.raises(Garbled, match="it is unknown whether the chip has") as caught:
        chip.set_output(16, True)
    assert caught.value.uncertain
    assert wire.faults[0].met


def test_a_number_cut_short_by_a_semicolon_is_typed_again_where_it_only_sets_something() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.put(Fault("to chip", len("u20|") + len(":1"), "semicolon"))
    chip.set_variable(16)
    assert wire.faults[0].met
    assert chip.variable() == 16


def test_settings_are_typed_as_they_are_given_those_that_others_depend_on_first() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.sent.clear()
    chip.configure(waveform=2, velocity=1000, start_stop=200, acceleration=5000, profile=25000, qualification=4, microstep=16)
    typed = b"".join(data for _, data in wire.sent).decode().replace("\r", " ")
    assert typed == "u20 m16 q4 s200 a5000 v1000 p25000 n2 "
    wire.sent.clear()
    chip.configure()
    assert b"".join(data for _, data in wire.sent) == b"u20\r"


def test_the_range_of_positions_has_both_its_ends() -> None:
    line = chip_line(ChipWire("B"))
    chip, shifted = M1486(line), M1486(line, origin_u=16_000_000)
    chip.open()
    chip.set_position(250_000.0)
    assert chip.counter() == 16_000_000
    chip.set_position(0.0)
    assert chip.counter() == 0
    assert (shifted.counter(), shifted.position()) == (0, -250_000.0)


def test_lines_are_read_with_one_question_whether_the_chip_rests() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.chip.set_pin("B3", 1, wire.now)
    wire.chip.set_pin("B4", 0, wire.now)
    wire.sent.clear()
    assert chip.inputs(3, 2) == (True, False)
    assert b"".join(data for _, data in wire.sent).replace(b"\r", b" ") == b"u20 ?32 " + 2 * b"u4 u5 u6 "


def test_a_line_of_its_own_is_closed_when_nobody_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    wire = ChipWire("B")
    line = chip_line(wire)
    monkeypatch.setattr("steptwin.drivers.m1486.sync._ThreadM1486._own_line", lambda *_: line)
    chip = M1486("memory")
    wire.severed = True
    with pytest.raises(NoEcho):
        chip.open()
    with pytest.raises(Misuse, match="the line memory is closed"):
        chip.counter()
    wire.severed = False
    with chip:
        assert chip.counter() == 0
    with pytest.raises(Misuse, match="the line memory is closed"):
        chip.counter()


def test_a_shared_line_stays_open_when_a_driver_of_it_is_closed() -> None:
    wire = ChipWire("B", (0, 7))
    line = chip_line(wire)
    with M1486(line, 0):
        pass
    with M1486(line, 7) as chip:
        assert chip.counter() == 0


def test_the_type_of_a_chip_that_is_not_there_any_more_is_to_be_found_anew() -> None:
    wire = ChipWire("B")
    line = chip_line(wire)
    found, given = M1486(line), M1486(line, variant="B")
    for chip in (found, given):
        chip.open()
        wire.severed = True
        with pytest.raises((NoEcho, LineFailure)):
            chip.open()
        wire.severed = False
        if chip is given:
            assert chip.variant.name == "B"
        else:
            with pytest.raises(Misuse, match="memory: the chip is not open"):
                assert chip.variant


def test_a_function_that_another_program_has_switched_is_known_once_it_was_read() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    wire.chain.receive(b"c51\r", wire.now)
    wire.sleep(1.0)
    wire.unread = b""
    assert chip.functions()[51] is False
    chip.run(1)
    chip.stop()
    wire.sleep(1.0)
    with pytest.raises(Busy, match="is held by Kill because its function 51 is OFF: recover it"):
        chip.counter()


@pytest.mark.parametrize("read", [lambda c: c.inputs(), lambda c: c.flags(), lambda c: c.variable(), lambda c: c.status()])
def test_nothing_is_read_of_a_chip_that_moves(read: Callable[[M1486], object]) -> None:
    chip = chip_driver(ChipWire("B"))
    chip.run(1)
    with pytest.raises(Busy, match="the chip is not done with a run without end"):
        read(chip)


def test_a_line_that_belongs_to_the_interface_is_no_output() -> None:
    chip = chip_driver(ChipWire("B", interface=DUAL_DAC))
    with pytest.raises(Misuse, match=f"B{min(DUAL_DAC.occupied)} belongs to the Dual DAC interface"):
        chip.set_output(min(DUAL_DAC.occupied), True)
    chip.set_output(1, True)


def test_an_output_is_switched_before_anything_is_known_of_the_chip() -> None:
    wire = ChipWire("B")
    M1486(chip_line(wire)).set_output(1, False)
    assert wire.chip.pin("B1") == 0.0


def test_a_driver_opens_the_line_at_its_address_as_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[tuple[object, ...]] = []

    def line(address: str, *, baud: int, log: object) -> object:
        opened.append((address, baud, log))
        return chip_line(ChipWire("B"))

    monkeypatch.setattr("steptwin.drivers.m1486.driver.AsyncM1486Line", line)
    AsyncM1486("tcp://127.0.0.1:5022", 3, baud=19_200, log=print)
    assert opened == [("tcp://127.0.0.1:5022", 19_200, print)]


def test_who_is_what() -> None:
    chip = chip_driver(ChipWire("B", (10,)), 10, unit="mm")
    assert (repr(chip), chip.place, chip.address, chip.unit) == ("<M1486 chip A on memory>", "memory", 10, "mm")


@pytest.mark.parametrize("kind", ["B", "E1"])
def test_an_answer_that_is_lost_is_asked_for_again(kind: str) -> None:
    """Whether it rests, and what it reads; an E type writes the second question into its memory before it answers."""
    for lost in (len("u20|"), len("u20|B") + len("u1|")):
        wire = ChipWire(kind)
        chip = chip_driver(wire)
        chip.set_variable(17)
        wire.sleep(5.0)
        wire.put(Fault("to host", lost, "drop"))
        assert chip.counter() == 0
        assert wire.faults[0].met
        assert chip.variable() == 17


def test_a_stop_that_is_not_echoed_right_is_said_five_times_before_it_is_tried_blind() -> None:
    wire = ChipWire("B")
    chip = chip_driver(wire)
    chip.run(1)
    wire.sleep(0.1)  # then K is enough
    wire.before_each = lambda data: wire.put(Fault("to host", 0, "flip 0"))
    wire.sent.clear()
    with pytest.raises(Unconfirmed):
        chip.stop()
    said = [data for _, data in wire.sent]
    assert said[: said.index(b"k\rk\r")] == [b"k\r", *[b"%\rk\r"] * 4]


def test_a_stop_goes_before_what_waits_for_the_line() -> None:
    wire = ChipWire("B")
    line = chip_line(wire)
    chip = M1486(line)
    chip.open()
    chip.run(1)
    line._engine.submit(Job(ChipRequest(None, "u1", answers=True), SECOND))
    wire.sent.clear()
    chip.stop()
    assert wire.sent[0][1] == b"%\rk\r"


@pytest.mark.parametrize(("timeout_s", "patience_s"), [(0.5, 10.0), (0.8, 10.0), (1.0, 12.0), (2.0, 24.0)])
def test_what_moves_is_begun_within_10_s_or_four_times_the_time_of_its_tries(timeout_s: float, patience_s: float) -> None:
    """A command is typed three times at most."""
    unit = chip_driver(ChipWire("B"), timeout_s=timeout_s)._driver._unit
    assert unit.permission().patience_ns == patience_s * SECOND
