"""A snapshot taken at any moment and put into another object changes nothing: for everything in the product that has state."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
from toy import lamp
from whole_world import READ, everything

import steptwin
from steptwin.controller import MILLISECOND, SECOND
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.vision import Com1Port
from steptwin.state import Stateful
from steptwin.wire.crc import with_crc
from steptwin.wire.gateway import ModbusGateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

WRITE = with_crc(bytes.fromhex("01 10 00 64 00 02 04 12 34 56 78"))
BROADCAST = with_crc(bytes.fromhex("00 06 00 05 00 63"))
TCP_READ = bytes.fromhex("00 07 00 00 00 06 01 03 00 64 00 02")
RECORD = b"N3 X12.5 Y-3 A90\r"


class Piece(NamedTuple):
    """Bytes for one of the ports, and how long it is until the next."""

    port: int
    data: bytes
    pause: int


class Ports(Stateful):
    """A controller and ports of every kind."""

    FIXED = ("out",)
    __slots__ = (*FIXED, "device", "ports", "shared")

    def __init__(self) -> None:
        self.device = Mic488Device(ControllerConfig())
        units = TimedUnits({1: self.device}, LineTiming(SerialLine(38400)))
        gateway = ModbusGateway(units)
        strict = TimedUnits({1: self.device}, LineTiming(SerialLine(38400), strict=True))
        self.shared = (units, gateway, strict)
        vision = RtuSlavePort({1: self.device})
        self.ports: tuple[Any, ...] = (
            RtuSlavePort({1: self.device}, on_pause=self._paused),
            TcpSlavePort({1: self.device}),
            TimedRtuSlavePort(units, on_pause=self._paused),
            TcpGatewayPort(gateway),
            TcpGatewayPort(gateway),
            ScriptPort(gateway),
            Com1Port(self.device, vision),
            vision,
            TimedRtuSlavePort(strict),
        )
        self.out: list[tuple[int, object]] = []

    def _paused(self, unit: int, pause: int) -> None:
        self.out.append((unit, pause))

    def receive(self, piece: Piece, now: int) -> int:
        """The moment of the next piece."""
        answer = self.ports[piece.port].exchange(piece.data, now)
        if answer:
            self.out.append((piece.port, (now, answer)))
        self.out += [(piece.port, sent) for sent in self.ports[piece.port].to_send(now)]
        end = now + piece.pause
        while True:
            deadlines = [due for port in self.ports if (due := port.deadline()) is not None and due < end]
            if not deadlines:
                return end
            for number, port in enumerate(self.ports):
                if port.deadline() == min(deadlines):
                    self.out += [(number, sent) for sent in port.to_send(min(deadlines))]


PIECES = [
    Piece(0, READ[:3], 60 * MILLISECOND),
    Piece(0, READ[3:6], 5 * MILLISECOND),
    Piece(0, READ[6:] + b"\xff\x01\x10" + WRITE[:9], 30 * MILLISECOND),
    Piece(0, WRITE[9:] + READ, MILLISECOND),
    Piece(1, TCP_READ[:9], MILLISECOND),
    Piece(1, TCP_READ[9:] + TCP_READ, MILLISECOND),
    Piece(2, READ + WRITE[:4], MILLISECOND),
    Piece(2, WRITE[4:], 2 * MILLISECOND),
    Piece(3, TCP_READ * 3 + TCP_READ[:5], MILLISECOND),
    Piece(4, TCP_READ, MILLISECOND),
    Piece(3, TCP_READ[5:], 3 * MILLISECOND),
    Piece(5, READ + BROADCAST + READ[:5], 10 * MILLISECOND),
    Piece(5, READ[5:], 20 * MILLISECOND),
    Piece(2, READ, 50 * MILLISECOND),
    Piece(6, RECORD[:7], MILLISECOND),
    Piece(6, RECORD[7:] + READ[:4], MILLISECOND),
    Piece(6, READ[4:], SECOND),
    Piece(0, b"\x02\x03" * 300, MILLISECOND),
    Piece(0, READ, SECOND),
    Piece(8, READ[:3], 500_000),
    Piece(8, READ[3:], 20 * MILLISECOND),
]


@pytest.mark.parametrize("cut", range(len(PIECES) + 1))
def test_ports_go_on_from_a_snapshot_between_any_two_pieces(cut: int) -> None:
    one, other = Ports(), Ports()
    now = 0
    for piece in PIECES[:cut]:
        now = one.receive(piece, now)
    state = one.copy_state()
    other.set_state(state)
    assert other.copy_state() == state
    one.out.clear()
    moments = [now, now]
    for piece in PIECES[cut:]:
        moments = [ports.receive(piece, moment) for ports, moment in zip((one, other), moments, strict=True)]
    assert one.out == other.out
    assert one.copy_state() == other.copy_state()
    one.set_state(state)  # what happened since has not touched it
    assert one.copy_state() == state


def test_what_comes_back_of_these_pieces() -> None:
    """So that the test above compares something."""
    ports, now = Ports(), 0
    for piece in PIECES:
        now = ports.receive(piece, now)
    answering = {entry[0] for entry in ports.out if isinstance(entry[1], tuple)}
    assert answering == {0, 1, 2, 3, 4, 5, 6, 8}
    assert [entry for entry in ports.out if not isinstance(entry[1], tuple)] != []  # pauses


@pytest.fixture(scope="module", autouse=True)
def lamps() -> Iterator[None]:
    """An element that the source does not know."""
    with lamp.registered():
        yield


@pytest.fixture(scope="module")
def whole_trace() -> list[object]:
    world = everything()
    world.run(for_=1.6)
    return list(world.trace)


@pytest.mark.parametrize("cut_ms", [0, 1, 3, 7, 12, 40, 95, 303, 650, 701, 760, 1200, 1501])
def test_a_world_with_everything_goes_on_from_a_snapshot_at_any_moment(whole_trace: list[object], cut_ms: int) -> None:
    one = everything()
    one.run(for_=cut_ms / 1000)
    other = one.branch(one.snapshot())
    for world in (one, other):
        world.run(until=1.6)
        assert list(world.trace) == whole_trace


def parts(thing: object, seen: dict[int, Stateful]) -> None:
    """Everything with state that can be reached from ``thing``."""
    if isinstance(thing, dict):
        for value in list(thing.values()):
            parts(value, seen)
    elif isinstance(thing, tuple | list):
        for value in thing:
            parts(value, seen)
    elif isinstance(thing, Stateful) and id(thing) not in seen:
        seen[id(thing)] = thing
        for base in type(thing).__mro__:
            for slot in getattr(base, "__slots__", ()):
                if slot != "__weakref__":
                    parts(getattr(thing, slot, None), seen)


def product_classes() -> Iterator[type[Stateful]]:
    """Classes with state that are no base of others."""
    for module in pkgutil.walk_packages(steptwin.__path__, "steptwin."):
        if module.name.split(".")[1] in ("controller", "m1486", "mic488", "motion", "simulation", "state", "wbc", "wire"):
            importlib.import_module(module.name)

    def below(base: type[Stateful]) -> Iterator[type[Stateful]]:
        for found in base.__subclasses__():
            if found.__module__.startswith("steptwin."):
                yield from below(found) if found.__subclasses__() else [found]

    return below(Stateful)


def test_everything_that_has_state_is_in_these_tests() -> None:
    world = everything()
    world.run(for_=0.1)
    plan: Any = world.objects
    seen: dict[int, Stateful] = {}
    parts([Ports(), plan.faults, plan.lines], seen)
    for scheduler in plan.schedulers:
        parts([scheduler.controllers, scheduler.parts], seen)
    missing = {found.__name__ for found in product_classes()} - {type(part).__name__ for part in seen.values()}
    assert not missing, f"state of {', '.join(sorted(missing))} is in no snapshot test"
