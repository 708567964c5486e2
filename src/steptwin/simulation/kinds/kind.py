"""The interface between a world and a kind of controller or line: one object of one class for each kind. A missing abstract
member is a `TypeError` at import. A step that needs what only other controllers have is refused with a message."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from string import digits
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

from steptwin.controller import ControllerEvent, Nanos
from steptwin.controllerstate import ControllerState
from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss
from steptwin.optionalmethods import OptionalMethods
from steptwin.simulation.kinds.links import LINK_KEYS, LineSpec
from steptwin.simulation.kinds.programs import WriteUse
from steptwin.simulation.mechanics.mechanics import EncoderReader
from steptwin.simulation.mechanics.scale import DriveScale, GivenScale
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.wires import PinName
from steptwin.simulation.script.control import (
    ControllerCommand,
    ControlProgram,
    Enable,
    Halt,
    Home,
    Jog,
    Move,
    Seek,
    StopAxes,
)
from steptwin.simulation.toml.keypaths import Path
from steptwin.simulation.toml.names import WrongTerminal
from steptwin.simulation.toml.reader import Key
from steptwin.simulation.toml.table import TableSpec, key, table
from steptwin.simulation.toml.values import ANALOG_INPUT, DIGITAL_INPUT, OUTPUT, name_value
from steptwin.textcodec import decode

if TYPE_CHECKING:
    from steptwin.configuration import ConfigurationFormat
    from steptwin.controllerstate import StateReader
    from steptwin.datasheet import Datasheet, Pin
    from steptwin.diagnostics import Diagnostic, SourceText
    from steptwin.points import LivePoint
    from steptwin.simulation.faults import AxisLoad, Body, Faults
    from steptwin.simulation.kinds.lines import Line, LineWrite, TrafficLog
    from steptwin.simulation.kinds.programs import Programs
    from steptwin.simulation.kinds.programtexts import Destination, Downloading, ProgramText, TextLanguage
    from steptwin.simulation.mechanics.channels import AxisChannel
    from steptwin.simulation.scheduler.trace import RecordSink
    from steptwin.simulation.script.deadmanjog import DeadManJog
    from steptwin.simulation.script.steps import Step
    from steptwin.wire.frameline import FrameLine


@table()
class ControllerSpec(TableSpec):
    """The common part of all controllers' tables; each kind adds its own."""

    kind: AnyKind
    name: str = key(name_value, "how the rest of the file names it")
    line: str | None = key(name_value, "the line it is on", default=None)


S = TypeVar("S", bound=ControllerSpec)
M = TypeVar("M", bound=MotionController)
V = TypeVar("V")

NewValues: TypeAlias = tuple[tuple[str, float], ...]
"""Registers by name, and the values to write."""


class BuildContext(Protocol):
    """The description and the files that it refers to, while those of a controller are read."""

    @property
    def lines(self) -> Sequence[LineSpec]: ...

    def data(self, name: str) -> bytes:
        """The content of a file that the description names. Raises `Misuse` if it is not given."""
        ...

    def accept(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """Report the warnings among what was found in a file. Raises `SourceErrors` with the errors, if there are any."""
        ...


class TextContext(BuildContext, Protocol):
    """Further facts about the texts of programs."""

    def downloaded(self, controller: str, place: str) -> SourceText | None:
        """The text that has been put there since the beginning; None where there is none."""
        ...


def text_of(context: BuildContext, name: str) -> str:
    """The text of a file the description names."""
    return decode(context.data(name), name).text


@dataclass(frozen=True, slots=True, kw_only=True)
class Terminals:
    """Names of pins that wires, switches, buttons and sources may be connected to; a pin may be both input and output."""

    digital_inputs: Sequence[str] = ()
    analog_inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()

    def check(self, name: PinName, kind: str) -> None:
        """Raises `Misuse` unless a pin is of a kind: `DIGITAL_INPUT`, `ANALOG_INPUT` or `OUTPUT`."""
        pins = {DIGITAL_INPUT: self.digital_inputs, ANALOG_INPUT: self.analog_inputs, OUTPUT: self.outputs}[kind]
        if name.pin not in pins:
            there = ", ".join(pins) or "none"
            article = "an" if kind[0] in "ao" else "a"
            # Of IN26, and of an output in the place of an input, nobody knows which one is meant.
            is_other = name.pin in (*self.digital_inputs, *self.analog_inputs, *self.outputs)
            others = [] if is_other else [pin for pin in pins if pin.rstrip(digits) != name.pin.rstrip(digits)]
            near = NearMiss()
            meant = near.of(name.pin, others)
            text = f"{name} is not {article} {kind}{near.hint(name.pin, others)}: {kind}s of {name.controller!r} are {there}"
            raise WrongTerminal(str(name), text, None if meant is None else f"{name.controller}.{meant}")


class RunningWorld(Protocol):
    """A running world, as the views of its controllers see it."""

    now: Nanos

    @property
    def controllers(self) -> Mapping[str, MotionController]: ...

    def kind(self, name: str, /) -> AnyKind:
        """The kind of a controller."""
        ...

    def state_of(self, name: str, /) -> ControllerState:
        """The present state of a controller."""
        ...

    def sync(self, name: str, /) -> Scheduler:
        """The scheduler of a controller or line, advanced to the present."""
        ...

    def apply_input(self, what: Step, /) -> None:
        """Execute a step at the present moment, as one from outside. Raises `Misuse`."""
        ...


class MotionEnds(NamedTuple):
    """Conditions on an axis."""

    over: str
    """No motion to a target is in progress."""
    reached: str
    """The last motion has reached its target."""


class EndSwitch(NamedTuple):
    """The input for the switch at an end of an axis (from 1), as a controller is configured."""

    axis: int
    direction: int
    """That of pulses towards it: 1 or -1."""
    pin: str
    active: float
    """Level of the pin at which it is on for the controller."""
    stops: bool
    """Whether the axis cannot move towards it while it is on."""
    key: Path
    """The key in the controller's table that names the pin."""


class LineUnit(NamedTuple):
    """Where a controller is served."""

    unit: int = 1
    """Its name in faults."""
    line: str = ""
    """Empty without one."""


class EncoderInputs(ABC, Generic[M]):
    """The encoder inputs of a controller. Axes count from 1."""

    @abstractmethod
    def reader(self, controller: M, /) -> EncoderReader:
        """The receiver of the counts."""

    @abstractmethod
    def counts_per_pulse(self, controller: M, axis: int, /) -> Fraction:
        """As the controller is configured for an axis."""

    @abstractmethod
    def index_input(self, axis: int, /) -> str:
        """The pin of channel C of an axis."""

    @abstractmethod
    def to_json(self, controller: M, now: Nanos, /) -> list[dict[str, object]]:
        """Counts of each axis and what turns its encoder, as plain data."""

    @abstractmethod
    def is_followed(self, controller: M, axis: int, /) -> bool:
        """Whether an axis goes where its encoder says."""

    @abstractmethod
    def couple(self, controller: M, axis: int, coupling: str, now: Nanos, /) -> None:
        """Choose what turns the shaft of an axis without mechanics: one of `steptwin.simulation.script.steps.COUPLINGS`."""

    @abstractmethod
    def check_turn(self, axis: int, counts: int, /) -> None:
        """Raises `Misuse` for an axis that is not there, and for counts beyond what is permitted at once."""


class NamedRegisters(ABC, Generic[M]):
    """Registers that scripts write by name."""

    @abstractmethod
    def requests(self, controller: M, values: NewValues, /, *, is_command: bool) -> tuple[bytes, ...]:
        """The PDUs that write values by name; neighbours go together.

        Raises `Misuse` for what a register does not take, of a command also for values that the controller would ignore now.
        Scripts and recordings write those all the same: when they are read, the settings on which this depends are not those of
        later.
        """

    @abstractmethod
    def dialect(self, controller: M, /) -> Hashable:
        """Settings on which requests depend besides names and values."""

    @abstractmethod
    def execute(self, controller: M, pdu: bytes, now: Nanos, /) -> bytes:
        """The answer to a PDU that reaches the controller without a line."""

    def uses(self, axis: str, /) -> Mapping[str, WriteUse]:
        """The registers whose write moves an axis (by its number), or starts the program (without one), and acts by something
        else, too."""
        return {}

    @abstractmethod
    def ended_by(self, controller: M, pdu: bytes, /) -> tuple[int, ...]:
        """Motions that a PDU ends if it is a stop: the numbers of axes, and 0 for the program."""


SeenRecord: TypeAlias = tuple[float, float, float, float]
"""A record of a vision system: number, x, y, angle."""


class Vision(ABC, Generic[S, M]):
    """An input for the records of a vision system."""

    @abstractmethod
    def address(self, spec: S, /) -> str | None:
        """HOST:PORT where a running world takes records."""

    @abstractmethod
    def see(self, controller: M, record: SeenRecord, now: Nanos, /) -> None: ...

    @abstractmethod
    def records(self) -> Callable[[bytes], Sequence[SeenRecord]]:
        """For each connection: splits received bytes into records."""


HAS_NONE_OF_THESE = Message("simulation.has-none-of-these", "{name!r} is {title}, which has no {what}")
HOMES_BY_SEEK = Message(
    "simulation.homes-by-seek",
    "{name!r} is {title}, which does not know its switch: home it with seek, such as '-B8', not with a velocity",
)
HOMES_BY_VELOCITY = Message(
    "simulation.homes-by-velocity", "{name!r} is {title}, which knows its switches: home it with a velocity, not with seek"
)
CANNOT_BE_JOGGED = Message("simulation.cannot-be-jogged", "{name!r} is {kind}, which cannot be jogged")


class ControllerKind(OptionalMethods, ABC, Generic[S, M, V]):
    """A kind of controller: its spec, its controller, and what Python programs see of it. Each kind is one object of one class,
    in its folder.

    A missing member that every kind has is a `TypeError` at import. What only some kinds have is refused in the others, or gives
    what there is without it.
    """

    # ------------------------------------------------------------------ its table in a description

    @property
    @abstractmethod
    def name(self) -> str:
        """The name of its table in a description: ``[[name]]``."""

    @property
    @abstractmethod
    def model(self) -> str:
        """For people: ``MIC488``."""

    article: str = "a"

    @property
    @abstractmethod
    def spec(self) -> type[S]:
        """Its table, with the keys."""

    @property
    def keys(self) -> tuple[Key, ...]:
        """The keys of its table."""
        return self.spec.rows.keys

    @property
    def inner_tables(self) -> Mapping[str, tuple[Key, ...]]:
        """The tables in its table, with their keys."""
        return {name: one.keys for one in self.spec.rows.inner for name in one.names}

    @property
    def title(self) -> str:
        """With its article, for messages: ``a MIC488``."""
        return f"{self.article} {self.model}"

    @abstractmethod
    def files(self, spec: S, /) -> Iterable[tuple[str, str]]:
        """Names of the files that a spec refers to, and the keys that do."""

    @abstractmethod
    def build(self, spec: S, context: BuildContext, /) -> Callable[[bytes | None], M]:
        """Read and check its files. Gives what makes its controller at time 0, with the saved content of the non-volatile memory,
        if any, for each world of the description: controllers share only what none of them changes. Both raise `Misuse`."""

    # ------------------------------------------------------------------ what only some have

    def lacks(self, name: str, what: str, /) -> Misuse:
        """Refusal of what only other controllers have, of a controller with that name."""
        return Misuse(HAS_NONE_OF_THESE(name=name, title=self.title, what=what))

    encoders: EncoderInputs[M] | None = None
    registers: NamedRegisters[M] | None = None
    vision: Vision[S, M] | None = None

    # ------------------------------------------------------------------ its line and its surroundings

    @property
    @abstractmethod
    def line(self) -> LineKind[M, Any]:
        """The connection of its line."""

    @abstractmethod
    def address(self, spec: S, controller: M, /) -> int:
        """Unit or address on its line."""

    @abstractmethod
    def announced(self, controller: M, address: int, /) -> dict[str, object]:
        """How drivers reach it at present: ``kind``, and the options behind an address that select it there
        (`steptwin.drivers.kind.AddressSelection`). ``address``: on the line, as it was built."""

    @property
    @abstractmethod
    def terminals(self) -> Terminals: ...

    @abstractmethod
    def input_pin(self, pin: str, level: float, /) -> str:
        """The pin that a name means. Raises `Misuse` with the inputs, or for a value that the pin does not take."""

    def refuse_taken(self, controller: M, pin: str, /) -> None:
        """Raises `Misuse` for a pin that is neither input nor output as the controller is configured."""

    def end_switches(self, controller: M, /) -> Iterable[EndSwitch]:
        """Its inputs for the switches of its axes."""
        return ()

    def ends_motion(self, controller: M, axis: int, /) -> str | None:
        """The input that ends the present motion of an axis (from 1); empty if it has none; None for a motion that needs none."""
        return None

    def filter_of(self, controller: M, pin: str, /) -> Nanos:
        """How long a level must last at an input, ns, before programs of the controller see it."""
        return 0

    def is_inverted(self, controller: M, pin: str, /) -> bool:
        """Whether programs and registers have the other level of an input than its terminal."""
        return False

    def would_end_seek(self, controller: M, pin: str, /) -> bool:
        """Whether a seek of an input (`steptwin.simulation.script.control.Seek`) would end without any motion now."""
        return False

    @abstractmethod
    def scale(self, given: GivenScale, controller: M, axis: int, /) -> DriveScale:
        """How its axis of a number (from 1) counts. Raises `Misuse`."""

    @abstractmethod
    def channels(self, controller: M, /) -> Mapping[str, AxisChannel]:
        """How its axes are shown in a trace, by the subject of their plans."""

    @abstractmethod
    def body(self, controller: M, service: LineUnit, shafts: Mapping[int, AxisLoad], /) -> Body:
        """Its parts that faults act on; shafts are those of the mechanics of its axes, by number."""

    @abstractmethod
    def watch_events(self, controller: M, call: Callable[[ControllerEvent], None], /) -> None:
        """Call a function with every event of the controller from now on."""

    @abstractmethod
    def keeps_memory(self, controller: M, /) -> bool:
        """Whether it has non-volatile memory."""

    @abstractmethod
    def keep_memory(self, controller: M, memory: bytes | None, keep: Callable[[bytes], None], /) -> None:
        """Call ``keep`` with its non-volatile memory after each change, and at once if it differs from the saved content
        ``memory``."""

    # ------------------------------------------------------------------ what there is to read of it

    @abstractmethod
    def datasheet(self, controller: M, /) -> Datasheet:
        """Its static description, the same object for all controllers that have the same."""

    @abstractmethod
    def datasheet_of(self, variant: str | None, /) -> Datasheet:
        """That of a controller that is not configured: of a variant by its name, or the usual one. Raises `Misuse`."""

    @abstractmethod
    def pins(self, controller: M, /) -> Mapping[str, Pin]:
        """Those of its data sheet by name. They do not depend on its configuration, so they are there before the sheet."""

    @abstractmethod
    def point(self, controller: M, name: str, /) -> LivePoint | None:
        """The point of its data sheet that a name or an address means: what conditions, scripts and programs outside read of it.
        None where there is none; raises `Misuse` for what is half a value."""

    def marks(self, controller: M, /) -> tuple[object, ...]:
        """Values of which some are others after an event that has changed points which neither move nor are only kept
        (`steptwin.points.LivePoint`). It is faster than to compare all points after each event, as is done without it."""
        return (object(),)

    def mark_of(self, path: str, /) -> int:
        """The number of the one of `marks` that is another one if the point with this path is."""
        return 0

    @property
    @abstractmethod
    def state(self) -> StateReader[M]:
        """Its present state; the controller is at that moment."""

    @abstractmethod
    def is_idle(self, controller: M, now: Nanos, /) -> bool:
        """Whether all axes stand and no program runs."""

    @abstractmethod
    def view(self, world: RunningWorld, name: str, controller: M, /) -> V:
        """Its view for Python programs in a running world."""

    def remarks(self, name: str, controller: M, /) -> Sequence[str]:
        """Notices for the user who starts it, under a name."""
        return ()

    # ------------------------------------------------------------------ commands, as its master does them

    # ``line`` is the name of its line; the controller is at the present. They raise `Misuse`, and `Refusal` for what cannot be
    # done now.

    def enable(self, controller: M, line: str | None, command: Enable, /) -> Step:
        raise self._cannot(command)

    def move(self, controller: M, line: str | None, command: Move, /) -> Step:
        raise self._cannot(command)

    def home(self, controller: M, line: str | None, command: Home, /) -> Step:
        if not self.offers(ControllerKind.seek):
            raise self._cannot(command)
        raise Misuse(HOMES_BY_SEEK(name=command.controller, title=self.title))

    def seek(self, controller: M, line: str | None, command: Seek, /) -> Step:
        """The beginning of a seek, of a controller that does not know its switch."""
        raise Misuse(HOMES_BY_VELOCITY(name=command.controller, title=self.title))

    def jog(self, controller: M, line: str | None, command: Jog, /) -> Step:
        raise self._cannot(command)

    def stop_axes(self, controller: M, line: str | None, command: StopAxes, /) -> Step | Halt:
        raise self._cannot(command)

    def control_program(self, controller: M, line: str | None, command: ControlProgram, /) -> Step | Halt:
        raise self._cannot(command)

    def _cannot(self, command: ControllerCommand) -> Misuse:
        return self.lacks(command.controller, f"command {type(command).__name__.lower()}")

    @cached_property
    def commands(self) -> Sequence[type[ControllerCommand]]:
        """The commands that its master can do."""
        methods: Mapping[type[ControllerCommand], Callable[..., object]] = {
            Enable: ControllerKind.enable,
            Move: ControllerKind.move,
            Home: ControllerKind.home,
            Jog: ControllerKind.jog,
            StopAxes: ControllerKind.stop_axes,
            ControlProgram: ControllerKind.control_program,
        }
        return tuple(command for command, method in methods.items() if self.offers(method))

    def step_of(self, controller: M, line: str | None, command: ControllerCommand | Seek, /) -> Step | Halt:
        """The step by which its master does a command; a stop is done at the controller itself."""
        match command:
            case Move():
                return self.move(controller, line, command)
            case Jog():
                return self.jog(controller, line, command)
            case StopAxes():
                return self.stop_axes(controller, line, command)
            case Enable():
                return self.enable(controller, line, command)
            case Home():
                return self.home(controller, line, command)
            case Seek():
                return self.seek(controller, line, command)
            case ControlProgram():
                return self.control_program(controller, line, command)

    def motion_ends(self, name: str, axis: int, line: str | None, seek: Seek | None, /) -> MotionEnds:
        """Conditions on an axis (from 1) of a controller with that name in conditions, or at the end of a seek. Refused where its
        state does not show how a motion ended."""
        raise self.lacks(name, "status of motions: send its commands, and wait for a condition")

    def dead_man_jog(self, controller: M, line: str | None, wanted: Jog, /) -> DeadManJog:
        """A jog that lasts only while it is extended."""
        raise Refusal(CANNOT_BE_JOGGED(name=wanted.controller, kind=self.title))

    @abstractmethod
    def halt(self, controller: M, wanted: Halt, now: Nanos, /) -> None:
        """Stop the controller, which is at that moment, at once and without its line."""

    # ------------------------------------------------------------------ its programs

    languages: Sequence[TextLanguage] = ()
    """Languages of the texts in its program memory."""
    dialect_keys: Sequence[str] = ()
    """Keys of its table on which depends what these texts may contain."""
    configuration_format: ConfigurationFormat | None = None
    """How its configuration file becomes a form; None for a kind that has none."""

    def texts(self, spec: S, controller: M, context: TextContext, /) -> Sequence[ProgramText]:
        """Texts in its program memory, one text for each place there; the controller is at the present."""
        return ()

    def programs(self, spec: S, controller: M, context: TextContext, /) -> Programs | None:
        """Its programs while they are executed; None for a kind without any."""
        return None

    def watch_program(self, controller: M, scheduler: Scheduler, name: str, /) -> ProgramReport | None:
        """Watch the programs of the controller, which has that name in its scheduler; None without any."""
        return None

    def download(self, controller: M, to: Destination, source: SourceText, /) -> Downloading:
        """How a text comes to one of the places of `texts`. Changes nothing yet. Raises `SourceErrors` for a text with errors,
        and `Refusal` for what cannot be done now."""
        raise self.lacks(to.controller, "program memory")

    def configuration(self, spec: S, controller: M, context: BuildContext, /) -> SourceText | None:
        """Its configuration file: as it was given, else made of its settings; None for a kind that has none."""
        return None


class ProgramAct(Protocol):
    """An action of a program."""

    @property
    def time(self) -> Nanos: ...
    @property
    def text(self) -> str: ...
    @property
    def place(self) -> str:
        """Line and text of the statement; empty without one."""
        ...

    @property
    def is_done(self) -> bool:
        """Whether a statement did it, which others of that moment may come of; it did not if it has only begun."""
        ...


class ProgramReport(Protocol):
    """Actions of programs since they are watched, in order of time."""

    @property
    def happened(self) -> Sequence[ProgramAct]: ...


AnyKind: TypeAlias = ControllerKind[Any, Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Member(Generic[M]):
    """A controller on a line."""

    spec: ControllerSpec
    controller: M
    address: int


L = TypeVar("L", bound="Line")


class LineKind(ABC, Generic[M, L]):
    """A kind of line, ``kind`` of ``[[line]]``. Each kind is one object of one class."""

    @property
    @abstractmethod
    def name(self) -> str: ...

    @property
    @abstractmethod
    def meaning(self) -> str:
        """For people: ``modbus (MIC488)``."""

    @property
    @abstractmethod
    def links(self) -> Mapping[str, LinkKind]:
        """Keys of ``[[line]]`` that open it for programs outside, and what they open. `opened_by` has all."""

    keys: frozenset[str] = frozenset()
    """Other keys of ``[[line]]`` that not all kinds have."""

    @abstractmethod
    def make(
        self, spec: LineSpec, members: Sequence[Member[M]], scheduler: Scheduler, record: RecordSink, faults: Faults, /
    ) -> L:
        """The line with its members, at least one. Raises `Misuse` if they do not fit together."""

    @abstractmethod
    def traffic_log(self, line: L, prefix: str, sink: Callable[[FrameLine], None], /) -> TrafficLog:
        """Log of the traffic on a line, for a function; ``prefix`` is put before the name of a client."""

    def writes(self, line: L, take: Callable[[LineWrite], None], /) -> Callable[[], None] | None:
        """Call a function with what programs write over a line, until the returned function is called; None where that is not
        told from reads."""
        return None

    @property
    def opened_by(self) -> Mapping[str, LinkKind]:
        """Links by the keys of ``[[line]]`` that can open it."""
        alike = {
            key.name: LinkKind(self.links[key.like].client_kind, key.name, f"{self.links[key.like].protocol}, {key.name}")
            for key in LINK_KEYS.values()
            if key.name not in self.links and key.like in self.links
        }
        return {**self.links, **alike}


AnyLineKind: TypeAlias = LineKind[Any, Any]


@dataclass(frozen=True, slots=True)
class LinkKind:
    """Link that a key of ``[[line]]`` opens."""

    client_kind: str
    """The kind of its clients on the line, one of `steptwin.simulation.kinds.lines.Line.kinds`."""
    client: str
    """The name of its clients; numbered on links for any number of programs."""
    protocol: str
    """For people: ``Modbus RTU``."""
