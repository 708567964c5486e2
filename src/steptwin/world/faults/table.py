"""What a kind of fault is made of: its parameters, what it waits for, where it can happen, and what it does."""

from __future__ import annotations

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, TypedDict, Unpack

from steptwin.errors import Misuse
from steptwin.numerals import read_whole
from steptwin.tables import IncompleteTable

if TYPE_CHECKING:
    from steptwin.machine import Nanos
    from steptwin.world.faults.active import ActiveFault
    from steptwin.world.faults.answers import AlteredAnswer, Exchange
    from steptwin.world.faults.fault import Fault
    from steptwin.world.faults.machine import FaultyMachine
    from steptwin.world.faults.stream import Run

FaultReporter: TypeAlias = "Callable[[ActiveFault, str], None]"
"""A fault has happened, and what it did."""

FaultValue: TypeAlias = int | float | str | tuple[int, int]
"""Of a parameter. A range is (first, last)."""


class Layer(enum.StrEnum):
    BYTES = "bytes"
    FRAMES = "frames"
    PROTOCOL = "protocol"
    PHYSICS = "physics"
    ELEMENT = "element"
    """What is around controllers: elements bring their own."""


class Occasion(enum.StrEnum):
    """What a fault waits for: what ``nth`` and ``every`` count and ``probability`` is of."""

    BYTE = "byte"
    DELIVERY = "delivery"
    """What is handed over at once: an answer, or what one read of a link brought."""
    ANSWER = "answer"
    REQUEST = "request"
    MOMENT = "moment"
    """At ``at_s``, and every ``period_s`` from then on."""
    CHANGE = "change"
    """Of the pin."""
    SAVE = "save"
    """Of a memory that survives power-off."""
    ALWAYS = "always"
    """From ``from_s`` to ``until_s``."""


class Need(enum.Enum):
    """What some machines have and others have not."""

    ENCODER = "encoder"
    MODBUS_MASTER = "Modbus master of its own"


class LineProtocol(enum.StrEnum):
    """What faults but those of physics can happen on."""

    RTU = "Modbus RTU"
    TCP = "Modbus TCP"
    CHARACTERS = "M1486"


class ParameterForm(enum.Enum):
    WHOLE = "whole number"
    NUMBER = "number"
    SPAN = "number or span such as 10020-10035"
    WORD = "one of its words"
    TEXT = "text"


@dataclass(frozen=True, slots=True)
class Parameter:
    """``least`` and ``most`` bound numbers; ``words`` are the permitted ones; ``otherwise`` is what holds without a default."""

    name: str
    form: ParameterForm
    meaning: str
    least: float | None = None
    most: float | None = None
    words: tuple[str, ...] = ()
    default: FaultValue | None = None
    otherwise: str = ""
    is_required: bool = False

    @property
    def permitted(self) -> str:
        """What it takes, in words."""
        if self.words:
            return ", ".join(self.words)
        bounds = _plain(self.least) if self.least is not None else ""
        if self.most is not None:
            bounds += f" to {_plain(self.most)}"
        elif bounds:
            bounds += " and more"
        if self.form is ParameterForm.TEXT:
            return "text"
        what = (
            "whole numbers"
            if self.form is ParameterForm.WHOLE
            else "numbers"
            if self.form is ParameterForm.NUMBER
            else "numbers or spans N-M"
        )
        return f"{what} {bounds}".rstrip()

    def plain(self) -> dict[str, object]:
        """As JSON. ``default`` is the text of the value that holds without one, or names its source."""
        return {
            "name": self.name,
            "meaning": self.meaning,
            "permitted": self.permitted,
            "default": self.otherwise if self.default is None else f"{self.default}",
            "words": list(self.words),
            "required": self.is_required,
        }


def _plain(number: float) -> str:
    """Without an exponent: 0.000001, 65535, 1 000 000 000."""
    if abs(number) >= 1e6:
        return f"{number:,.0f}".replace(",", " ")
    return f"{number:.6f}".rstrip("0").rstrip(".")


@dataclass(frozen=True, slots=True)
class ByteEffect:
    """``act`` gives what arrives of a byte, None where it is lost; bytes before it are put into the run."""

    act: Callable[[ActiveFault, int, Run, FaultReporter], int | None]


@dataclass(frozen=True, slots=True)
class InsertEffect:
    """``act`` puts bytes into the run before those of a delivery."""

    act: Callable[[ActiveFault, Run, FaultReporter], None]


@dataclass(frozen=True, slots=True)
class PiecesEffect:
    """``act`` gives the pieces in which a run arrives, each with its delay; takes the run and the length of the delivery. Only
    one such fault happens to a delivery, the first."""

    act: Callable[[ActiveFault, Run, int, FaultReporter], list[tuple[Nanos, bytes]]]


@dataclass(frozen=True, slots=True)
class AnswerEffect:
    """``answer`` gives what is sent of an answer; without bytes later faults have nothing to happen to."""

    answer: Callable[[ActiveFault, Exchange, int, AlteredAnswer, FaultReporter], AlteredAnswer]


@dataclass(frozen=True, slots=True)
class RequestEffect:
    """``refusal`` gives the exception code and the text for a request that is not carried out. ``is_refused``: whether this one
    is not; else it is carried out, and ``answer`` gives what is sent, as in `AnswerEffect`."""

    refusal: Callable[[ActiveFault], tuple[int, str]]
    is_refused: Callable[[Fault], bool] | None = None
    answer: Callable[[ActiveFault, Exchange, int, AlteredAnswer, FaultReporter], AlteredAnswer] | None = None


@dataclass(frozen=True, slots=True)
class MomentEffect:
    act: Callable[[ActiveFault, FaultyMachine, Nanos], None]


@dataclass(frozen=True, slots=True)
class WindowEffect:
    """``act`` is called at the beginning and at the end."""

    act: Callable[[ActiveFault, FaultyMachine, Nanos], None]


@dataclass(frozen=True, slots=True)
class ChangeEffect:
    """``act`` takes the pin and its levels, before and after."""

    act: Callable[[ActiveFault, FaultyMachine, str, tuple[float, float], Nanos], None]


@dataclass(frozen=True, slots=True)
class SaveEffect:
    """``act`` takes what the memory held and changes what it keeps."""

    act: Callable[[ActiveFault, FaultyMachine, bytes, bytearray, Nanos], None]


@dataclass(frozen=True, slots=True)
class ElementEffect:
    """``act`` takes what was built of the element, and whether the fault begins or ends; gives what it did, in words."""

    act: Callable[[ActiveFault, Any, bool, Nanos], str]
    holds: str = ""
    """The parameter with the terminal that it holds at its ``level``; empty: none."""


_FITTING: dict[Occasion, tuple[tuple[Layer, ...], tuple[type, ...]]] = {
    Occasion.BYTE: ((Layer.BYTES,), (ByteEffect,)),
    Occasion.DELIVERY: ((Layer.BYTES,), (InsertEffect, PiecesEffect)),
    Occasion.ANSWER: ((Layer.FRAMES,), (AnswerEffect,)),
    Occasion.REQUEST: ((Layer.FRAMES, Layer.PROTOCOL), (RequestEffect,)),
    Occasion.MOMENT: ((Layer.PHYSICS,), (MomentEffect,)),
    Occasion.CHANGE: ((Layer.PHYSICS,), (ChangeEffect,)),
    Occasion.SAVE: ((Layer.PHYSICS,), (SaveEffect,)),
    Occasion.ALWAYS: ((Layer.PHYSICS, Layer.ELEMENT), (WindowEffect, ElementEffect)),
}
"""The layers that have an occasion, and the effects of which one is needed there."""


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A row. ``own`` are the parameters of this kind alone, ``lines`` what it can happen on. ``needs``: what a
    machine must have beyond what parameters and occasion need. ``check`` takes the `FaultyMachine`, or what was built of the
    element, and raises `Misuse` where it cannot happen."""

    name: str
    layer: Layer
    occasion: Occasion
    meaning: str
    own: tuple[Parameter, ...] = ()
    lines: tuple[LineProtocol, ...] = ()
    effect: Any = None
    """What it does: one of the effects that fit the occasion. A kind without it is refused when the table is built."""
    needs: Need | None = None
    check: Callable[[Any, Fault], None] | None = None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All it takes: its own, where it happens, when it happens."""
        return (*self.own, *WHERE[self.layer], *WHEN[self.occasion])

    def plain(self) -> dict[str, object]:
        """As JSON."""
        return {
            "name": self.name,
            "layer": self.layer.value,
            "occasion": self.occasion.value,
            "meaning": self.meaning,
            "lines": [line.value for line in self.lines],
            "parameters": [parameter.plain() for parameter in self.parameters],
        }

    def parameter(self, name: str) -> Parameter | None:
        return next((parameter for parameter in self.parameters if parameter.name == name), None)


class ParameterOptions(TypedDict, total=False):
    """What a parameter that is a number may have besides its range; see `Parameter`."""

    default: FaultValue | None
    otherwise: str
    is_required: bool


def whole(name: str, meaning: str, least: int, most: int | None, **options: Unpack[ParameterOptions]) -> Parameter:
    return Parameter(name, ParameterForm.WHOLE, meaning, least, most, **options)


def number(name: str, meaning: str, least: float, most: float | None, **options: Unpack[ParameterOptions]) -> Parameter:
    return Parameter(name, ParameterForm.NUMBER, meaning, least, most, **options)


LARGEST_WHOLE = 1 << 63
"""No whole number of a fault is as large."""
LONGEST_S = 1e9
LONGEST_MS = 1e9

_WINDOW = (
    number("from_s", "Not before so many seconds after the fault was set.", 0, LONGEST_S, default=0.0),
    number("until_s", "Not later than this.", 0, LONGEST_S, otherwise="no end"),
)
_COUNT = whole("count", "It happens at most so often.", 1, None, otherwise="as often as it comes to it")
_CHANCE = number("probability", "How probable it is each time.", 0, 1, default=1.0)
_HITS = (
    whole("nth", "Only this time, counted from 1.", 1, None, otherwise="each time"),
    whole("every", "Each time this number has come round.", 1, None, default=1),
    _CHANCE,
    _COUNT,
    *_WINDOW,
)
_MOMENTS = (
    number("at_s", "When, in seconds after the fault was set.", 0, LONGEST_S, default=0.0),
    number("period_s", "And again and again after so many seconds.", 1e-6, LONGEST_S, otherwise="once"),
    _CHANCE,
    _COUNT,
    _WINDOW[1],
)
_LINK = Parameter("link", ParameterForm.TEXT, "On this link alone, such as tcp-1, pty, serial; tcp: each tcp-N.", otherwise="all")
_LINE = Parameter("line", ParameterForm.TEXT, "On this line of a world alone.", otherwise="all")
_MACHINE = Parameter("machine", ParameterForm.TEXT, "Which machine; for a served twin its unit.", otherwise="the only one")
AXIS = whole("axis", "Which axis.", 1, 16, default=1)
PIN = Parameter("pin", ParameterForm.TEXT, "Which input.", is_required=True)
_ADDRESSED = (
    whole("unit", "Requests to this unit.", 0, 255, otherwise="all"),
    whole("function", "Requests with this function code.", 1, 127, otherwise="all"),
    Parameter("address", ParameterForm.SPAN, "Requests that touch these addresses.", 0, 65535, otherwise="all"),
    _LINK,
    _LINE,
)
WHERE: dict[Layer, tuple[Parameter, ...]] = {
    Layer.BYTES: (
        Parameter("direction", ParameterForm.WORD, "Towards the twin, or from it.", words=("in", "out"), default="out"),
        _LINK,
        _LINE,
    ),
    Layer.FRAMES: _ADDRESSED,
    Layer.PROTOCOL: _ADDRESSED,
    Layer.PHYSICS: (_MACHINE,),
    Layer.ELEMENT: (Parameter("element", ParameterForm.TEXT, "Which element, by its name.", is_required=True),),
}
WHEN: dict[Occasion, tuple[Parameter, ...]] = {
    **dict.fromkeys((Occasion.BYTE, Occasion.DELIVERY, Occasion.ANSWER, Occasion.REQUEST, Occasion.CHANGE, Occasion.SAVE), _HITS),
    Occasion.MOMENT: _MOMENTS,
    Occasion.ALWAYS: _WINDOW,
}

SERIAL = (LineProtocol.RTU, LineProtocol.CHARACTERS)
MODBUS = (LineProtocol.RTU, LineProtocol.TCP)
ALL_LINES = (LineProtocol.RTU, LineProtocol.TCP, LineProtocol.CHARACTERS)
OFF = number("for_s", "How long the supply is off.", 1e-6, LONGEST_S, default=1.0)


def checked(kinds: Sequence[FaultKind]) -> dict[str, FaultKind]:
    """The table by name. `Misuse` for a name or parameter given twice, and for a default that is not permitted;
    `IncompleteTable` for a kind without the effect that its occasion needs."""
    table: dict[str, FaultKind] = {}
    for kind in kinds:
        if kind.name in table:
            raise Misuse(f"two kinds of fault are named {kind.name!r}")
        table[kind.name] = kind
        names = [parameter.name for parameter in kind.parameters]
        if len(set(names)) < len(names) or {"kind", "name"} & set(names):
            raise Misuse(f"fault {kind.name}: a parameter is given twice: {', '.join(names)}")
        if bool(kind.lines) == (kind.layer in (Layer.PHYSICS, Layer.ELEMENT)):
            raise Misuse(f"fault {kind.name}: lines belong to all faults but those of physics and elements")
        _check_effect(kind)
        for parameter in kind.parameters:
            where = f"fault {kind.name}, parameter {parameter.name}"
            if (parameter.default is None) == (not parameter.otherwise and not parameter.is_required):
                raise Misuse(f"{where}: a default, what holds otherwise, or required")
            if parameter.default is not None:
                check(parameter, parameter.default, where)
    return table


def _check_effect(kind: FaultKind) -> None:
    layers, effects = _FITTING[kind.occasion]
    if kind.occasion is Occasion.ALWAYS:
        effects = (ElementEffect,) if kind.layer is Layer.ELEMENT else (WindowEffect,)
    fits = isinstance(kind.effect, effects)
    needed = " or ".join(effect.__name__ for effect in effects)
    if kind.layer not in layers:
        raise IncompleteTable(f"fault {kind.name}: nothing of layer {kind.layer} waits for the occasion {kind.occasion}")
    if kind.effect is None:
        raise IncompleteTable(f"fault {kind.name} lacks its effect: {needed}")
    if not fits:
        raise IncompleteTable(f"fault {kind.name} needs the effect {needed}, not {type(kind.effect).__name__}")
    if kind.layer is Layer.FRAMES and kind.effect.answer is None:
        raise IncompleteTable(f"fault {kind.name} lacks what it does to answers")


def check(parameter: Parameter, value: object, where: str) -> FaultValue:
    """``value`` if the parameter takes it. `Misuse` names it, ``where`` and what is permitted."""
    form = parameter.form
    if isinstance(value, int) and abs(value) >= LARGEST_WHOLE:
        raise Misuse(f"{where}: a number of more than 63 bits: permitted are {parameter.permitted}")
    if form is ParameterForm.SPAN:
        return _span(parameter, value, where)
    if form is ParameterForm.NUMBER and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if form is ParameterForm.WHOLE or form is ParameterForm.NUMBER:
        wanted = int if form is ParameterForm.WHOLE else float
        if isinstance(value, wanted) and not isinstance(value, bool) and _is_within(parameter, value):
            return value
    elif isinstance(value, str) and value != "" and (not parameter.words or value in parameter.words):
        return value
    raise Misuse(f"{where} = {value!r}: permitted are {parameter.permitted}")


def _is_within(parameter: Parameter, value: float) -> bool:
    return (parameter.least is None or value >= parameter.least) and (parameter.most is None or value <= parameter.most)


def _span(parameter: Parameter, value: object, where: str) -> tuple[int, int]:
    parts = value if isinstance(value, tuple) else (value, value) if isinstance(value, int) else str(value).split("-")
    ends = [part if isinstance(part, int) else read_whole(part) for part in parts]
    first, last = ends[0], ends[-1]
    if first is None or last is None or len(ends) > 2:
        first, last = 1, 0
    if first > last or not _is_within(parameter, first) or not _is_within(parameter, last):
        raise Misuse(f"{where} = {value!r}: permitted are {parameter.permitted}")
    return first, last
