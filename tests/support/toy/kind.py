"""The toy as a kind of controller that descriptions of worlds may have, all of it: `TOY` and its line."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial

from steptwin.controller import ControllerEvent, Nanos
from steptwin.controllerstate import DetailRow, StateAxis, StateProgram, StateReader, StateStatus
from steptwin.datasheet import Access, AxisDescription, Datasheet, Detail, FactType, Pin, PinDirection, Point, PointEffect
from steptwin.errors import Misuse, Refusal
from steptwin.points import LivePoint, turning_points_of
from steptwin.simulation.faults import AxisLoad, Faults
from steptwin.simulation.kinds.controllerview import ControllerView
from steptwin.simulation.kinds.kind import (
    BuildContext,
    ControllerKind,
    ControllerSpec,
    LineKind,
    LineUnit,
    LinkKind,
    Member,
    RunningWorld,
    Terminals,
)
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.kinds.registry import KINDS, register
from steptwin.simulation.mechanics.channels import AxisChannel, plain_view
from steptwin.simulation.mechanics.scale import FULL_STEPS, DriveScale, GivenScale
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord
from steptwin.simulation.script import steps as do
from steptwin.simulation.script.control import Halt, Move, StopAxes
from steptwin.simulation.toml.table import key, table
from steptwin.simulation.toml.values import whole
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection as Way
from toy.controller import STEP_P, Toy
from toy.faults import ToyBody
from toy.line import ToyLine


@table("[[toy]]")
class ToySpec(ControllerSpec):
    steps: int = key(whole(1, 10), "for nothing", default=10)


class ToyView(ControllerView):
    def __init__(self, simulation: RunningWorld, name: str, toy: Toy) -> None:
        super().__init__(simulation, name)
        self._toy = toy

    @property
    def position(self) -> int:
        self._sync()
        return self._toy.axis.plan.count(self._toy.now)


class ToyTrafficLog:
    """``M`` and ``P`` with their numbers."""

    def __init__(self, line: ToyLine, prefix: str, sink: Callable[[FrameLine], None]) -> None:
        self._prefix = prefix
        self._sink = sink
        self._units = line.units

    def frame(self, now: Nanos, client: str, direction: Way, data: bytes) -> None:
        text = f"{chr(data[0])} {int.from_bytes(data[1:], signed=True)}"
        self._sink(FrameLine(now, self._prefix + client, direction, data, text))

    def unframed(self, now: Nanos, client: str, count: int) -> None:
        """Every two bytes are a command."""

    def recorded(self, record: TraceRecord) -> None:
        """Frames alone say what goes over the line."""

    def changes(self, client: str, data: bytes) -> Collection[int]:
        return self._units

    def selects(self, data: bytes) -> bool:
        return False

    def refusal(self, client: str, data: bytes) -> str | None:
        return None


POSITION = Point(
    path="position",
    meaning="Pulses.",
    type="number",
    unit="pulse",
    values={},
    access=Access.READ,
    effect=PointEffect.NONE,
    source="P",
)
DATASHEET = Datasheet(
    kind="toy",
    title="toy",
    variant="",
    axes=(AxisDescription(number=1, name="M1", unit="pulse", pulses_per_unit=1.0),),
    pins=(Pin(name="STOP", direction=PinDirection.INPUT), Pin(name="BUSY", direction=PinDirection.OUTPUT)),
    points=(POSITION,),
    commands=(),
    events=(),
    details=(Detail("commands", "Commands that it has taken", FactType.WHOLE, is_brief=True),),
)


def _position(toy: Toy, now: Nanos) -> float:
    return float(toy.axis.plan.count(now))


class ToyState(StateReader[Toy]):
    details = (DetailRow(DATASHEET.details[0], lambda toy, now: toy.taken),)

    def datasheet(self, toy: Toy) -> Datasheet:
        return DATASHEET

    def status(self, toy: Toy, now: Nanos) -> StateStatus:
        return StateStatus(text="off" if toy.is_off else "ok")

    def program(self, toy: Toy, now: Nanos) -> StateProgram:
        return StateProgram(state=None, text="none", variables={})

    def axis(self, toy: Toy, described: AxisDescription, now: Nanos) -> StateAxis:
        return StateAxis(
            number=1,
            name=described.name,
            unit=described.unit,
            position=_position(toy, now),
            velocity=toy.axis.plan.velocity(now),
            moving=toy.is_busy,
            enabled=None,
            encoder=None,
            status=StateStatus(text="busy" if toy.is_busy else "at rest"),
        )


class ToyLines(LineKind[Toy, ToyLine]):
    name = "toys"
    meaning = "toys"
    links: Mapping[str, LinkKind] = {"pty": LinkKind("raw", "pty", "toys"), "tcp": LinkKind("raw", "tcp", "toys")}

    def make(
        self, spec: LineSpec, members: Sequence[Member[Toy]], scheduler: Scheduler, record: RecordSink, faults: Faults
    ) -> ToyLine:
        if len(members) != 1:
            raise Misuse("a toy is alone on its line")
        return ToyLine(scheduler, spec.name, members[0].controller, faults, record)

    def traffic_log(self, line: ToyLine, prefix: str, sink: Callable[[FrameLine], None]) -> ToyTrafficLog:
        return ToyTrafficLog(line, prefix, sink)


class ToyKind(ControllerKind[ToySpec, Toy, ToyView]):
    name = "toy"
    model = "toy"
    spec = ToySpec
    line = ToyLines()
    terminals = Terminals(digital_inputs=("STOP",), analog_inputs=(), outputs=("BUSY",))
    state = ToyState()

    def files(self, spec: ToySpec) -> tuple[()]:
        return ()

    def build(self, spec: ToySpec, context: BuildContext) -> Callable[[bytes | None], Toy]:
        return lambda memory: Toy()

    def address(self, spec: ToySpec, toy: Toy) -> int:
        return 0

    def announced(self, toy: Toy, address: int) -> dict[str, object]:
        return {"kind": "toy"}

    def input_pin(self, pin: str, level: float) -> str:
        if pin.upper() != "STOP" or level not in (0.0, 1.0):
            raise Misuse(f"{pin} = {level:g}: the input is STOP, 0 or 1")
        return "STOP"

    def scale(self, given: GivenScale, toy: Toy, axis: int) -> DriveScale:
        return DriveScale(pulses_per_rev=given.pulses_per_rev or 200, full_steps=FULL_STEPS, text="counts pulses")

    def channels(self, toy: Toy) -> Mapping[str, AxisChannel]:
        return {"1": plain_view("1")}

    def body(self, toy: Toy, service: LineUnit, shafts: Mapping[int, AxisLoad]) -> ToyBody:
        return ToyBody(shafts.values())

    def watch_events(self, toy: Toy, call: Callable[[ControllerEvent], None]) -> None:
        """It reports nothing."""

    def keeps_memory(self, toy: Toy) -> bool:
        return False

    def keep_memory(self, toy: Toy, memory: bytes | None, keep: Callable[[bytes], None]) -> None:
        """It keeps nothing."""

    def datasheet(self, toy: Toy) -> Datasheet:
        return DATASHEET

    def datasheet_of(self, variant: str | None) -> Datasheet:
        return DATASHEET

    def pins(self, toy: Toy) -> Mapping[str, Pin]:
        return {pin.name: pin for pin in DATASHEET.pins}

    def point(self, toy: Toy, name: str) -> LivePoint | None:
        if name.lower() != "position":
            return None
        axis = toy.axis
        return LivePoint(
            point=POSITION,
            read=partial(_position, toy),
            turning_points=turning_points_of(lambda: axis.plan),
            version=lambda: axis.revision,
        )

    def is_idle(self, toy: Toy, now: Nanos) -> bool:
        return not toy.is_busy

    def view(self, world: RunningWorld, name: str, toy: Toy) -> ToyView:
        return ToyView(world, name, toy)

    def move(self, toy: Toy, line: str | None, command: Move) -> do.Send:
        """M takes a number of `STEP_P` pulses."""
        number, rest = divmod(0 if command.by is None else command.by, STEP_P)
        if line is None or command.by is None or rest or not -128 <= number <= 127:
            raise Refusal(f"{command}: by -1280 to 1270 pulses, in tens, on its line")
        return do.Send(line, b"M" + int(number).to_bytes(signed=True))

    def stop_axes(self, toy: Toy, line: str | None, command: StopAxes) -> Halt:
        return Halt(command.controller, command.axis)

    def halt(self, toy: Toy, wanted: Halt, now: Nanos) -> None:
        toy.halt(now)


TOY = ToyKind()


@contextmanager
def registered() -> Generator[None]:
    """Descriptions may have toys meanwhile."""
    register(TOY)
    try:
        yield
    finally:
        del KINDS[TOY.name]
