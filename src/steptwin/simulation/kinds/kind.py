"""The interface between a world and a kind of controller or line: one value for each kind. A missing field is a `TypeError` at
import. A field that only some controllers have is None in the others, and a step that needs it is refused with a message."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from string import digits
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeAlias, TypeVar

from steptwin.errors import Misuse
from steptwin.machine import MachineEvent, Nanos
from steptwin.messages import Message
from steptwin.motioncontroller import MotionController
from steptwin.nearmiss import NearMiss
from steptwin.simulation.kinds.links import LINK_KEYS, LineSpec
from steptwin.simulation.mechanics.mechanics import EncoderReader
from steptwin.simulation.mechanics.scale import DriveScale, GivenScale
from steptwin.simulation.scheduler.kernel import Kernel
from steptwin.simulation.scheduler.wires import PinName
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
    from steptwin.simulation.kinds.lines import Line, LineWords, LineWrite
    from steptwin.simulation.kinds.programs import Programs
    from steptwin.simulation.kinds.programtexts import Destination, Downloading, ProgramText, TextLanguage
    from steptwin.simulation.mechanics.lanes import AxisLane
    from steptwin.simulation.scheduler.trace import RecordSink
    from steptwin.simulation.script.control import ControllerCommand, Halt, Jog, Seek
    from steptwin.simulation.script.heldjog import HeldJog
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


class PointMarks(NamedTuple, Generic[M]):
    """Values of which some are others after an event that has changed points which neither move nor are only kept
    (`steptwin.points.LivePoint`)."""

    values: Callable[[M], tuple[object, ...]]
    of: Callable[[str], int] = lambda path: 0
    """The number of the value that is another one if the point with this path is."""


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

    def downloaded(self, machine: str, place: str) -> SourceText | None:
        """The text that has been put there since the beginning; None where there is none."""
        ...


def text_of(context: BuildContext, name: str) -> str:
    """The text of a file the description names."""
    return decode(context.data(name), name).text


@dataclass(frozen=True, slots=True, kw_only=True)
class Terminals:
    """Names of pins that wires, switches, buttons and sources may be joined to; a pin may be both input and output."""

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
            text = f"{name} is not {article} {kind}{near.hint(name.pin, others)}: {kind}s of {name.machine!r} are {there}"
            raise WrongTerminal(str(name), text, None if meant is None else f"{name.machine}.{meant}")


class RunningWorld(Protocol):
    """A running world, as the views of its controllers see it."""

    now: Nanos

    @property
    def machines(self) -> Mapping[str, MotionController]: ...

    def kind(self, name: str, /) -> AnyKind:
        """The kind of a machine."""
        ...

    def touch(self, name: str, /) -> Kernel:
        """The kernel of a machine or line, advanced to the present."""
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


class LineUnit(NamedTuple):
    """Where a controller is served."""

    unit: int = 1
    """Its name in faults."""
    line: str = ""
    """Empty without one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderInputs(Generic[M]):
    """The encoder inputs of a controller. Axes count from 1."""

    reader: Callable[[M], EncoderReader]
    """The receiver of the counts."""
    counts_per_pulse: Callable[[M, int], Fraction]
    """As the controller is configured for an axis."""
    index_input: Callable[[int], str]
    """The pin of channel C of an axis."""
    shown: Callable[[M, Nanos], list[dict[str, object]]]
    """Counts of each axis and what turns its encoder, as plain data."""
    couple: Callable[[M, int, str, Nanos], None]
    """Choose what turns the shaft of an axis without mechanics: one of `steptwin.simulation.script.steps.COUPLINGS`."""
    check_turn: Callable[[int, int], None]
    """Raises `Misuse` for an axis that is not there, and for counts beyond what is permitted at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedRegisters(Generic[M]):
    """Registers that scripts write by name."""

    requests: Callable[[M, NewValues], tuple[bytes, ...]]
    """The PDUs that write values by name. Raises `Misuse` for what a register does not take."""
    dialect: Callable[[M], Hashable]
    """What requests depend on besides names and values."""
    execute: Callable[[M, bytes, Nanos], bytes]
    """The answer to a PDU that reaches the controller without a line."""
    ended_by: Callable[[M, bytes], tuple[int, ...]]
    """What a PDU ends if it is a stop: the numbers of axes, and 0 for the program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vision(Generic[S, M]):
    """An input for the records of a vision system: number, x, y, angle."""

    address: Callable[[S], str | None]
    """HOST:PORT where a running world takes records."""
    see: Callable[[M, tuple[float, float, float, float], Nanos], None]
    records: Callable[[], Callable[[bytes], Sequence[tuple[float, float, float, float]]]]
    """For each connection: splits received bytes into records."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerKind(Generic[S, M, V]):
    """A kind of controller: its spec, its machine, and what Python programs see of it."""

    name: str
    """The name of its table in a description: ``[[name]]``."""
    model: str
    """For people: ``MIC488``."""
    article: str = "a"
    spec: type[S]
    """Its table, with the keys."""
    files: Callable[[S], Iterable[tuple[str, str]]]
    """Names of the files that a spec refers to, and the keys that do."""
    build: Callable[[S, BuildContext], Callable[[bytes | None], M]]
    """Reads and checks its files. Gives what makes its machine at time 0, with the saved content of the non-volatile memory, if
    any, for each world of the description: machines share only what none of them changes. Both raise `Misuse`."""
    watch_events: Callable[[M, Callable[[MachineEvent], None]], None]
    """Call a function with every event of the machine from now on."""
    keep_memory: Callable[[M, bytes | None, Callable[[bytes], None]], None]
    """Call a function with its non-volatile memory after each change, and at once if it differs from the saved content."""
    announced: Callable[[M, int], dict[str, object]]
    """How drivers reach it at present: ``kind``, and the options behind an address that select it there
    (`steptwin.drivers.kind.AddressSelection`). The number is its address on the line, as it was built."""
    line: LineKind
    """The connection of its line."""
    address: Callable[[S, M], int]
    """Unit or address on its line."""
    terminals: Terminals
    input_pin: Callable[[str, float], str]
    """The pin that a name means. Raises `Misuse` with the inputs, or for a value that the pin does not take."""
    refuse_taken: Callable[[M, str], None] = lambda machine, pin: None
    """Raises `Misuse` for a pin that is neither input nor output as the machine is configured."""
    scale: Callable[[GivenScale, M, int], DriveScale]
    """How its axis of a number (from 1) counts. Raises `Misuse`."""
    is_idle: Callable[[M, Nanos], bool]
    """Whether all axes stand and no program runs."""
    datasheet: Callable[[M], Datasheet]
    """Its static description, the same object for all machines that have the same."""
    pins: Callable[[M], Mapping[str, Pin]]
    """Those of its data sheet by name. They do not depend on its configuration, so they are there before the sheet."""
    datasheet_of: Callable[[str | None], Datasheet]
    """That of a controller that is not configured: of a variant by its name, or the usual one. Raises `Misuse`."""
    point: Callable[[M, str], LivePoint | None]
    """The point of its data sheet that a name or an address means: what conditions, scripts and programs outside read of it. None
    where there is none; raises `Misuse` for what is half a value."""
    marks: PointMarks[M] | None = None
    """Faster than to compare all points after each event, which is done where there is none."""
    motion_ends: Callable[[str, str | None, Seek | None], MotionEnds] | None = None
    """Conditions on an axis, which has that name in conditions, of a controller on a line with that name, or at the end of a
    seek; None where its state does not show how a motion ended."""
    seek: Callable[[M, str | None, Seek], Step] | None = None
    """The step that begins a seek, of a controller that does not know its switch; arguments and exceptions as those of
    ``control``."""
    control: Mapping[type[ControllerCommand], Callable[[M, str | None, Any], Step | Halt]]
    """The steps by which its master does the commands for controllers that it can do. The text is the name of its line; the
    machine is at the present. Raises `Misuse`, and `Refusal` for what cannot be done now."""
    halt: Callable[[M, Halt, Nanos], None]
    """Stop the machine, which is at that moment, at once and without its line."""
    held_jog: Callable[[M, str | None, Jog], HeldJog] | None = None
    """A jog that lasts only while it is extended; arguments and exceptions as those of ``control``."""
    state: StateReader[M]
    """Its present state; the machine is at that moment."""
    statement: Callable[[M], str | None] = lambda machine: None
    """The statement that its program is at, while one runs or is paused, as text."""
    view: Callable[[RunningWorld, str, M], V]
    """Its view for Python programs in a running world."""
    lanes: Callable[[M], Mapping[str, AxisLane]]
    """How its axes are shown in a trace, by the subject of their plans."""
    body: Callable[[M, LineUnit, Mapping[int, AxisLoad]], Body]
    """Its parts that faults act on; shafts are those of the mechanics of its axes, by number."""
    keeps_memory: Callable[[M], bool]
    """Whether it has non-volatile memory."""
    watch_program: Callable[[M, Kernel, str], ProgramReport | None] = lambda machine, kernel, name: None
    """Watch the programs of the machine, which has that name in its kernel; None without any."""
    languages: Sequence[TextLanguage] = ()
    """Those of the texts in its program memory."""
    dialect_keys: Sequence[str] = ()
    """Keys of its table on which depends what these texts may contain."""
    texts: Callable[[S, M, TextContext], Sequence[ProgramText]] = lambda spec, machine, context: ()
    """What is in its program memory, one text for each place there; the machine is at the present."""
    programs: Callable[[S, M, TextContext], Programs | None] = lambda spec, machine, context: None
    """Its programs while they are executed; None for a kind without any."""
    download: Callable[[M, Destination, SourceText], Downloading] | None = None
    """How a text comes to one of the places of ``texts``. Changes nothing yet. Raises `SourceErrors` for a text with errors, and
    `Refusal` for what cannot be done now."""
    configuration: Callable[[S, M, BuildContext], SourceText | None] = lambda spec, machine, context: None
    """Its configuration file: as it was given, else made of its settings; None for a kind that has none."""
    configuration_format: ConfigurationFormat | None = None
    """How this file becomes a form; None for a kind that has none."""
    remarks: Callable[[str, M], Sequence[str]] = lambda name, machine: ()
    """Notices for the user who starts it, under a name."""
    encoders: EncoderInputs[M] | None = None
    registers: NamedRegisters[M] | None = None
    vision: Vision[S, M] | None = None

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
class Member:
    """A controller on a line."""

    spec: ControllerSpec
    machine: Any
    address: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LineKind:
    """A kind of line, ``kind`` of ``[[line]]``."""

    name: str
    meaning: str
    """For people: ``modbus (MIC488)``."""
    links: Mapping[str, LinkKind]
    """Keys of ``[[line]]`` that open it for programs outside, and what they open. `opened_by` has all."""
    keys: frozenset[str] = frozenset()
    """Other keys of ``[[line]]`` that not all kinds have."""
    make: Callable[[LineSpec, Sequence[Member], Kernel, RecordSink, Faults], Line]
    """The line with its members, at least one. Raises `Misuse` if they do not fit together."""
    words: Callable[[Any, str, Callable[[FrameLine], None]], LineWords]
    """What goes over a line that was made, in words for a function; the text is put before the name of a place."""
    writes: Callable[[Any, Callable[[LineWrite], None]], Callable[[], None]] | None = None
    """Calls a function with what programs write over a line, until the returned function is called; None where that is not told
    from reads."""

    @property
    def opened_by(self) -> Mapping[str, LinkKind]:
        """What each key of ``[[line]]`` opens that can open it."""
        alike = {
            key.name: LinkKind(self.links[key.like].place_kind, key.name, f"{self.links[key.like].protocol}, {key.name}")
            for key in LINK_KEYS.values()
            if key.name not in self.links and key.like in self.links
        }
        return {**self.links, **alike}


@dataclass(frozen=True, slots=True)
class LinkKind:
    """What a key of ``[[line]]`` opens."""

    place_kind: str
    """The kind of its places on the line, one of `steptwin.simulation.kinds.lines.Line.kinds`."""
    place: str
    """The name of its places; numbered on links for any number of programs."""
    protocol: str
    """For people: ``Modbus RTU``."""


HAS_NONE_OF_THESE = Message("simulation.has-none-of-these", "{name!r} is {title}, which has no {what}")


def lacks(name: str, kind: AnyKind, what: str) -> Misuse:
    """Refuses what only other controllers have."""
    return Misuse(HAS_NONE_OF_THESE(name=name, title=kind.title, what=what))
