"""What operators do: steps, one after another. A script is a generator of steps, which are plain values. Their times are whole
nanoseconds: ``Wait(SECOND // 2)``, or ``Wait(duration("500 ms"))`` with `steptwin.durations`.

A generator is sent what a step gives: for `Read` a number, for `Request` the answer (bytes), for `Until` whether the condition
came true in time. It touches nothing by itself, so that it can be restored by sending it the same again. Steps that are known
beforehand are a `Walk`, whose state is its place among them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias, cast

from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.world.expression import parse
from steptwin.world.faults import Fault
from steptwin.world.faults import parse as parse_fault
from steptwin.world.reader import Key, Path, TomlText, read_table
from steptwin.world.values import name_value, number, pin_name, text_value, time_value, whole

COUPLINGS = ("drive", "free", "blocked")
"""What can turn the encoder shaft of an axis."""


def _check_ns(value: object) -> None:
    """`Misuse` unless a time of a step is whole nanoseconds; the rest of the interface takes seconds."""
    if value is not None and (not isinstance(value, int) or isinstance(value, bool) or value < 0):
        raise Misuse(f"{value!r}: steps take whole nanoseconds, such as SECOND // 2, or duration('500 ms')")


@dataclass(frozen=True, slots=True)
class Wait:
    """Nothing for so long."""

    duration: Nanos

    def __post_init__(self) -> None:
        _check_ns(self.duration)


@dataclass(frozen=True, slots=True)
class At:
    """Nothing until that moment; nothing at all when it has passed."""

    time: Nanos

    def __post_init__(self) -> None:
        _check_ns(self.time)


@dataclass(frozen=True, slots=True)
class Until:
    """Nothing until a condition is true, at most for ``within``. Gives whether it is."""

    condition: str
    within: Nanos | None = None

    def __post_init__(self) -> None:
        _check_ns(self.within)


@dataclass(frozen=True, slots=True)
class Set:
    """Inputs take levels: 0, 1, volts."""

    levels: tuple[tuple[str, str, float], ...]


@dataclass(frozen=True, slots=True)
class Press:
    """Press a button, for ``duration`` or until it is released; who presses or releases it meanwhile goes before that."""

    button: str
    duration: Nanos | None = None

    def __post_init__(self) -> None:
        _check_ns(self.duration)


@dataclass(frozen=True, slots=True)
class Release:
    button: str


@dataclass(frozen=True, slots=True)
class Write:
    """Registers of a MIC488 by name take values, in configured units, as a master writes them."""

    values: tuple[tuple[str, str, float], ...]


@dataclass(frozen=True, slots=True)
class Send:
    """Bytes go to a line."""

    line: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Request:
    """A Modbus request on a line. Gives the PDU of the answer; nothing (b"") when none comes in time."""

    line: str
    unit: int
    pdu: bytes
    within: Nanos

    def __post_init__(self) -> None:
        _check_ns(self.within)


@dataclass(frozen=True, slots=True)
class PowerCycle:
    machine: str


@dataclass(frozen=True, slots=True)
class Turn:
    """Turn the encoder shaft of an axis of a MIC488 by counts."""

    machine: str
    axis: int
    counts: int


@dataclass(frozen=True, slots=True)
class Couple:
    """What turns the encoder shaft of an axis of a MIC488 without mechanics: the drive, nothing, or a blocked drive."""

    machine: str
    axis: int
    coupling: str

    def __post_init__(self) -> None:
        if self.coupling not in COUPLINGS:
            raise Misuse(f"{self.coupling!r}: an encoder shaft is turned by {', '.join(COUPLINGS)}")


@dataclass(frozen=True, slots=True)
class SetFault:
    fault: Fault


@dataclass(frozen=True, slots=True)
class ClearFault:
    name: str


@dataclass(frozen=True, slots=True)
class Expect:
    """Report a condition that does not hold; the run has failed then."""

    condition: str


@dataclass(frozen=True, slots=True)
class Note:
    """A text for the trace."""

    text: str


@dataclass(frozen=True, slots=True)
class Stop:
    """The run ends when all scripts have done what they do at this moment. The next step is due a nanosecond later."""

    reason: str


@dataclass(frozen=True, slots=True)
class Read:
    """Gives the value of a signal."""

    signal: str


@dataclass(frozen=True, slots=True)
class Call:
    """Call Python code, which may do anything with the world."""

    function: Callable[[], object]


@dataclass(frozen=True, slots=True)
class Repeat:
    times: int
    steps: tuple[Step, ...]


Step: TypeAlias = (
    Wait
    | At
    | Until
    | Set
    | Press
    | Release
    | Write
    | Send
    | Request
    | PowerCycle
    | Turn
    | Couple
    | SetFault
    | ClearFault
    | Expect
    | Note
    | Stop
    | Read
    | Call
    | Repeat
)
Steps: TypeAlias = Generator[Step, Any, None]
"""What an operator in Python is: steps as they come, which may depend on what steps before have given."""


@dataclass(frozen=True, slots=True)
class _Turn:
    """The first step of a `Walk` whose turns begin ``period`` after each other."""

    begin: Nanos
    period: Nanos


class Walk:
    """Steps in order, ``times`` times; None: without end. It is used like a generator, and `place` is all of its state."""

    __slots__ = ("_levels", "_steps", "_times")

    def __init__(self, steps: Iterable[Step | _Turn], times: int | None = 1) -> None:
        self._steps = _without_empty(steps)
        self._times = times
        self._levels = [(self._steps, 0, 0)] if self._steps and times != 0 else []
        """Of the whole and each `Repeat` that has begun, outermost first: steps, the next of them, how many turns are done."""

    @property
    def place(self) -> tuple[tuple[int, int], ...]:
        """For the whole and each `Repeat` that has begun, outermost first: which step is next, and how many turns are done."""
        return tuple((index, done) for _, index, done in self._levels)

    @place.setter
    def place(self, place: tuple[tuple[int, int], ...]) -> None:
        self._levels = []
        for index, done in place:
            steps = self._steps if not self._levels else self._repeat().steps
            self._levels.append((steps, index, done))

    def _repeat(self) -> Repeat:
        """The `Repeat` that the innermost level has begun."""
        steps, index, _ = self._levels[-1]
        return cast(Repeat, steps[index - 1])

    def __iter__(self) -> Walk:
        return self

    def __next__(self) -> Step:
        return self.send(None)

    def send(self, value: object) -> Step:
        """The next step; what the step before has given is ignored. Raises `StopIteration` after the last."""
        while self._levels:
            steps, index, done = self._levels.pop()
            if index == len(steps):
                times = self._repeat().times if self._levels else self._times
                if times is None or done + 1 < times:
                    self._levels.append((steps, 0, done + 1))
                continue
            self._levels.append((steps, index + 1, done))
            step = steps[index]
            if isinstance(step, Repeat):
                self._levels.append((step.steps, 0, 0))
            elif isinstance(step, _Turn):
                return At(step.begin + step.period * (done + 1))
            else:
                return step
        raise StopIteration

    def close(self) -> None:
        self._levels = []


def _without_empty(steps: Iterable[Step | _Turn]) -> tuple[Step | _Turn, ...]:
    """Steps without repetitions of nothing, through which one could go for ever."""
    kept: list[Step | _Turn] = []
    for step in steps:
        if not isinstance(step, Repeat):
            kept.append(step)
        elif step.times > 0 and (inner := _without_empty(step.steps)):
            kept.append(Repeat(step.times, cast("tuple[Step, ...]", inner)))
    return tuple(kept)


def run_through(steps: Iterable[Step], times: int = 1) -> Walk:
    """The steps in order, ``times`` times."""
    return Walk(steps, times)


def run_every(steps: tuple[Step, ...], period: Nanos, begin: Nanos) -> Walk:
    """The steps at ``begin`` + ``period``, and again after each period."""
    return Walk((_Turn(begin, period), *steps), None)


def run_when(steps: tuple[Step, ...], condition: str, *, once: bool) -> Walk:
    """The steps whenever the condition comes true."""
    if once:
        return Walk((Until(condition), *steps))
    return Walk((Until(condition), *steps, Until(f"not ({condition})")), None)


# ---------------------------------------------------------------------- steps in TOML


def _condition(value: Any) -> str:
    parse(text_value(value))
    return value


def _levels(value: Any) -> tuple[tuple[str, str, float], ...]:
    if not isinstance(value, Mapping) or not value:
        raise Misuse(f"{value!r}: expected {{ 'MACHINE.NAME' = NUMBER }}")
    return tuple((*pin_name(name), float(level) if isinstance(level, bool) else number()(level)) for name, level in value.items())


def _fault(value: Any) -> Fault:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected {{ kind = ... }}")
    return parse_fault(value)


def _turned(value: Any) -> tuple[str, int]:
    machine, axis = pin_name(value)
    if not axis.startswith("M") or not axis[1:].isdecimal():
        raise Misuse(f"{value!r}: expected MACHINE.M1 to M4")
    return machine, int(axis[1:])


def _characters(value: Any) -> bytes:
    if not isinstance(value, str) or not value:
        raise Misuse(f"{value!r}: expected characters")
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise Misuse(f"{value!r}: {value[error.start]!r} is not a character of a line, which has 8 bits for each") from None


def _turn(axis: tuple[str, int], counts: int) -> Turn:
    return Turn(*axis, counts)


def _couple(axis: tuple[str, int], coupling: str) -> Couple:
    return Couple(*axis, coupling)


@dataclass(frozen=True, slots=True)
class StepKind:
    """A kind of step: its first key selects it; ``make`` takes the values of all keys in their order."""

    main: Key
    others: tuple[Key, ...]
    make: Callable[..., Step]


def _action(main: Key, make: Callable[..., Step], *others: Key) -> tuple[str, StepKind]:
    return main.name, StepKind(main, others, make)


_WITHIN = Key("within", time_value, "for at most this time", None)

ACTIONS: Mapping[str, StepKind] = dict(
    (
        _action(Key("wait", time_value, "a time such as '1 s'"), Wait),
        _action(Key("at", time_value, "a moment such as '10 s'"), At),
        _action(Key("until", _condition, "a condition"), Until, _WITHIN),
        _action(Key("set", _levels, "{ 'MACHINE.PIN' = LEVEL }"), Set),
        _action(
            Key("press", name_value, "a button"),
            Press,
            Key("for", time_value, "how long", None, "duration"),
        ),
        _action(Key("release", name_value, "a button"), Release),
        _action(Key("write", _levels, "{ 'MACHINE.REGISTER' = VALUE }"), Write),
        _action(
            Key("send", name_value, "a line of M1486 chips"),
            Send,
            Key("text", _characters, "characters; \\r ends a command line", attribute="data"),
        ),
        _action(Key("power_cycle", name_value, "a machine"), PowerCycle),
        _action(
            Key("turn", _turned, "MACHINE.M1 to M4"),
            _turn,
            Key("counts", whole(-(2**31), 2**31 - 1), "encoder counts"),
        ),
        _action(
            Key("couple", _turned, "MACHINE.M1 to M4 without mechanics"),
            _couple,
            Key("to", text_value, "what turns the encoder shaft: drive, free or blocked"),
        ),
        _action(Key("fault", _fault, "{ kind = ... } as in [[fault]]"), SetFault),
        _action(Key("clear_fault", text_value, "the name of a fault"), ClearFault),
        _action(Key("expect", _condition, "a condition that must hold"), Expect),
        _action(Key("note", text_value, "a text for the trace"), Note),
        _action(Key("stop", text_value, "why the run ends"), Stop),
    )
)
"""What steps can be, by their first key. ``repeat`` has steps of its own and stands beside it."""

REPEAT = Key("repeat", whole(1, 10**9), "how often")


def _list(value: Any) -> Any:
    return value


STEPS = Key("steps", _list, "a list of steps, such as [{ press = 'start' }, { wait = '1 s' }]")
"""Of events, scripts and ``repeat``; `read_steps` reads it."""


_UNREAD = Note("")
"""In the place of a step that is wrong, so that those after it keep theirs; such a script never runs."""


def read_steps(text: TomlText, path: Path, value: object) -> tuple[Step, ...]:
    """Steps from a list of tables; errors are added to ``text``."""
    if not isinstance(value, list):
        text.wrong(path, "D002", f"{path[-1]} is {value!r}", "expected a list of steps, such as [{ wait = '1 s' }]")
        return ()
    steps: list[Step] = []
    for n, table in enumerate(value):
        step = _step(text, (*path, n), n + 1, table)
        steps.append(_UNREAD if step is None else step)
    return tuple(steps)


def _step(text: TomlText, path: Path, n: int, table: object) -> Step | None:
    if not isinstance(table, Mapping):
        text.wrong(path, "D002", f"step {n} is {table!r}", "expected a table, such as { wait = '1 s' }")
        return None
    if "repeat" in table:
        values = read_table(text, path, table, (REPEAT,), (STEPS.name,))
        return Repeat(values.get("repeat", 1), read_steps(text, (*path, STEPS.name), table.get(STEPS.name, [])))
    kinds = [key for key in table if key in ACTIONS]
    if len(kinds) != 1:
        near = "".join(text.near(key, ACTIONS) for key in table if key not in ACTIONS)
        found = f"has {' and '.join(kinds)}" if kinds else f"has {', '.join(map(repr, table)) or 'nothing'}"
        text.wrong(path, "D008", f"step {n} {found}{near}", f"expected one of {', '.join(ACTIONS)}, repeat")
        return None
    action = ACTIONS[kinds[0]]
    before = len(text.findings)
    values = read_table(text, path, table, (action.main, *action.others))
    if len(text.findings) > before:
        return None
    return action.make(*(values[key.attribute or key.name] for key in (action.main, *action.others)))
