"""Steps as tables of a description: ``steps = [{ press = "start" }, { wait = "1 s" }]``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.simulation.faults import Fault
from steptwin.simulation.faults import parse as parse_fault
from steptwin.simulation.logic.expression import parse_condition
from steptwin.simulation.script.control import Home, Move, Seek
from steptwin.simulation.script.steps import (
    At,
    ClearFault,
    Couple,
    Expect,
    ExpectReached,
    Note,
    Order,
    PowerCycle,
    Press,
    Put,
    Release,
    Remove,
    Repeat,
    Send,
    Set,
    SetFault,
    Step,
    Stop,
    Turn,
    Until,
    UntilOver,
    Wait,
    Write,
)
from steptwin.simulation.toml.reader import Key, Path, TomlText, read_table
from steptwin.simulation.toml.values import axis_number, name_value, number, permitting, pin_name, text_value, time_value, whole


@permitting("condition")
def _condition(value: Any) -> str:
    parse_condition(text_value(value))
    return value


@permitting("{ 'CONTROLLER.NAME' = number, ... }")
def _levels(value: Any) -> tuple[tuple[str, str, float], ...]:
    if not isinstance(value, Mapping) or not value:
        raise Misuse(f"{value!r}: expected {{ 'CONTROLLER.NAME' = NUMBER }}")
    return tuple((*pin_name(name), float(level) if isinstance(level, bool) else number()(level)) for name, level in value.items())


@permitting("{ kind = ... }")
def _fault(value: Any) -> Fault:
    if not isinstance(value, Mapping):
        raise Misuse(f"{value!r}: expected {{ kind = ... }}")
    return parse_fault(value)


@permitting("CONTROLLER.M1 to M4")
def _turned(value: Any) -> tuple[str, int]:
    controller, axis = pin_name(value)
    number = axis_number(axis)
    if not number:
        raise Misuse(f"{value!r}: expected CONTROLLER.M1 to M4")
    return controller, number


@permitting("number other than 0")
def _home_velocity(value: Any) -> float:
    found = number()(value)
    if found == 0.0:
        raise Misuse(f"{value!r}: its sign chooses the switch, so it must not be 0")
    return found


@permitting("sign and input, such as '-B8'")
def _sought(value: Any) -> tuple[int, str]:
    """The direction, 1 or -1, and the input."""
    text = value.strip() if isinstance(value, str) else ""
    if text[:1] not in ("+", "-") or not text[1:].strip():
        raise Misuse(f"{value!r}: expected a direction and an input, such as '-B8'")
    return (1 if text[0] == "+" else -1), text[1:].strip().upper()


@permitting("text")
def _characters(value: Any) -> bytes:
    if not isinstance(value, str) or not value:
        raise Misuse(f"{value!r}: expected characters")
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError as error:
        raise Misuse(f"{value!r}: {value[error.start]!r} is not an 8-bit character") from None


def _turn(axis: tuple[str, int], counts: int) -> Turn:
    return Turn(*axis, counts)


def _motion(command: Move | Home | Seek, within: Nanos | None) -> Repeat:
    """The motion that is commanded, to its end: a status from before does not count."""
    axis = command.controller, command.axis
    reached = ExpectReached(*axis, command if isinstance(command, Seek) else None)
    return Repeat(1, (Order(command), UntilOver(*axis, within), reached), is_one=True)


def _move(axis: tuple[str, int], to: float | None, by: float | None, within: Nanos | None) -> Repeat:
    return _motion(Move(*axis, to, by), within)


def _home(axis: tuple[str, int], velocity: float | None, seek: tuple[int, str] | None, within: Nanos | None) -> Repeat:
    if velocity is not None and seek is None:
        return _motion(Home(*axis, velocity), within)
    if seek is not None and velocity is None:
        return _motion(Seek(*axis, *seek), within)
    raise Misuse("home: give either velocity (its sign chooses the switch of a MIC488) or seek (the input of an M1486)")


def _wait_for(axis: tuple[str, int], within: Nanos | None) -> Repeat:
    return Repeat(1, (UntilOver(*axis, within), ExpectReached(*axis)), is_one=True)


def _couple(axis: tuple[str, int], coupling: str) -> Couple:
    return Couple(*axis, coupling)


@dataclass(frozen=True, slots=True)
class StepKind:
    """A kind of step: its first key selects it; ``make`` takes the values of all keys in order."""

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
        _action(Key("set", _levels, "{ 'CONTROLLER.PIN' = LEVEL }"), Set),
        _action(
            Key("press", name_value, "a button"),
            Press,
            Key("for", time_value, "how long", None, "duration"),
        ),
        _action(Key("release", name_value, "a button"), Release),
        _action(
            Key("put", name_value, "a conveyor or a nest: one of its workpieces", attribute="on"),
            Put,
            Key("front", number(0.0), "of a conveyor: mm of its front from the beginning", None),
        ),
        _action(Key("remove", text_value, "a workpiece, such as infeed.3"), Remove),
        _action(Key("write", _levels, "{ 'CONTROLLER.REGISTER' = VALUE }"), Write),
        _action(
            Key("move", _turned, "CONTROLLER.M1 to M4: moves it, waits for the end and expects it at its target"),
            _move,
            Key("to", number(), "a position, in the unit of the controller", None),
            Key("by", number(), "a distance, in the unit of the controller", None),
            _WITHIN,
        ),
        _action(
            Key("home", _turned, "CONTROLLER.M1 to M4: homes it, waits for the end and expects it there"),
            _home,
            Key("velocity", _home_velocity, "of a MIC488; its sign chooses the switch", None),
            Key("seek", _sought, "of an M1486: direction and input, such as '-B8'; it is then at 0", None),
            _WITHIN,
        ),
        _action(
            Key("wait_for", _turned, "CONTROLLER.M1 to M4: waits for its motion to end at the target"),
            _wait_for,
            _WITHIN,
        ),
        _action(
            Key("send", name_value, "a line that carries characters"),
            Send,
            Key("text", _characters, "characters; \\r ends a command line", attribute="data"),
        ),
        _action(Key("power_cycle", name_value, "a controller"), PowerCycle),
        _action(
            Key("turn", _turned, "CONTROLLER.M1 to M4"),
            _turn,
            Key("counts", whole(-(2**31), 2**31 - 1), "encoder counts"),
        ),
        _action(
            Key("couple", _turned, "CONTROLLER.M1 to M4 without mechanics"),
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
"""The kinds of steps by their first key, except ``repeat``, which contains steps."""

REPEAT = Key("repeat", whole(1, 10**9), "how often")


@permitting("list of steps")
def _list(value: Any) -> Any:
    return value


STEPS = Key("steps", _list, "a list of steps, such as [{ press = 'start' }, { wait = '1 s' }]")
"""The key ``steps`` of events, scripts and ``repeat``; `read_steps` reads its value."""


_UNREAD = Note("")
"""Placeholder for a step with an error, so that later steps keep their numbers; such a script never runs."""


def read_step(text: TomlText, path: Path, table: object) -> Step | None:
    """The step of one table; None if it has errors, which are added to ``text``."""
    return _step(text, path, "the step", table)


def read_steps(text: TomlText, path: Path, value: object) -> tuple[Step, ...]:
    """Steps from a list of tables; errors are added to ``text``."""
    if not isinstance(value, list):
        text.wrong(path, "D002", f"{path[-1]} is {value!r}", "expected a list of steps, such as [{ wait = '1 s' }]")
        return ()
    steps: list[Step] = []
    for n, table in enumerate(value):
        step = _step(text, (*path, n), f"step {n + 1}", table)
        steps.append(_UNREAD if step is None else step)
    return tuple(steps)


def _step(text: TomlText, path: Path, called: str, table: object) -> Step | None:
    if not isinstance(table, Mapping):
        text.wrong(path, "D002", f"{called} is {table!r}", "expected a table, such as { wait = '1 s' }")
        return None
    if "repeat" in table:
        values = read_table(text, path, table, (REPEAT,), (STEPS.name,))
        return Repeat(values.get("repeat", 1), read_steps(text, (*path, STEPS.name), table.get(STEPS.name, [])))
    kinds = [key for key in table if key in ACTIONS]
    if len(kinds) != 1:
        unknown = [key for key in table if key not in ACTIONS]
        near = "".join(text.near(key, ACTIONS) for key in unknown)
        fixes = [fix for key in unknown if not kinds and (fix := text.key_replacement((*path, key), key, ACTIONS)) is not None]
        found = f"has {' and '.join(kinds)}" if kinds else f"has {', '.join(map(repr, table)) or 'nothing'}"
        text.wrong(
            path, "D008", f"{called} {found}{near}", f"expected one of {', '.join(ACTIONS)}, repeat", next(iter(fixes), None)
        )
        return None
    action = ACTIONS[kinds[0]]
    before = len(text.findings)
    values = read_table(text, path, table, (action.main, *action.others))
    if len(text.findings) > before:
        return None
    try:
        return action.make(*(values[key.attribute or key.name] for key in (action.main, *action.others)))
    except Misuse as error:
        text.wrong(path, "D007", f"{called}: {error}")
    return None
