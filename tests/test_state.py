"""A snapshot taken at any moment and put into another object changes nothing: for everything in the product that has state."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
from toy import lamp

import steptwin
from steptwin.files.world import World
from steptwin.machine import MILLISECOND, SECOND
from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.vision import Com1Port
from steptwin.state import Stateful
from steptwin.wire.crc import with_crc
from steptwin.wire.gateway import Gateway, ScriptPort, TcpGatewayPort
from steptwin.wire.line import SerialLine
from steptwin.wire.slave import RtuSlavePort, TcpSlavePort
from steptwin.wire.timed import LineTiming, TimedRtuSlavePort, TimedUnits

READ = with_crc(bytes.fromhex("01 03 27 24 00 04"))
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

    __slots__ = ("device", "out", "ports", "shared")
    FIXED = frozenset({"out"})

    def __init__(self) -> None:
        self.device = Mic488Device(ControllerConfig())
        units = TimedUnits({1: self.device}, LineTiming(SerialLine(38400)))
        gateway = Gateway(units)
        self.shared = (units, gateway)
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
            dues = [due for port in self.ports if (due := port.deadline()) is not None and due < end]
            if not dues:
                return end
            for number, port in enumerate(self.ports):
                if port.deadline() == min(dues):
                    self.out += [(number, sent) for sent in port.to_send(min(dues))]


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
    assert answering == {0, 1, 2, 3, 4, 5, 6}
    assert [entry for entry in ports.out if not isinstance(entry[1], tuple)] != []  # pauses


WORLD = """
[world]
name = "everything"
[[line]]
name = "bus"
timing = "real"
[[line]]
name = "chips"
kind = "m1486"
timing = "real"
[[mic488]]
name = "table"
line = "bus"
program = "p.prg"
start = true
[mic488.M1]
unit = "mm"
gear = 640.0
acc = 200.0
dec = 200.0
vel = 60.0
pos_ctrl_mode = "ENCODER"
err_ctrl_mode = "ERRMODE0"
[mic488.M2]
limit_mode = "KL+KR"
in_kl = "IN1"
in_kr = "IN2"
[[m1486]]
name = "drum"
line = "chips"
address = 3
[[axis]]
name = "x"
drive = "table.M1"
unit = "mm"
pitch = 5.0
travel = [-50.0, 302.0]
backlash = 0.02
[axis.encoder]
counts_per_rev = 400
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
inertia = 1e-5
friction = 0.05
when_off = "free"
[[carriage]]
name = "slide"
axis = "x"
frequency = 15.0
[[carriage.switch]]
above = 19.99
to = "table.IN7"
[[brake]]
name = "hold"
axis = "x"
torque = 0.6
release = "seen.out"
[[transducer]]
name = "gap"
of = "x.position"
to = "table.AIN2"
points = [[-50, 1.0], [302, 9.0]]
[[collision]]
name = "bump"
when = "x.position > 10 and clamp.position > 1"
[[axis]]
name = "left"
drive = "table.M3"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[[axis]]
name = "right"
drive = "table.M4"
pitch = 5.0
[axis.motor]
torque = [[0, 1.0], [600, 0.5]]
[[gantry]]
name = "beam"
axis = "left"
other = "right"
limit = 0.01
mass = 5.0
[[axis]]
name = "turret"
drive = "drum.M1"
kind = "rotary"
[[axis.switch]]
position = 90.0
width = 5.0
to = "table.IN6"
bounce = "2 ms"
[[wire]]
from = "table.OUT1"
to = "drum.B2"
delay = "3 ms"
[[shaft]]
name = "main"
axis = "x"
ratio = 0.05
[[follower]]
name = "knife"
shaft = "main"
points = [[30, 0], [90, 12], [150, 12], [200, 0]]
[[follower.switch]]
above = 11.5
to = "table.IN13"
[[supply]]
name = "rail"
feeds = "drum"
rise = "0 ms"
[[button]]
name = "start"
to = "table.IN9"
bounce = "5 ms"
[[source]]
to = "table.AIN1"
kind = "sine"
value = 5.0
amplitude = 4.0
[[lamp]]
name = "busy"
from = "table.OUT1"
warms = "20 ms"
[[gate]]
name = "both"
kind = "or"
inputs = ["table.OUT1", "start-time.out"]
[[latch]]
name = "seen"
set = "clamp.extended"
[[wire]]
from = "seen.out"
to = "table.IN10"
[[timer]]
name = "start-time"
kind = "pulse"
time = "300 ms"
input = "table.OUT1"
[[counter]]
name = "cycles"
preset = 2
up = "both.out"
[[relay]]
name = "power"
coil = "both.out"
pull_in = "7 ms"
[[wire]]
from = "power.no"
to = "belt.run"
[[cylinder]]
name = "clamp"
extend = "power.no"
extend_time = "90 ms"
[[conveyor]]
name = "belt"
length = 300.0
speed = 500.0
feed_every = "150 ms"
[[conveyor.sensor]]
at = 100.0
to = "table.IN11"
bounce = "2 ms"
[[vacuum]]
name = "cup"
ejector = "clamp.extended"
pick = "clamp.extended"
from = "belt"
pick_at = 80.0
build_up = "40 ms"
[[wire]]
from = "cup.held"
to = "table.IN12"
[[fault]]
kind = "jam"
element = "clamp"
from_s = 0.35
until_s = 0.9
[[fault]]
kind = "burnt-out"
element = "busy"
from_s = 0.4
until_s = 0.9
[[fault]]
kind = "lost-steps"
axis = 1
machine = "table"
pulses = 300
at_s = 0.7
[[fault]]
kind = "delay"
for_ms = 40
every = 2
[[fault]]
kind = "split"
[[fault]]
kind = "bounce"
machine = "table"
pin = "IN9"
[[fault]]
kind = "master-error"
machine = "table"
from_s = 0.5
until_s = 1.5
[[script]]
name = "both"
steps = [
  { write = { "table.M2_EN" = 1, "table.M2_VEL_ABS" = 400.0, "table.M3_EN" = 1, "table.M3_VEL_ABS" = 90.0 } },
  { send = "chips", text = "x3\\rv2000\\rf12800\\rr\\r" },
  { press = "start", for = "300 ms" },
]
"""
PROGRAM = b"M1 = ON\nA:\nPABS M1 20\nWAITPOS\nOUT1 = ON\nDELAY 0.05\nPABS M1 -3,5\nWAITPOS\nOUT1 = OFF\nJUMP A\n"


@pytest.fixture(scope="module", autouse=True)
def lamps() -> Iterator[None]:
    """An element that the source does not know."""
    with lamp.registered():
        yield


def everything() -> World:
    world = World.from_toml(WORLD, {"p.prg": PROGRAM})
    world.line["bus"].send(READ)
    return world


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
        if module.name.split(".")[1] in ("machine", "m1486", "mic488", "motion", "state", "wbc", "wire", "world"):
            importlib.import_module(module.name)

    def below(base: type[Stateful]) -> Iterator[type[Stateful]]:
        for found in base.__subclasses__():
            if found.__module__.startswith("steptwin."):
                yield from below(found) if found.__subclasses__() else [found]

    return below(Stateful)


def test_everything_that_has_state_is_in_these_tests() -> None:
    world = everything()
    world.run(for_=0.1)
    plan: Any = world.parts
    seen: dict[int, Stateful] = {}
    parts([Ports(), plan.faults, plan.lines], seen)
    for kernel in plan.kernels:
        parts([kernel.machines, kernel.parts], seen)
    missing = {found.__name__ for found in product_classes()} - {type(part).__name__ for part in seen.values()}
    assert not missing, f"state of {', '.join(sorted(missing))} is in no snapshot test"
