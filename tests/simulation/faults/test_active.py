"""When a fault that is set occurs, and which requests and links it concerns: both sides of each bound."""

from __future__ import annotations

from unittest.mock import patch

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.components.registry import fault_kinds
from steptwin.simulation.faults import ActiveFault, Fault, Faults, read
from steptwin.simulation.faults.active import addresses
from steptwin.simulation.faults.table import Layer

MS = SECOND // 1000


def active(line: str, since: int = 0) -> ActiveFault:
    return ActiveFault(read(line), "it", 1, since)


def struck(fault: ActiveFault, moments: list[int]) -> list[int]:
    return [moment for moment in moments if fault.strikes(moment)]


@pytest.mark.parametrize(
    ("line", "moments"),
    [
        ("busy", range(12)),
        ("busy nth=3", [2]),
        ("busy every=3", [2, 5, 8, 11]),
        ("busy count=2", [0, 1]),
        ("busy every=4 count=2", [3, 7]),
        ("busy from_s=4", range(4, 12)),
        ("busy until_s=4", range(5)),
        ("busy from_s=4 until_s=6", [4, 5, 6]),
        ("busy from_s=4 nth=2", [5]),
        ("busy probability=1", range(12)),
        ("busy probability=0", []),
    ],
)
def test_occasions_each_second(line: str, moments: range | list[int]) -> None:
    """An occasion before the time of a fault, after it, or after its last occurrence is not counted."""
    fault = active(line, 10 * SECOND)
    found = struck(fault, [(10 + n) * SECOND for n in range(12)])
    assert found == [(10 + n) * SECOND for n in moments]
    assert fault.struck == len(found)


def test_both_ends_of_its_time_belong_to_it() -> None:
    fault = active("busy from_s=1 until_s=2", 5)
    assert (fault.begin, fault.end) == (SECOND + 5, 2 * SECOND + 5)
    moments = [SECOND + 4, SECOND + 5, 2 * SECOND + 5, 2 * SECOND + 6]
    assert struck(fault, moments) == moments[1:3]
    assert fault.seen == 2
    assert (active("busy", 5).begin, active("busy", 5).end) == (5, None)


@pytest.mark.parametrize(
    ("line", "moments"),
    [
        ("stall at_s=1", [1.0]),
        ("stall", [0.0]),
        ("stall at_s=1 period_s=0.5 until_s=2", [1.0, 1.5, 2.0]),
        ("stall at_s=1 period_s=0.5 until_s=1.9", [1.0, 1.5]),
        ("stall at_s=1 period_s=0.5 count=2", [1.0, 1.5]),
    ],
)
def test_the_moments_of_a_timed_fault(line: str, moments: list[float]) -> None:
    fault = active(line, 7)
    found = []
    while fault.due is not None:
        assert fault.strikes(fault.due)
        found.append(fault.due)
        fault.step()
    assert found == [7 + round(moment * SECOND) for moment in moments]
    fault.step()
    assert fault.due is None


def test_durations_in_either_unit() -> None:
    assert active("stall for_s=0.25").ns("for_s") == 250 * MS
    assert active("delay for_ms=2.5").ns("for_ms") == 2_500_000


READ = bytes.fromhex("03 00 0a 00 02")
"""Registers 10 and 11."""


@pytest.mark.parametrize(
    ("line", "unit", "pdu", "meant"),
    [
        ("busy", 1, READ, True),
        ("busy unit=1", 1, READ, True),
        ("busy unit=0", 1, READ, False),
        ("busy unit=0", 0, READ, True),
        ("busy function=3", 1, READ, True),
        ("busy function=4", 1, READ, False),
        ("busy function=3", 1, b"", False),
        ("busy address=9", 1, READ, False),
        ("busy address=10", 1, READ, True),
        ("busy address=11", 1, READ, True),
        ("busy address=12", 1, READ, False),
        ("busy address=0-9", 1, READ, False),
        ("busy address=0-10", 1, READ, True),
        ("busy address=11-20", 1, READ, True),
        ("busy address=12-20", 1, READ, False),
        ("busy address=10", 1, bytes.fromhex("06 00 0a 00 05"), True),
        ("busy address=11", 1, bytes.fromhex("06 00 0a 00 05"), False),
        ("busy address=0-65535", 1, b"\x03\x00", False),
        ("busy unit=1 function=3 address=10", 1, READ, True),
        ("busy unit=2 function=3 address=10", 1, READ, False),
    ],
)
def test_which_requests_it_concerns(line: str, unit: int, pdu: bytes, meant: bool) -> None:
    assert active(line).matches(unit, pdu) is meant


@pytest.mark.parametrize(
    ("line", "link", "name", "meant"),
    [
        ("busy", "tcp-1", "bus", True),
        ("busy link=tcp-1", "tcp-1", "bus", True),
        ("busy link=tcp-1", "tcp-2", "bus", False),
        ("busy link=tcp", "tcp-2", "bus", True),
        ("busy link=tcp", "rtu-2", "bus", False),
        ("busy link=pty", "pty", "bus", True),
        ("busy line=bus", "tcp-1", "bus", True),
        ("busy line=bus", "tcp-1", "other", False),
        ("busy link=tcp-1 line=bus", "tcp-1", "other", False),
        ("busy link=tcp-1", "", "bus", True),  # it came on no known link
        ("busy line=bus", "tcp-1", "", False),
    ],
)
def test_which_links_it_is_on(line: str, link: str, name: str, meant: bool) -> None:
    assert active(line).is_on(link, name) is meant


def test_names_of_faults() -> None:
    faults = Faults()
    assert [faults.add(read(line)).name for line in ("busy", "busy", "crc", "busy", "crc name=mine")] == [
        "busy", "busy-2", "crc", "busy-3", "mine"
    ]  # fmt: skip
    faults.remove("busy-2", 0)
    assert [one.name for one in faults.active] == ["busy", "crc", "busy-3", "mine"]
    assert faults.add(read("busy")).name == "busy-2"
    assert faults.called("mine").fault.kind.name == "crc"
    with pytest.raises(Misuse, match="there is a fault 'mine' already"):
        faults.add(read("busy name=mine"))
    with pytest.raises(Misuse, match="no fault 'none': set are busy, crc, busy-3, mine, busy-2"):
        faults.remove("none", 0)
    assert faults.interfere
    faults.clear(0)
    assert (faults.active, faults.interfere) == ((), False)
    with pytest.raises(Misuse, match="no fault 'busy': set are none"):
        faults.called("busy")


def test_faults_that_refuse_a_request() -> None:
    faults = Faults()
    for line in ("busy", "crc", "exception", "no-answer lost=request", "no-answer lost=answer"):
        faults.add(read(line))
    assert [one.name for one in faults.refusing()] == ["busy", "exception", "no-answer"]


def test_without_controllers_and_elements_there_are_none() -> None:
    faults = Faults()
    with pytest.raises(Misuse, match="fault stall: choose a controller: there are none"):
        faults.add(read("stall"))
    with pytest.raises(Misuse, match="fault stall: machine = 'a': there are none"):
        faults.check(read("stall machine=a"))
    with pytest.raises(Misuse, match="fault leak: element = 'a': those that can fail are none"):
        faults.check(Fault(fault_kinds()["leak"], {"element": "a"}))
    assert (faults.active, faults.check(read("busy")), faults.of("a"), faults.of_element("a")) == ((), None, (), ())


@pytest.mark.parametrize(
    ("pdu", "there"),
    [
        ("01 1234 0102", range(0x1234, 0x1234 + 0x102)),
        ("04 00ff 0001", range(255, 256)),
        ("05 1234 ff00", range(0x1234, 0x1235)),
        ("06 0100 ff00", range(256, 257)),
        ("10 0201 0003 06", range(0x201, 0x204)),
        ("07 0201 0003", None),
        ("00 0201 0003", None),
        ("03 0201 00", None),
        ("16 0201 0003", None),
    ],
)
def test_addresses_of_requests(pdu: str, there: range | None) -> None:
    assert addresses(bytes.fromhex(pdu)) == there


def test_an_event_costs_the_same_however_many_faults_others_have() -> None:
    def looks(count: int) -> int:
        world = World.from_toml(
            "".join(
                f'[[mic488]]\nname = "m{number}"\n[[fault]]\nkind = "stuck"\nmachine = "m{number}"\npin = "IN1"\nvalue = 1\n'
                for number in range(count)
            )
        )
        world.run(for_="1 s")
        with patch.object(Fault, "get", autospec=True, side_effect=Fault.get) as get:
            for level in (0, 1, 0):
                world.mic488["m1"].write("OUT1", 1 - level)
                world.run(for_="1 s")
        return get.call_count

    assert looks(40) <= looks(3)


def test_faults_of_each_kind_change_with_what_is_set() -> None:
    faults = Faults()
    assert (faults.refusing(), faults.of_layer(Layer.BYTES), faults.of("m")) == ((), (), ())
    first = faults.add(read("busy"))
    second = faults.add(read("noise"))
    assert (faults.refusing(), faults.of_layer(Layer.BYTES)) == ((first,), (second,))
    faults.remove(first.name, 0)
    assert (faults.refusing(), faults.of_layer(Layer.BYTES)) == ((), (second,))
    faults.active = ()
    assert faults.of_layer(Layer.BYTES) == ()
