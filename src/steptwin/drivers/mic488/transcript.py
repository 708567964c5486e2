"""Requests to a controller as lines of text, for the terminal, and transcripts with its answers, for comparing devices.

| line | does |
|---|---|
| ``get NAME...`` | reads registers at one moment |
| ``set NAME=VALUE`` | writes a register: a number, ON, OFF or the name of a value |
| ``sleep SECONDS`` | waits |
| ``wait AXIS...`` | waits until axes are at rest, and records why they stopped |
| ``raw HEX`` | sends a PDU (function and data) |

``#`` begins a comment. A refusal by the controller is a result; the next line follows.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

from steptwin.drivers import Mic488
from steptwin.drivers.mic488.failures import Mic488Refusal
from steptwin.errors import Misuse, Refusal
from steptwin.mic488.registermap import DataType, RegisterMap
from steptwin.mic488.registers import register_map
from steptwin.mic488.values import encoded, named, plan, value_of
from steptwin.numerals import read_number
from steptwin.wire import pdu

FORM = "expected get NAME..., set NAME=VALUE, sleep SECONDS, wait AXIS... or raw HEX"
FORMAT = "steptwin session 1"


@dataclass(frozen=True, slots=True)
class TranscriptStep:
    """An executed line, the time ``at_s`` since the first line, and its results."""

    line: str
    at_s: float
    result: dict[str, Any] = field(default_factory=dict)


Action = Callable[[Mic488], dict[str, Any]]
"""Executes a step and returns its results."""


def steps_of(text: str, registers: RegisterMap) -> list[tuple[str, Action]]:
    """The lines of a text for a controller with these registers. Raises `Misuse` for the first invalid line."""
    steps = []
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.partition("#")[0].strip()
        if line:
            try:
                steps.append((line, action_of(line, registers)))
            except Misuse as error:
                raise Misuse(f"line {number}: {error}") from None
    if not steps:
        raise Misuse(f"unknown step: {FORM}")
    return steps


def carry_out(mic: Mic488, steps: Iterable[tuple[str, Action]]) -> Iterator[TranscriptStep]:
    """Execute all steps in order. Raises `Refusal` for a step that is not possible after those before it, and `LineFailure`."""
    begin = time.monotonic()
    for line, action in steps:
        try:
            yield TranscriptStep(line, time.monotonic() - begin, _result(mic, action))
        except Misuse as error:
            raise Refusal(f"{line!r}: {error}") from error


def carry_out_one(mic: Mic488, line: str) -> dict[str, Any]:
    """Execute one step. Raises `Misuse` for an invalid one, and `LineFailure`."""
    return _result(mic, action_of(line, register_map(mic.firmware)))


def _result(mic: Mic488, action: Action) -> dict[str, Any]:
    try:
        return action(mic)
    except Mic488Refusal as refusal:
        return {"refused": refusal.what}
    except Refusal as refusal:
        return {"refused": str(refusal)}


def action_of(line: str, registers: RegisterMap) -> Action:
    """The action of a line. Raises `Misuse` for an invalid line, before anything is sent."""
    word, *rest = line.split()
    step = _STEPS.get(word)
    if step is None:
        raise Misuse(f"{line!r}: {FORM}")
    try:
        return step(rest, registers)
    except Misuse as error:
        raise Misuse(f"{line!r}: {error}") from None


def _get(names: list[str], registers: RegisterMap) -> Action:
    if not names:
        raise Misuse("the name of a register is missing")
    plan(registers, [named(registers, name) for name in names])
    return lambda mic: mic.get(*names)


def _set(rest: list[str], registers: RegisterMap) -> Action:
    name, equals, typed = "".join(rest).partition("=")
    if not equals:
        raise Misuse("expected set NAME=VALUE")
    item = named(registers, name)
    value = value_of(item.register, typed)
    encoded(item, value, DataType.REAL)

    def write(mic: Mic488) -> dict[str, Any]:
        mic.set(name, value)
        return {}

    return write


def _sleep(rest: list[str], registers: RegisterMap) -> Action:
    try:
        (text,) = rest
        seconds = read_number(text)
        if not 0.0 <= seconds <= 3600.0:
            raise ValueError
    except ValueError:
        raise Misuse("expected seconds from 0 to 3600") from None

    def sleep(mic: Mic488) -> dict[str, Any]:
        time.sleep(seconds)
        return {}

    return sleep


def _wait(rest: list[str], registers: RegisterMap) -> Action:
    numbers = [text.upper().removeprefix("M") for text in rest]
    if not all(number in ("1", "2", "3", "4") for number in numbers):
        raise Misuse("expected axes, 1 to 4 or M1 to M4")
    axes = [int(number) for number in numbers]

    def wait(mic: Mic488) -> dict[str, Any]:
        ends = mic.wait(*axes, check=False)
        return {f"M{axis}": {"reason": end.reason.value, "position": end.position_u} for axis, end in ends.items()}

    return wait


def _raw(rest: list[str], registers: RegisterMap) -> Action:
    try:
        request = pdu.decode_request(bytes.fromhex("".join(rest)))
    except ValueError:
        raise Misuse("expected hexadecimal digits") from None
    except pdu.ModbusException as exception:
        raise Misuse(exception.detail or str(exception)) from None
    return lambda mic: {"answer": pdu.encode_response(mic.request(request)).hex(" ")}


_STEPS: dict[str, Callable[[list[str], RegisterMap], Action]] = {
    "get": _get,
    "set": _set,
    "sleep": _sleep,
    "wait": _wait,
    "raw": _raw,
}


# ---------------------------------------------------------------------- transcripts


def to_text(steps: Iterable[TranscriptStep], about: dict[str, Any]) -> Iterator[str]:
    """The transcript as text: a header, then a line of JSON for each step."""
    yield json.dumps({"format": FORMAT, **about}, ensure_ascii=False)
    for step in steps:
        yield json.dumps({"line": step.line, "at_s": round(step.at_s, 4), "result": step.result}, ensure_ascii=False)


def from_text(text: str, name: str) -> list[TranscriptStep]:
    """The steps of a transcript. Raises `Misuse` for text that is not one."""
    head, *lines = text.splitlines() or [""]
    try:
        if json.loads(head)["format"] != FORMAT:
            raise ValueError
        return [TranscriptStep(str(data["line"]), float(data["at_s"]), dict(data["result"])) for data in map(json.loads, lines)]
    except (ValueError, KeyError, TypeError, RecursionError):
        raise Misuse(f"{name} is not a transcript ('steptwin record' makes them)") from None


@dataclass(frozen=True, slots=True)
class TranscriptDifference:
    """A difference between two transcripts of the same requests. ``step`` counts from 1."""

    step: int
    line: str
    what: str
    one: Any
    two: Any

    def __str__(self) -> str:
        return f"step {self.step}, {self.line}: {self.what}: {_said(self.one)} | {_said(self.two)}"


def _said(value: Any) -> str:
    return "nothing" if value is None else json.dumps(value, ensure_ascii=False)


def differences(
    one: list[TranscriptStep], two: list[TranscriptStep], *, tolerance: float = 0.0, time_s: float | None = None
) -> list[TranscriptDifference]:
    """Values that differ by more than ``tolerance``; with ``time_s`` also steps whose times differ by more than that.

    Raises `Misuse` for transcripts of different requests.
    """
    if [step.line for step in one] != [step.line for step in two]:
        raise Misuse("the transcripts have different requests: their lines differ")
    found = []
    for number, (a, b) in enumerate(zip(one, two, strict=True), start=1):
        flat_a, flat_b = dict(_flat(a.result)), dict(_flat(b.result))
        for what in flat_a | flat_b:
            first, second = flat_a.get(what), flat_b.get(what)
            if not _alike(first, second, tolerance):
                found.append(TranscriptDifference(number, a.line, what, first, second))
        if time_s is not None and abs(a.at_s - b.at_s) > time_s:
            found.append(TranscriptDifference(number, a.line, "time in s", a.at_s, b.at_s))
    return found


def _flat(result: dict[str, Any], head: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in result.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{head}{name} ")
        else:
            yield f"{head}{name}", value


def _alike(one: Any, two: Any, tolerance: float) -> bool:
    if isinstance(one, int | float) and isinstance(two, int | float) and not isinstance(one, bool):
        return abs(one - two) <= tolerance
    return one == two
