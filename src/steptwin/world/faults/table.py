"""Every kind of fault, one row each: command line, files, their schema and the reference page are read from it."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from steptwin.errors import Misuse

Value: TypeAlias = int | float | str | tuple[int, int]
"""Of a parameter. A range is (first, last)."""


class Layer(enum.StrEnum):
    BYTES = "bytes"
    FRAMES = "frames"
    PROTOCOL = "protocol"
    PHYSICS = "physics"


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


class Line(enum.StrEnum):
    """What faults but those of physics can happen on."""

    RTU = "Modbus RTU"
    TCP = "Modbus TCP"
    CHARACTERS = "M1486"


class Form(enum.Enum):
    WHOLE = "whole number"
    NUMBER = "number"
    SPAN = "number or span such as 10020-10035"
    WORD = "one of its words"
    TEXT = "text"


@dataclass(frozen=True, slots=True)
class Parameter:
    """``least`` and ``most`` bound numbers; ``words`` are the permitted ones; ``otherwise`` says what holds without a default."""

    name: str
    form: Form
    meaning: str
    least: float | None = None
    most: float | None = None
    words: tuple[str, ...] = ()
    default: Value | None = None
    otherwise: str = ""
    is_required: bool = False

    @property
    def permitted(self) -> str:
        """What it takes, in words."""
        if self.words:
            return ", ".join(self.words)
        bounds = f"{self.least:g}" if self.least is not None else ""
        if self.most is not None:
            bounds += f" to {self.most:g}"
        elif bounds:
            bounds += " and more"
        if self.form is Form.TEXT:
            return "text"
        what = "whole numbers" if self.form is Form.WHOLE else "numbers" if self.form is Form.NUMBER else "numbers or spans N-M"
        return f"{what} {bounds}".rstrip()


@dataclass(frozen=True, slots=True)
class Kind:
    """A row. ``own`` are the parameters of this kind alone, ``lines`` what it can happen on."""

    name: str
    layer: Layer
    occasion: Occasion
    meaning: str
    own: tuple[Parameter, ...] = ()
    lines: tuple[Line, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All it takes: its own, where it happens, when it happens."""
        return (*self.own, *_WHERE[self.layer], *_WHEN[self.occasion])

    def parameter(self, name: str) -> Parameter | None:
        return next((parameter for parameter in self.parameters if parameter.name == name), None)


def _whole(name: str, meaning: str, least: int, most: int | None, **others: object) -> Parameter:
    return Parameter(name, Form.WHOLE, meaning, least, most, **others)  # type: ignore[arg-type]


def _number(name: str, meaning: str, least: float, most: float | None, **others: object) -> Parameter:
    return Parameter(name, Form.NUMBER, meaning, least, most, **others)  # type: ignore[arg-type]


LARGEST_WHOLE = 1 << 63
"""No whole number of a fault is as large."""
_LONGEST_S = 1e9
_LONGEST_MS = 1e9

_WINDOW = (
    _number("from_s", "Not before so many seconds after the fault was set.", 0, _LONGEST_S, default=0.0),
    _number("until_s", "Not later than this.", 0, _LONGEST_S, otherwise="no end"),
)
_COUNT = _whole("count", "It happens at most so often.", 1, None, otherwise="as often as it comes to it")
_CHANCE = _number("probability", "How probable it is each time.", 0, 1, default=1.0)
_HITS = (
    _whole("nth", "Only this time, counted from 1.", 1, None, otherwise="each time"),
    _whole("every", "Each time this number has come round.", 1, None, default=1),
    _CHANCE,
    _COUNT,
    *_WINDOW,
)
_MOMENTS = (
    _number("at_s", "When, in seconds after the fault was set.", 0, _LONGEST_S, default=0.0),
    _number("period_s", "And again and again after so many seconds.", 1e-6, _LONGEST_S, otherwise="once"),
    _CHANCE,
    _COUNT,
    _WINDOW[1],
)
_LINK = Parameter("link", Form.TEXT, "On this link alone, such as tcp-1, rtu-1, pty, serial.", otherwise="all")
_LINE = Parameter("line", Form.TEXT, "On this line of a world alone.", otherwise="all")
_MACHINE = Parameter("machine", Form.TEXT, "Which machine; for a served twin its unit.", otherwise="the only one")
_AXIS = _whole("axis", "Which axis.", 1, 16, default=1)
_PIN = Parameter("pin", Form.TEXT, "Which input.", is_required=True)
_ADDRESSED = (
    _whole("unit", "Requests to this unit.", 0, 255, otherwise="all"),
    _whole("function", "Requests with this function code.", 1, 127, otherwise="all"),
    Parameter("address", Form.SPAN, "Requests that touch these addresses.", 0, 65535, otherwise="all"),
    _LINK,
    _LINE,
)
_WHERE: dict[Layer, tuple[Parameter, ...]] = {
    Layer.BYTES: (
        Parameter("direction", Form.WORD, "Towards the twin, or from it.", words=("in", "out"), default="out"),
        _LINK,
        _LINE,
    ),
    Layer.FRAMES: _ADDRESSED,
    Layer.PROTOCOL: _ADDRESSED,
    Layer.PHYSICS: (_MACHINE,),
}
_WHEN: dict[Occasion, tuple[Parameter, ...]] = {
    **dict.fromkeys((Occasion.BYTE, Occasion.DELIVERY, Occasion.ANSWER, Occasion.REQUEST, Occasion.CHANGE, Occasion.SAVE), _HITS),
    Occasion.MOMENT: _MOMENTS,
    Occasion.ALWAYS: _WINDOW,
}

_SERIAL = (Line.RTU, Line.CHARACTERS)
_MODBUS = (Line.RTU, Line.TCP)
_ALL = (Line.RTU, Line.TCP, Line.CHARACTERS)
_OFF = _number("for_s", "How long the supply is off.", 1e-6, _LONGEST_S, default=1.0)


def _checked(kinds: Sequence[Kind]) -> dict[str, Kind]:
    """The table by name. `Misuse` for a name or parameter given twice, and for a default that is not permitted."""
    table: dict[str, Kind] = {}
    for kind in kinds:
        if kind.name in table:
            raise Misuse(f"two kinds of fault are named {kind.name!r}")
        table[kind.name] = kind
        names = [parameter.name for parameter in kind.parameters]
        if len(set(names)) < len(names) or {"kind", "name"} & set(names):
            raise Misuse(f"fault {kind.name}: a parameter is given twice: {', '.join(names)}")
        if bool(kind.lines) == (kind.layer is Layer.PHYSICS):
            raise Misuse(f"fault {kind.name}: lines belong to all faults but those of physics")
        for parameter in kind.parameters:
            where = f"fault {kind.name}, parameter {parameter.name}"
            if (parameter.default is None) == (not parameter.otherwise and not parameter.is_required):
                raise Misuse(f"{where}: a default, what holds otherwise, or required")
            if parameter.default is not None:
                check(parameter, parameter.default, where)
    return table


def check(parameter: Parameter, value: object, where: str) -> Value:
    """``value`` if the parameter takes it. `Misuse` names it, ``where`` and what is permitted."""
    form = parameter.form
    if isinstance(value, int) and abs(value) >= LARGEST_WHOLE:
        raise Misuse(f"{where}: a number of more than 63 bits: permitted are {parameter.permitted}")
    if form is Form.SPAN:
        return _span(parameter, value, where)
    if form is Form.NUMBER and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    right: bool
    if form is Form.WHOLE or form is Form.NUMBER:
        right = type(value) is (int if form is Form.WHOLE else float) and _is_within(parameter, value)  # type: ignore[arg-type]
    else:
        right = isinstance(value, str) and value != "" and (not parameter.words or value in parameter.words)
    if not right:
        raise Misuse(f"{where} = {value!r}: permitted are {parameter.permitted}")
    return value  # type: ignore[return-value]


def _is_within(parameter: Parameter, value: float) -> bool:
    return (parameter.least is None or value >= parameter.least) and (parameter.most is None or value <= parameter.most)


def _span(parameter: Parameter, value: object, where: str) -> tuple[int, int]:
    parts = value if isinstance(value, tuple) else (value, value) if isinstance(value, int) else str(value).split("-")
    try:
        first, last = (int(part) for part in parts) if len(parts) > 1 else (int(parts[0]), int(parts[0]))
    except ValueError:
        first, last = 1, 0
    if first > last or not _is_within(parameter, first) or not _is_within(parameter, last):
        raise Misuse(f"{where} = {value!r}: permitted are {parameter.permitted}")
    return first, last


KINDS = _checked(
    (
        Kind(
            "flip",
            Layer.BYTES,
            Occasion.BYTE,
            "A bit of a byte arrives turned round.",
            (_whole("bit", "Which bit, 0 is the lowest.", 0, 7, otherwise="any"),),
            _SERIAL,
        ),
        Kind(
            "drop",
            Layer.BYTES,
            Occasion.BYTE,
            "Bytes are lost.",
            (_whole("length", "How many.", 1, 10_000, default=1),),
            _SERIAL,
        ),
        Kind(
            "insert",
            Layer.BYTES,
            Occasion.BYTE,
            "A byte too much comes before a byte.",
            (_whole("value", "Which.", 0, 255, otherwise="any"),),
            _SERIAL,
        ),
        Kind(
            "gap",
            Layer.BYTES,
            Occasion.BYTE,
            "The line is silent before a byte.",
            (_number("for_ms", "How long.", 1e-3, _LONGEST_MS, default=30.0),),
            _ALL,
        ),
        Kind(
            "split",
            Layer.BYTES,
            Occasion.DELIVERY,
            "Bytes come in pieces, as USB adapters deliver them.",
            (
                _whole("length", "Bytes in a piece.", 1, 10_000, default=1),
                _number("for_ms", "How long after each other pieces come.", 1e-3, _LONGEST_MS, default=1.0),
            ),
            _ALL,
        ),
        Kind(
            "noise",
            Layer.BYTES,
            Occasion.DELIVERY,
            "Bytes of no meaning come before what was sent.",
            (_whole("length", "How many.", 1, 10_000, default=8),),
            _SERIAL,
        ),
        Kind(
            "delay",
            Layer.FRAMES,
            Occasion.ANSWER,
            "The answer takes longer; the ones behind it wait.",
            (_number("for_ms", "How much longer.", 1e-3, _LONGEST_MS, default=500.0),),
            _MODBUS,
        ),
        Kind(
            "no-answer",
            Layer.FRAMES,
            Occasion.REQUEST,
            "There is no answer: the request was lost on its way, or was carried out and the answer lost.",
            (Parameter("lost", Form.WORD, "What was lost.", words=("answer", "request"), default="answer"),),
            _MODBUS,
        ),
        Kind("late", Layer.FRAMES, Occasion.ANSWER, "The answer is held back and comes before the next one.", (), _MODBUS),
        Kind(
            "wrong-unit",
            Layer.FRAMES,
            Occasion.ANSWER,
            "The answer carries the address of another unit.",
            (_whole("answers_as", "Which.", 0, 255, otherwise="the next one"),),
            _MODBUS,
        ),
        Kind("crc", Layer.FRAMES, Occasion.ANSWER, "The answer has a wrong CRC.", (), (Line.RTU,)),
        Kind("echo", Layer.FRAMES, Occasion.ANSWER, "The request comes back before its answer.", (), (Line.RTU,)),
        Kind(
            "exception",
            Layer.PROTOCOL,
            Occasion.REQUEST,
            "The request is refused and not carried out.",
            (_whole("code", "The exception code.", 1, 255, default=4),),
            _MODBUS,
        ),
        Kind(
            "busy",
            Layer.PROTOCOL,
            Occasion.REQUEST,
            "The request is refused with exception 6, device busy, and not carried out.",
            (),
            _MODBUS,
        ),
        Kind(
            "stall",
            Layer.PHYSICS,
            Occasion.MOMENT,
            "The shaft is blocked: pulses go on and turn nothing.",
            (_AXIS, _number("for_s", "How long.", 1e-6, _LONGEST_S, default=1.0)),
        ),
        Kind(
            "lost-steps",
            Layer.PHYSICS,
            Occasion.MOMENT,
            "The shaft falls behind the pulses and stays there.",
            (_AXIS, _whole("pulses", "By how many pulses; negative: ahead.", -(10**9), 10**9, default=4)),
        ),
        Kind(
            "slip",
            Layer.PHYSICS,
            Occasion.MOMENT,
            "The encoder slips on the shaft.",
            (_AXIS, _whole("counts", "By how many counts.", -(10**9), 10**9, default=4)),
        ),
        Kind(
            "stuck",
            Layer.PHYSICS,
            Occasion.ALWAYS,
            "An input keeps a level, whatever its switch does.",
            (_PIN, _number("value", "The level; volts on analog inputs.", 0, 10, otherwise="the one it has")),
        ),
        Kind(
            "master-error",
            Layer.PHYSICS,
            Occasion.ALWAYS,
            "A slave of the controller's own Modbus master does not answer: M_STATUS is 3 (MIC488, firmware 1.70).",
        ),
        Kind(
            "bounce",
            Layer.PHYSICS,
            Occasion.CHANGE,
            "A switch bounces: its input changes to and fro before it settles.",
            (
                _PIN,
                _whole("bounces", "How often it goes back.", 1, 1000, default=3),
                _number("for_ms", "How long that takes.", 1e-3, _LONGEST_MS, default=5.0),
            ),
        ),
        Kind(
            "supply-drop",
            Layer.PHYSICS,
            Occasion.MOMENT,
            "The supply fails and comes back: nothing answers, drives and outputs are off, then it is as after power-on.",
            (_OFF,),
        ),
        Kind(
            "power-cut",
            Layer.PHYSICS,
            Occasion.SAVE,
            "The supply fails while memory is being saved: what was not yet written keeps its old content.",
            (_OFF, _whole("written", "Bytes written until then.", 0, None, otherwise="any number")),
        ),
        Kind(
            "wear",
            Layer.PHYSICS,
            Occasion.SAVE,
            "The memory is worn out: with each save one more byte, chosen by chance, keeps what it has for ever.",
            (_whole("writes", "Saves that go well.", 0, None, default=100_000),),
        ),
    )
)


def rows(*layers: Layer) -> Iterator[Kind]:
    """The kinds of these layers, of all without any."""
    return (kind for kind in KINDS.values() if not layers or kind.layer in layers)


def shared() -> list[tuple[Parameter, str]]:
    """What kinds have in common: each parameter, and the layers or occasions that have it."""
    found: dict[Parameter, list[str]] = {}
    for layer, where in _WHERE.items():
        for parameter in where:
            found.setdefault(parameter, []).append(layer.value)
    for occasion, when in _WHEN.items():
        for parameter in when:
            found.setdefault(parameter, []).append(
                f"each {occasion.value}" if occasion is not Occasion.ALWAYS else "stuck, master-error"
            )
    return [(parameter, ", ".join(of)) for parameter, of in found.items()]
