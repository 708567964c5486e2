"""Transcripts of what drivers say to twins in virtual time, in files that are reviewed.

A case is ``=== name`` and its script, whose lines are followed by what comes of them:

    @ 7 8                    options of the line; what they mean says the test
    > chip.move_by(10.0)     Python: below the call what was sent meanwhile (after a pause with its milliseconds), what happened,
                             the result or the error, and how many milliseconds it took
    | chip.open()            the same without what comes of it
    % drop 0 to chip         the next line meets this fault (kind, number of the byte, direction)
    # reason                 for readers
    %% drop, invert          as the last line before a call: each byte of the call goes wrong once, with the next of these kinds;
                             what stands before and behind is done anew each time. Such a script ends with ``---``. Behind it is
                             one line for each byte: the fault, how long the call took, and what was different from a call
                             without: what was sent then, its result, what happened, the result of the last line
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import itemgetter
from pathlib import Path
from types import ModuleType
from typing import Any

from line_rig import VirtualWire

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.blocking import finish
from steptwin.errors import SteptwinError
from steptwin.simulation.script import steps as script
from steptwin.subject import commands
from steptwin.subject.subscriptions import filter_of

CASE, RESULT = "=== ", "---"
PAUSE_NS = 20 * MILLISECOND
"""Longer ones are shown, with their moment since the call."""
MANY = 5
SCRIPT = ("@ ", "> ", "| ", "% ", "# ")
"""Beginnings of lines of a script."""
FAULT = re.compile(r"(.+) (\d+) (to .+)")


@dataclass(frozen=True)
class Bench:
    """A line with a twin, made anew for a case."""

    wire: Any
    names: dict[str, Any]
    """What scripts may use."""
    fault: Callable[[str, str, int], Any]
    """A fault of a kind, in a direction, at a byte."""
    passed: Callable[[], Mapping[str, int]]
    """How many bytes have gone in each direction since faults were put."""
    shown: Callable[[bytes], str]
    happened: Callable[[], list[str]]
    """What the twin has reported since the last time."""


@dataclass(frozen=True)
class Case:
    name: str
    script: str
    expected: str

    def transcript(self, make: Callable[[str], Bench]) -> str:
        steps = self.script.splitlines()
        options = " ".join(line[2:] for line in steps if line.startswith("@ "))
        sweep = next((at for at, step in enumerate(steps) if step.startswith("%% ")), None)
        if sweep is None:
            return "\n".join(_run(make(options), steps))
        before = [step for step in steps[:sweep] if step[0] not in "@#"]
        kinds, (call, *after) = steps[sweep][3:].split(", "), steps[sweep + 1 :]
        return "\n".join(_sweep(lambda: make(options), before, kinds, call, after))


def _run(bench: Bench, steps: list[str]) -> Iterator[str]:
    for step in steps:
        yield step
        if step.startswith("% "):
            kind, number, direction = FAULT.fullmatch(step[2:]).groups()  # type: ignore[union-attr]
            bench.wire.put(bench.fault(kind, direction, int(number)))
        elif step.startswith("| "):
            _call(bench, step)
            bench.happened()
        elif step.startswith("> "):
            begin, sent = bench.wire.now, len(bench.wire.sent)
            result = _call(bench, step)
            if said := " ".join(_said(bench, begin, sent)):
                yield f"    {said}"
            for text in bench.happened():
                yield f"    {text}"
            yield f"    {result} ({_ms(bench.wire.now - begin)})"


def _said(bench: Bench, begin: Nanos, first: int) -> Iterator[str]:
    """Of what is sent many times, one after the other, the first, how many, and the last."""
    before = begin
    for data, group in groupby(bench.wire.sent[first:], key=itemgetter(1)):
        times = [at for at, _ in group]
        shown = [f"{_pause(at, last, begin)}{bench.shown(data)}" for last, at in pairwise((before, *times))]
        yield from (shown[0], f"… {len(times) - 2} …", shown[-1]) if len(times) > MANY else shown
        before = times[-1]


def _pause(at: Nanos, before: Nanos, begin: Nanos) -> str:
    return f"[{_ms(at - begin)}] " if at - before > PAUSE_NS else ""


@dataclass(frozen=True)
class _Outcome:
    said: list[str]
    result: str
    happened: str
    end: str
    took: Nanos

    def beside(self, usual: _Outcome) -> str:
        """What is not as usual."""
        same = next((n for n, (a, b) in enumerate(zip(self.said, usual.said, strict=False)) if a != b), len(usual.said))
        pairs = ((self.result, usual.result), (self.happened, usual.happened), (self.end, usual.end))
        return " | ".join((" ".join(self.said[same:]), *(mine for mine, other in pairs if mine != other)))


def _sweep(make: Callable[[], Bench], before: list[str], kinds: list[str], call: str, after: list[str]) -> Iterator[str]:
    """``after`` is done when the fault is over; of its results the last is shown."""

    def outcome(*fault: Any) -> tuple[_Outcome, Mapping[str, int]]:
        bench = make()
        for step in before:
            _call(bench, step)
        bench.happened()
        bench.wire.put(*(bench.fault(*one) for one in fault))
        begin, sent = bench.wire.now, len(bench.wire.sent)
        result = _brief(_call(bench, call))
        took = bench.wire.now - begin
        said = list(_said(bench, begin, sent))
        passed = bench.passed()
        bench.wire.put()
        ends = [_call(bench, step) for step in after]
        happened = "; ".join(_brief(text) for text in bench.happened())
        return _Outcome(said, result, happened, _brief("".join(ends[-1:])), took), passed

    usual, passed = outcome()
    yield f"{call}: {usual.result} ({_ms(usual.took)}) {' '.join(usual.said)}"
    yield f"    {usual.happened} | {usual.end}"
    number = 0
    for direction, count in passed.items():
        for index in range(count):
            kind = kinds[number % len(kinds)]
            number += 1
            found, _ = outcome((kind, direction, index))
            yield f"{kind} {index} {direction} ({_ms(found.took)}): {found.beside(usual)}".rstrip(" |")


def _call(bench: Bench, step: str) -> str:
    text = step[2:]
    try:
        try:
            code = compile(text, "<script>", "eval")
        except SyntaxError:
            exec(text, bench.names)  # an assignment
            return "done"
        found = eval(code, bench.names)
    except SteptwinError as error:
        marks = [name for name in ("uncertain",) if getattr(error, name, False)]
        return f"{type(error).__name__}{''.join(f' {mark}' for mark in marks)}: {error}"
    return f"= {found!r}"


def _brief(text: str) -> str:
    """Without the words of a message."""
    return text if text.startswith("= ") else text.partition(":")[0]


def _ms(nanos: int) -> str:
    return f"{nanos / 1e6:.9g}"


def cases(*goldens: Path) -> list[Case]:
    return [case for golden in goldens for case in _cases_in(golden)]


def _cases_in(golden: Path) -> list[Case]:
    found = []
    for part in golden.read_text(encoding="utf-8").split(CASE)[1:]:
        name, _, body = part.partition("\n")
        script, is_sweep, expected = body.partition(f"{RESULT}\n")
        if not is_sweep:
            script, expected = "\n".join(line for line in body.splitlines() if line[:2] in SCRIPT), body
        found.append(Case(name.strip(), script, expected.strip("\n")))
    return found


def regenerate(make: Callable[[str], Bench], *goldens: Path) -> None:
    for golden in goldens:
        head = golden.read_text(encoding="utf-8").split(CASE)[0]
        written = []
        for case in cases(golden):
            script = f"{case.script}{RESULT}\n" if "%% " in case.script else ""
            written.append(f"{CASE}{case.name}\n{script}{case.transcript(make)}\n")
        golden.write_text(head + "\n".join(written), encoding="utf-8")


def names_of(drivers: ModuleType, wire: VirtualWire) -> dict[str, Any]:
    """What the scripts of both kinds of devices may use; ``drivers``: the package of a kind."""
    of_drivers = {name: getattr(drivers, name) for name in drivers.__all__}
    of_subjects = {"command": commands, "steps": script, "filter_of": filter_of, "finish": finish}
    return {**of_drivers, **of_subjects, "wire": wire, "suspend": suspending(wire)}


def suspending(wire: VirtualWire) -> Callable[[int, float, str], None]:
    """``suspend(3, 1000.0, "sending")`` for scripts: the program is suspended for so many seconds immediately before it sends
    something for the third time from now on; likewise "reading"."""

    def suspend(number: int, seconds: float, what: str) -> None:
        left = number

        def count(*_: object) -> None:
            nonlocal left
            left -= 1
            if left == 0:
                wire.sleep(seconds)

        setattr(wire, {"sending": "before_each", "reading": "before_read"}[what], count)

    return suspend
