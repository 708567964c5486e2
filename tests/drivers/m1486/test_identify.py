"""Looking for chips: who is found, and what it does to those who are there."""

from __future__ import annotations

from typing import Any

import pytest
from chip_rig import BAUD, ChipWire
from host_rig import MemoryEndpoint, Wire

from steptwin.controller import SECOND
from steptwin.drivers import LineLost
from steptwin.drivers.blocking import finish
from steptwin.drivers.m1486.identify import (
    CHIP_BAUDS,
    FoundChip,
    SearchRequest,
    answer_in,
    scan_chips,
    searching,
    select_all,
    type_of,
)
from steptwin.drivers.threads import ThreadLine
from steptwin.m1486.functions import REPORT, RETURN
from steptwin.m1486.variants import VARIANTS
from steptwin.wire import pdu, rtu


def search_line(wire: Any) -> ThreadLine[SearchRequest, bytes]:
    endpoint: Any = MemoryEndpoint(wire)
    return ThreadLine(endpoint, searching(endpoint, BAUD), clock=wire.clock, sleeping=wire.sleep)


@pytest.mark.parametrize(
    ("kind", "addresses"), [("A", (0, 7, 15)), ("B", tuple(range(16))), ("C", (3,)), ("E1", (1, 14)), ("E2", tuple(range(1, 16)))]
)
def test_all_chips_are_found_and_only_asked(kind: str, addresses: tuple[int, ...]) -> None:
    """X0 would be wrong data to an E type that listens."""
    wire = ChipWire(kind, addresses)
    before = {address: (chip.unit.flags, chip.pins(), chip.unit.variable) for address, chip in wire.chips.items()}
    asked: list[int] = []
    assert finish(scan_chips(search_line(wire), progress=asked.append)) == [FoundChip(a, kind) for a in addresses]
    assert sorted(asked) == list(range(16))
    assert set(wire.codes()) == {"upload"}
    assert {a: (c.unit.flags, c.pins(), c.unit.variable) for a, c in wire.chips.items()} == before
    assert all(wire.true(address) == 0 and chip.receiver.is_listening for address, chip in wire.chips.items())


def test_chips_that_echo_and_report_are_found_too() -> None:
    wire = ChipWire("A", (2, 9))
    wire.send(f"t{RETURN}\rt{REPORT}\r".encode())
    wire.sleep(1.0)
    assert finish(scan_chips(search_line(wire))) == [FoundChip(2, "A"), FoundChip(9, "A")]


def test_x0_is_said_while_an_address_is_selected_that_no_e_type_has() -> None:
    """Fourteen chips of an E type leave one address, the lowest, for it: X0 is wrong data to those that listen."""
    wire = ChipWire("E1", tuple(range(2, 16)))
    asked: list[int] = []
    assert finish(scan_chips(search_line(wire), progress=asked.append)) == [FoundChip(a, "E1") for a in range(2, 16)]
    assert asked == [*range(1, 16), 0]
    assert b"x1\rx0\ru20\r" in b"".join(data for _, data in wire.sent)
    assert set(wire.codes()) == {"upload"}


def test_nobody_is_not_waited_for_long() -> None:
    wire = ChipWire("B")
    wire.severed = True
    begin = wire.now
    assert finish(scan_chips(search_line(wire))) == []
    assert wire.now - begin < SECOND


def test_a_chip_is_not_waited_for_once_it_has_answered() -> None:
    wire = ChipWire("B", tuple(range(16)))
    begin = wire.now
    assert len(finish(scan_chips(search_line(wire)))) == 16
    assert wire.now - begin < SECOND


def test_a_chip_whose_buffer_is_full_is_busy() -> None:
    wire = ChipWire("A", (5,))
    wire.send(b"f640000\rr\rf6400\rr\rr\r")
    wire.sleep(0.2)
    assert finish(scan_chips(search_line(wire))) == [FoundChip(5, None)]
    wire.sleep(60.0)
    assert wire.codes().count("moves") == 3
    assert "wrong-data" not in wire.codes()


FRAMES = b"".join(rtu.encode_frame(unit, pdu.encode_request(pdu.ReadRequest(2, 5000, 8))) for unit in range(1, 248))


def test_a_program_survives_the_search_and_the_modbus_frames_after_it() -> None:
    """A chip that runs a program cannot answer. It is deaf to the noise, among which there are CRs."""
    wire = ChipWire("B", (15,))
    wire.send(b"[\r@1\rf640\rr\rw100\rd\rr\rj1\r]\r")
    wire.sleep(2.0)
    line = search_line(wire)
    assert finish(scan_chips(line)) == []
    assert b"\r" in FRAMES
    wire.send(FRAMES)
    wire.sleep(5.0)
    finish(select_all(line))
    count = wire.codes().count("moves")
    wire.sleep(5.0)
    assert wire.codes().count("moves") > count + 5
    assert "wrong-data" not in wire.codes()
    wire.send(b"k\r")
    assert wire.chip.receiver.is_listening


def test_a_mic488_takes_none_of_it_for_a_frame() -> None:
    wire = Wire()
    line = search_line(wire)
    assert finish(scan_chips(line)) == []
    finish(select_all(line))
    said = b"".join(data for _, data in wire.sent)
    assert not {1, 2, 3, 5, 6, 16}.intersection(said)
    assert wire._passed["to master"] == 0


def test_noise_is_nobody() -> None:
    wire = ChipWire("B")
    wire.severed = True
    wire.before_each = lambda data: wire.inject(b"login: ")
    assert finish(scan_chips(search_line(wire))) == []


def test_a_line_that_is_lost_is_told() -> None:
    wire = ChipWire("B")
    wire.gone = "unplugged"
    with pytest.raises(LineLost, match="unplugged"):
        finish(scan_chips(search_line(wire)))


def test_the_type_by_letter_and_rate() -> None:
    assert [type_of(0x45, baud) for baud in CHIP_BAUDS] == ["E1", "E12x", "E1", "E1", "E12x", "E1"]
    assert type_of(0x42, None) == "B"


@pytest.mark.parametrize(
    ("said", "heard", "answer"),
    [
        ("xg\ru20\r", b"B", b"B"),
        ("xg\ru20\r", b"xg\ru20\rB", b"B"),
        ("xg\ru20\r", b"\ru20\r\x7fB\x7f", b"B"),
        ("xg\ru20\r", b"", b""),
        ("xg\ru20\r", b"xg\ru20\r", b""),
        ("xg\ru20\r", b"^^^^", b"^^^^"),
    ],
)
def test_the_answer_in_what_was_heard(said: str, heard: bytes, answer: bytes) -> None:
    assert answer_in(said, heard) == answer


def test_all_rates_that_pins_choose_are_tried_the_usual_ones_first() -> None:
    assert CHIP_BAUDS[:2] == (4800, 9600)
    assert sorted(CHIP_BAUDS) == sorted({one.baud(br1, br0) for one in VARIANTS for br1 in (0, 1) for br0 in (0, 1)})


def test_a_chip_whose_buffer_is_nearly_full_is_busy() -> None:
    """What took the last places of it comes back inverted, and nothing else does."""
    wire = ChipWire("B")
    wire.severed = True

    def answer(data: bytes) -> None:
        if b"g" in data:
            wire.inject(b"^")
        for number, ends in ((b"x5", b"0\r"), (b"x9", b"7\r")):
            if number in data:
                wire.inject(bytes(~byte & 0xFF for byte in ends))

    wire.before_each = answer
    assert finish(scan_chips(search_line(wire))) == [FoundChip(5, None)]
