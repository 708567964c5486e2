"""Golden traces: what a controller does with a script of commands, event by event, in files that are reviewed.

A case is ``=== name`` and a script, whose commands are followed by what comes of them. A script has lines of settings
(``@ axis1 gear=100``, ``@ row a;1;2;x;x``, ``@ firmware 1.40``, ``@ input3 interrupt=2``, ``@ axes 2``: the number of axes
shown), of the program (``| OUT1 = ON``), and commands behind ``>``:

    set POS_ABS 1 250     value register of axis 1, as REAL; M_ENABLE and other words without axis: word M_ENABLE 3
    coil 2000 1           pin IN1 1           turn 1 -50           couple 1 blocked           user 10 -5           wait 2.5
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from mic488_rig import RUNNING, Rig, coil_pdu, controller, programmed, word_pdu

from steptwin.controller import SECOND, PinEdge
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.core import Mic488Event
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.status import AxisStatus

CASE = "=== "


@dataclass(frozen=True)
class Case:
    name: str
    expected: str

    @property
    def script(self) -> str:
        return "\n".join(line for line in self.expected.splitlines() if line[:1] in {"@", "|", ">"})

    def settings(self, word: str) -> list[str]:
        start = f"@ {word} "
        return [line.removeprefix(start) for line in self.script.splitlines() if line.startswith(start)]

    def config(self) -> ControllerConfig:
        axes = [replace(AxisConfig(), **_numbers(*self.settings(f"axis{n}"))) for n in range(1, 5)]  # type: ignore[arg-type]
        config = controller(*axes)
        inputs = [
            replace(one, **_numbers(*self.settings(f"input{n}")))  # type: ignore[arg-type]
            for n, one in enumerate(config.inputs, 1)
        ]
        return replace(config, inputs=tuple(inputs))

    def trace(self) -> str:
        """What the script does, in words."""
        return "\n".join(self._run(in_one_go=False)[0])

    def ends(self, *, in_one_go: bool) -> tuple[list[PinEdge], list[Mic488Event], list[str]]:
        """Edges, events and what can be seen after the script; ``in_one_go``: without stopping at the events of a wait."""
        rig = self._run(in_one_go=in_one_go)[1]
        end = _Trace(rig, 4, program=True, in_one_go=in_one_go)
        return rig.edges, list(rig.device.events), [*end.look(), *map(str, rig.device.user)]

    def _run(self, *, in_one_go: bool) -> tuple[list[str], Rig]:
        lines = self.script.splitlines()
        program = "".join(line[1:].removeprefix(" ") + "\n" for line in lines if line.startswith("|"))
        rows = "".join(row + "\n" for row in self.settings("row"))
        firmware = (*self.settings("firmware"), "1.70")[0]
        rig = programmed(program or "WAIT IN20 = ON\n", rows, self.config(), firmware)
        trace = _Trace(rig, int((*self.settings("axes"), "1")[0]), program=bool(program), in_one_go=in_one_go)
        found = []
        for line in lines:
            found += [*trace.rest(), line]
            if line.startswith("> "):
                found += trace.command(*line[2:].split())
        found += trace.rest()
        readers = {"I": rig.i, "D": rig.d, "R": rig.r}
        names = dict.fromkeys(re.findall(r"\$([IDR])(\d+)", program))
        found += [f"${kind}{number} = {readers[kind](int(number)):.9g}" for kind, number in names]
        return found, rig


def _numbers(pairs: str = "") -> dict[str, float]:
    return {name: float(text) if "." in text else int(text) for name, _, text in (pair.partition("=") for pair in pairs.split())}


class _Trace:
    def __init__(self, rig: Rig, axes: int, *, program: bool, in_one_go: bool) -> None:
        self.in_one_go = in_one_go
        self.rig = rig
        self.axes = axes
        self.program = program
        self.edges = 0
        self.events = 0
        self.shown = ""
        self.place = ""
        self.lines: list[str] = []
        """Statements since, where nothing else has changed."""

    def command(self, word: str, *arguments: str) -> Iterator[str]:
        rig = self.rig
        if word == "wait":
            yield from self.wait(float(arguments[0]))
            return
        match word:
            case "set":
                rig.set(arguments[0], float(arguments[2]), int(arguments[1]))
            case "word":
                code = rig.exception(word_pdu(rig.address(arguments[0]), int(arguments[1])))
                assert code == 0, f"exception {code}"
            case "coil":
                code = rig.exception(coil_pdu(int(arguments[0]), arguments[1] == "1"))
                assert code == 0, f"exception {code}"
            case "pin":
                rig.pin(arguments[0], float(arguments[1]))
            case "turn":
                rig.scheduler.advance(rig.now)
                rig.device.turn_encoder(int(arguments[0]), int(arguments[1]), rig.now)
                rig.scheduler.deadline()
            case "couple":
                rig.scheduler.advance(rig.now)
                rig.device.couple_encoder(int(arguments[0]), Coupling(arguments[1]), rig.now)
                rig.scheduler.deadline()
            case "user":
                rig.write_words(int(arguments[0]), int(arguments[1]) & 0xFFFF)
            case _:
                raise ValueError(f"no command {word!r}")
        yield from self.look()

    def wait(self, seconds: float) -> Iterator[str]:
        """From event to event; of a motion also the middle."""
        rig = self.rig
        end = rig.now + round(seconds * SECOND)
        if self.in_one_go:
            rig.now = end
            rig.device.advance(end)
        middle = (rig.now + end) // 2
        while rig.now < end:
            due = rig.scheduler.deadline()
            ahead = [moment for moment in (due, middle, end) if moment is not None and moment > rig.now]
            rig.wait_ns(min(ahead) - rig.now)
            yield from self.look()

    def look(self) -> Iterator[str]:
        """The state, unless it is that of the line before, and what came out."""
        rig = self.rig
        shown = " ".join(self._axis(axis) for axis in range(1, self.axes + 1))
        edges, self.edges = rig.edges[self.edges :], len(rig.edges)
        events, self.events = list(rig.device.events)[self.events :], len(rig.device.events)
        place = self._place() if self.program else ""
        if shown == self.shown and not edges and not events:
            if place != self.place:
                self.place = place
                self.lines.append(f"{place} ({_ms(rig.now)})")
            return
        yield from self.rest()
        if (shown, place) != (self.shown, self.place):
            self.shown, self.place = shown, place
            yield f"{_ms(rig.now)}: {shown} {place}".rstrip()
        for edge in edges:
            yield f"    {edge.pin} = {edge.value:g} at {_ms(edge.time)}"
        for event in events:
            yield f"    {event.code}: {event.text}"

    def rest(self) -> Iterator[str]:
        if self.lines:
            yield f"    {' '.join(self.lines)}"
        self.lines = []

    def _axis(self, axis: int) -> str:
        rig = self.rig
        status = AxisStatus(rig.status(axis)).name
        return f"M{axis} {status} {rig.position(axis):.7g} v {rig.velocity(axis):.6g} e {rig.get('ENC_IMP', axis)};"

    def _place(self) -> str:
        control = self.rig.device.program
        span = control.statement(self.rig.device.now)
        running = control.running
        if span is None or running is None:
            return f"line – state {self.rig.state}"
        line, _ = running.source.position(span.start)
        return f"line {line}" if self.rig.state == RUNNING else f"line {line} state {self.rig.state}"


def _ms(moment: int) -> str:
    return f"{moment / 1e6:.12g}"


def cases(golden: Path) -> list[Case]:
    parts = golden.read_text(encoding="utf-8").split(CASE)[1:]
    found = []
    for part in parts:
        name, _, body = part.partition("\n")
        found.append(Case(name.strip(), body.strip("\n")))
    return found


def regenerate(golden: Path) -> None:
    head = golden.read_text(encoding="utf-8").split(CASE)[0]
    written = (f"{CASE}{case.name}\n{case.trace()}\n" for case in cases(golden))
    golden.write_text(head + "\n".join(written), encoding="utf-8")
