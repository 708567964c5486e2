"""What a chip does with what a host types, event by event: golden/traces.txt.

The rules behind it have their own tests; here whole sessions are compared, so that no moment and no pulse changes unnoticed.
Regenerate with ``PYTHONPATH=tests/support python tests/m1486/test_traces.py`` and read the diff.

A case is ``=== name``, the script, ``---``, the trace. A script begins with the type (``@ B``) and options of the chip
(``@ statement_ns 0``); a line is typed with its CR, but for those with a backquote:

    `wait 0.5`     seconds        `pin LIMIT 0`        `raw 6B 41`   characters, in hexadecimal
    `random 100 7` so many commands of the language and of a host, of the generator with this seed

The trace has, after each line, what the chip sends, and what has happened when: positions in minimum microsteps from power-on,
with the counter behind a slash, and the internal variable.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from m1486_rig import Bench

from steptwin.m1486.commands import TABLE, ArgType
from steptwin.m1486.lines import INTERFACES
from steptwin.m1486.variants import Variant, variant
from steptwin.machine import SECOND

GOLDEN = Path(__file__).parent / "golden" / "traces.txt"
CASE, RESULT = "=== ", "---"
LEFT_OUT = frozenset(("upload", "power-on"))
MOST_WAITED_S = 0.3
PINS = ("LIMIT", "JOG", "B2", "B3", "B7", "B12", "B15")


def trace(script: str) -> Iterator[str]:
    options: dict[str, Any] = {"kind": "B"}
    lines = []
    for line in script.splitlines():
        if line.startswith("@ "):
            name, _, value = line[2:].partition(" ")
            if not value:
                options["kind"] = name
            else:
                options[name] = INTERFACES[int(value)] if name == "interface" else int(value)
        elif line.startswith("`random"):
            _, number, seed = line.strip("`").split()
            lines += list(chance(random.Random(int(seed)), int(number), variant(options["kind"])))
        elif line:
            lines.append(line)
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


def chance(source: random.Random, number: int, kind: Variant) -> Iterator[str]:
    """Commands as a host may type them, with numbers in and just out of their ranges, and what else may happen meanwhile."""
    for _ in range(number):
        spec = source.choice(TABLE)
        if spec.key in ("\\", "X", "XG", "W", "Z", "O", "[", "]", ")", "(") and source.random() < 0.7:
            spec = source.choice(TABLE)
        permitted = spec.permitted(kind)
        text = spec.key
        if permitted and source.random() < 0.97:
            value = source.choice((permitted[0], permitted[-1], source.choice(permitted), source.choice(permitted)))
            if source.random() < 0.04:
                value = permitted[-1] + 1
            if spec.kind is ArgType.ADDRESS:
                text = f"X{value:X}"
            elif spec.kind is ArgType.CONDITION:
                text = f"I{value}{source.choice('HL')}{source.randint(1, 5)}"
            elif spec.name in ("Wait", "Forward", "Backward", "Go absolute"):
                text = f"{spec.key}{1 + value % (20_000 if spec.key != 'W' else 200)}"
            elif spec.kind is ArgType.LABEL:
                text = f"{spec.key}{1 + value % 5}"
            else:
                text = f"{spec.key}{value}"
        yield text if source.random() < 0.5 else text.lower()
        if source.random() < 0.5:
            yield f"`wait {source.choice((0.001, 0.01, 0.05, MOST_WAITED_S)):g}`"
        if source.random() < 0.12:
            yield f"`pin {source.choice(PINS)} {source.randint(0, 1)}`"
        if source.random() < 0.04:
            yield source.choice(("K", "C75", "XG"))
    yield "K"
    yield "`wait 2`"


def _ms(moment: int) -> str:
    return f"{moment / 1e6:.9g}"


def cases() -> list[tuple[str, str, str]]:
    """Name, script and trace."""
    found = []
    for part in GOLDEN.read_text(encoding="utf-8").split(CASE)[1:]:
        name, _, body = part.partition("\n")
        script, _, expected = body.partition(f"{RESULT}\n")
        found.append((name, script, expected.strip("\n")))
    return found


@pytest.mark.parametrize(("script", "expected"), [case[1:] for case in cases()], ids=[case[0] for case in cases()])
def test_traces_are_the_reviewed_ones(script: str, expected: str) -> None:
    assert list(trace(script)) == expected.splitlines()


if __name__ == "__main__":
    head = GOLDEN.read_text(encoding="utf-8").split(CASE)[0]
    written = (
        f"{CASE}{name}\n{script}{RESULT}\n" + "".join(f"{line}\n" for line in trace(script)) for name, script, _ in cases()
    )
    GOLDEN.write_text(head + "\n".join(written), encoding="utf-8")
