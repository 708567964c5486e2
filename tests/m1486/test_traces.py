"""What a chip does with what a host types, event by event: golden/traces.txt.

The rules behind it have their own tests; here whole sessions are compared, so that no moment and no pulse changes unnoticed.
Regenerate with ``make golden ARGS=tests/m1486/test_traces.py`` and read the diff.

A case is ``=== name`` and a script, whose lines are followed by what comes of them. A script begins with the type (``@ B``) and
options of the chip (``@ statement_ns 0``); a line behind ``>`` is typed with its CR, but for those with a backquote:

    `wait 0.5`     seconds        `pin LIMIT 0`        `raw 6B 41`   characters, in hexadecimal

Behind ``⇒`` is what the chip sends; below is what has happened when: positions in minimum microsteps from power-on, with the
counter behind a slash, and the internal variable.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from m1486_rig import Bench

from steptwin.controller import SECOND
from steptwin.m1486.lines import INTERFACES

GOLDEN = Path(__file__).parent / "golden" / "traces.txt"
CASE = "=== "
LEFT_OUT = frozenset(("upload", "power-on"))
MOST_WAITED_S = 0.3
PINS = ("LIMIT", "JOG", "B2", "B3", "B7", "B12", "B15")


def trace(script: str) -> Iterator[str]:
    options: dict[str, Any] = {"kind": "B"}
    lines = []
    for line in script.splitlines():
        if line.startswith("@ "):
            yield line
            name, _, value = line[2:].partition(" ")
            if not value:
                options["kind"] = name
            else:
                options[name] = INTERFACES[int(value)] if name == "interface" else int(value)
        elif line.startswith("> "):
            lines.append(line[2:].partition(" ⇒ ")[0])
    teller = Teller(Bench(**options))
    for line in lines:
        yield from teller.line(line)


class Teller:
    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.events = len(bench.chip.events)
        self.shown = ""
        bench.edges.clear()

    def line(self, text: str) -> Iterator[str]:
        bench = self.bench
        sent = b""
        begin = bench.now
        found: list[str] = []
        word, *rest = text.strip("`").split() if text.startswith("`") else ("", text)
        match word:
            case "wait":
                end = begin + round(float(rest[0]) * SECOND)
                middle = (begin + end) // 2
                while bench.now < end:
                    due = bench.chip.deadline()
                    bench.chip.advance(min(moment for moment in (due, middle, end) if moment is not None and moment > bench.now))
                    sent += bench.sent()
                    found += self.look()
            case "pin":
                bench.pin(**{rest[0]: int(rest[1])})
            case "raw":
                sent = bench.raw(bytes.fromhex("".join(rest)))
            case _:
                sent = bench.send(*rest)
        found += self.look()
        yield f"> {text}{f' ⇒ {sent.hex(chr(32))}' if sent else ''}"
        yield from (f"    {one}" for one in found)

    def look(self) -> Iterator[str]:
        bench = self.bench
        chip = bench.chip
        for event in list(chip.events)[self.events :]:
            if event.code not in LEFT_OUT:
                yield f"{_ms(event.time)}: {event.text}"
        self.events = len(chip.events)
        for edge in bench.edges:
            yield f"{_ms(edge.time)}: {edge.pin} = {edge.value:g}"
        bench.edges.clear()
        speed = chip.drive.profile.velocity(bench.now)
        shown = f"{bench.true}/{bench.counter}{f' at {speed:.9g} u/s' if speed else ''} variable {bench.variable}"
        if shown != self.shown:
            self.shown = shown
            yield f"{_ms(bench.now)}: {shown}"


def _ms(moment: int) -> str:
    return f"{moment / 1e6:.9g}"


def cases() -> list[tuple[str, str]]:
    """Name and trace."""
    found = []
    for part in GOLDEN.read_text(encoding="utf-8").split(CASE)[1:]:
        name, _, body = part.partition("\n")
        found.append((name, body.strip("\n")))
    return found


@pytest.mark.parametrize("expected", [case[1] for case in cases()], ids=[case[0] for case in cases()])
def test_traces_are_the_reviewed_ones(expected: str) -> None:
    assert list(trace(expected)) == expected.splitlines()


if __name__ == "__main__":
    head = GOLDEN.read_text(encoding="utf-8").split(CASE)[0]
    written = (f"{CASE}{name}\n" + "".join(f"{line}\n" for line in trace(case)) for name, case in cases())
    GOLDEN.write_text(head + "\n".join(written), encoding="utf-8")
