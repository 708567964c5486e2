"""Kinds of faults, with their parameters, occasions and places; and a fault as a value."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypedDict, Unpack

from steptwin.errors import Misuse
from steptwin.messages import Message, MessageText, with_messages
from steptwin.numerals import read_whole

FaultValue: TypeAlias = int | float | str | tuple[int, int]
"""Value of a parameter. A range is (first, last)."""


class Layer(enum.StrEnum):
    BYTES = "bytes"
    FRAMES = "frames"
    PROTOCOL = "protocol"
    PHYSICS = "physics"
    ELEMENT = "element"
    """Elements around controllers, which bring their own faults."""


class Occasion(enum.StrEnum):
    """Occasion for which a fault waits: what ``nth`` and ``every`` count and ``probability`` is of."""

    BYTE = "byte"
    DELIVERY = "delivery"
    """Bytes that are handed over at once: an answer, or what one read of a link brought."""
    ANSWER = "answer"
    REQUEST = "request"
    MOMENT = "moment"
    """At ``at_s``, and every ``period_s`` from then on."""
    CHANGE = "change"
    """Change of the pin."""
    SAVE = "save"
    """Save of a memory that survives power-off."""
    ALWAYS = "always"
    """From ``from_s`` to ``until_s``."""


class Need(enum.Enum):
    """Ability that some controllers have and others have not."""

    ENCODER = "encoder"
    MODBUS_MASTER = "Modbus master of its own"


class LineProtocol(enum.StrEnum):
    """Protocols on which faults but those of physics can happen."""

    RTU = "Modbus RTU"
    TCP = "Modbus TCP"
    CHARACTERS = "M1486"


class ParameterForm(enum.Enum):
    WHOLE = "whole number"
    NUMBER = "number"
    SPAN = "number or span such as 10020-10035"
    WORD = "one of its words"
    TEXT = "text"


_PERMITTED = {
    ParameterForm.WHOLE: Message("simulation.whole-numbers", "whole numbers"),
    ParameterForm.NUMBER: Message("simulation.numbers", "numbers"),
    ParameterForm.SPAN: Message("simulation.numbers-or-spans", "numbers or spans N-M"),
    ParameterForm.TEXT: Message("simulation.text", "text"),
}
TO = Message("simulation.to", "{what} {least} to {most}")
AND_MORE = Message("simulation.and-above", "{what} {least} and more")


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
    def permitted(self) -> MessageText:
        """Permitted values, in words."""
        if self.words:
            return MessageText(", ".join(self.words))
        what = _PERMITTED[self.form]()
        if self.least is None:
            return what
        least = _format(self.least)
        return AND_MORE(what=what, least=least) if self.most is None else TO(what=what, least=least, most=_format(self.most))

    def to_json(self) -> dict[str, object]:
        """As JSON. ``default`` is the text of the value that holds without one, or names its source."""
        return with_messages(
            {
                "name": self.name,
                "meaning": self.meaning,
                "permitted": self.permitted,
                "default": self.otherwise if self.default is None else f"{self.default}",
                "words": list(self.words),
                "required": self.is_required,
            }
        )


def _format(number: float) -> str:
    """Without an exponent: 0.000001, 65535, 1 000 000 000."""
    if abs(number) >= 1e6:
        return f"{number:,.0f}".replace(",", " ")
    return f"{number:.6f}".rstrip("0").rstrip(".")


class FaultCategory(enum.StrEnum):
    """Kind of part that has a fault."""

    SENSOR = "sensor"
    ACTUATOR = "actuator"
    LOGIC = "logic"
    LINE = "line"
    POWER = "power"
    MEMORY = "memory"


@dataclass(frozen=True, slots=True)
class FaultKind:
    """A row. ``own`` are the parameters of this kind alone, ``lines`` what it can happen on. ``needs``: what a
    controller must have beyond what parameters and occasion need. ``check`` takes the `FaultyController`, or what was built of
    the element, and raises `Misuse` where it cannot happen."""

    name: str
    layer: Layer
    occasion: Occasion
    meaning: str
    own: tuple[Parameter, ...] = ()
    lines: tuple[LineProtocol, ...] = ()
    effect: Any = None
    """Its effect: one of those that fit the occasion. A kind without it is refused when the table is built."""
    needs: Need | None = None
    check: Callable[[Any, Fault], None] | None = None
    faulty: FaultCategory | None = None
    """Category of what is faulty; without it the line, or an actuator for faults of physics and elements."""
    tried: tuple[Mapping[str, FaultValue], ...] | Callable[[Any, int], tuple[Mapping[str, FaultValue], ...]] = field(
        default=({},), hash=False
    )
    """Parameters with which campaigns try it; a function takes the `FaultyController` and the axis."""

    @property
    def part(self) -> FaultCategory:
        if self.faulty is not None:
            return self.faulty
        return FaultCategory.ACTUATOR if self.layer in (Layer.PHYSICS, Layer.ELEMENT) else FaultCategory.LINE

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All it takes: its own, where it happens, when it happens."""
        return (*self.own, *WHERE[self.layer], *WHEN[self.occasion])

    def to_json(self) -> dict[str, object]:
        """As JSON."""
        return {
            "name": self.name,
            "layer": self.layer.value,
            "occasion": self.occasion.value,
            "meaning": self.meaning,
            "lines": [line.value for line in self.lines],
            "parameters": [parameter.to_json() for parameter in self.parameters],
        }

    def parameter(self, name: str) -> Parameter | None:
        return next((parameter for parameter in self.parameters if parameter.name == name), None)


NO_NUMBER_OF_A_FAULT = Message("simulation.no-number-of-a-fault", "fault {name}: {key} = {value} is not a number")


@dataclass(frozen=True, slots=True)
class Fault:
    """``given`` are the parameters that were given; ``name`` distinguishes it from others of its kind; empty: none."""

    kind: FaultKind
    given: Mapping[str, FaultValue]
    name: str = ""

    def get(self, name: str) -> FaultValue | None:
        """A parameter, else its default, else None."""
        value = self.given.get(name)
        if value is None:
            parameter = self.kind.parameter(name)
            return None if parameter is None else parameter.default
        return value

    def number(self, name: str) -> float:
        """A parameter that is a number and has a default or was given. `Misuse` if it is none."""
        value = self.get(name)
        if isinstance(value, int | float):
            return value
        raise Misuse(NO_NUMBER_OF_A_FAULT(name=self.kind.name, key=name, value=repr(value)))

    def whole(self, name: str) -> int | None:
        value = self.get(name)
        return value if isinstance(value, int) else None

    @property
    def refuses(self) -> bool:
        """Whether the requests it happens to are not carried out."""
        effect = self.kind.effect
        return self.kind.occasion is Occasion.REQUEST and (effect.is_refused is None or effect.is_refused(self))

    def __str__(self) -> str:
        """The line that `read` makes this of."""
        name = {"name": self.name} if self.name else {}
        parts = [self.kind.name, *(f"{key}={value_text(value)}" for key, value in (name | dict(self.given)).items())]
        return " ".join(parts)


def value_text(value: FaultValue) -> str:
    if isinstance(value, tuple):
        return str(value[0]) if value[0] == value[1] else f"{value[0]}-{value[1]}"
    return (
        repr(value)
        if isinstance(value, float) and value != int(value)
        else f"{value:.0f}"
        if isinstance(value, float)
        else f"{value}"
    )


class ParameterOptions(TypedDict, total=False):
    """Options of a parameter that is a number, besides its range; see `Parameter`."""

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
_CONTROLLER = Parameter("machine", ParameterForm.TEXT, "Which controller; for a served twin its unit.", otherwise="the only one")
AXIS = whole("axis", "Which axis.", 1, 16, default=1)
PIN = Parameter("pin", ParameterForm.TEXT, "Which input or output.", is_required=True)
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
    Layer.PHYSICS: (_CONTROLLER,),
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
NUMBER_HAS_TOO_MANY_BITS = Message(
    "simulation.number-has-too-many-bits", "{where}: a number of more than 63 bits: permitted are {permitted}"
)
VALUE_OF_A_FAULT = Message("simulation.value-of-a-fault", "{where} = {value}: permitted are {permitted}")


def check(parameter: Parameter, value: object, where: str) -> FaultValue:
    """``value`` if the parameter takes it. `Misuse` names it, ``where`` and what is permitted."""
    form = parameter.form
    if isinstance(value, int) and abs(value) >= LARGEST_WHOLE:
        raise Misuse(NUMBER_HAS_TOO_MANY_BITS(where=where, permitted=parameter.permitted))
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
    raise Misuse(VALUE_OF_A_FAULT(where=where, value=repr(value), permitted=parameter.permitted))


def _is_within(parameter: Parameter, value: float) -> bool:
    return (parameter.least is None or value >= parameter.least) and (parameter.most is None or value <= parameter.most)


def _span(parameter: Parameter, value: object, where: str) -> tuple[int, int]:
    parts = value if isinstance(value, tuple) else (value, value) if isinstance(value, int) else str(value).split("-")
    ends = [part if isinstance(part, int) else read_whole(part) for part in parts]
    first, last = ends[0], ends[-1]
    if first is None or last is None or len(ends) > 2:
        first, last = 1, 0
    if first > last or not _is_within(parameter, first) or not _is_within(parameter, last):
        raise Misuse(VALUE_OF_A_FAULT(where=where, value=repr(value), permitted=parameter.permitted))
    return first, last
