"""Every signal of every element: unit, range, on what it depends, its value at some moments; golden/signals.txt, reviewed once.

Regenerate with ``python tests/simulation/test_signal_table.py`` and read the diff.
"""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

from toy import lamp
from whole_world import everything

from steptwin.controller import MILLISECOND, Nanos
from steptwin.files.world import World
from steptwin.simulation.components.registry import ELEMENTS
from steptwin.simulation.logic.signal import SignalOf

GOLDEN = Path(__file__).parent / "golden" / "signals.txt"
MOMENTS: tuple[Nanos, ...] = (0, 99 * MILLISECOND, 433 * MILLISECOND, 2_333 * MILLISECOND)
"""The program does not come to OUT1, so that is written."""
TURNS = 3


def described(name: str, signal: SignalOf) -> str:
    bounds = "" if signal.bounds is None else f" {signal.bounds[0]:.6g}…{signal.bounds[1]:.6g}"
    sources = ", ".join(sorted(source.name for source in signal.sources))
    return f"{name} | {signal.unit}{bounds} | of {sources}{', kept' if signal.is_kept else ''}"


def present(signal: SignalOf, now: Nanos) -> str:
    """Its value, and when it may turn next, in ns from now."""
    signal.sync(now)
    turning_points = ", ".join(str(moment - now) for moment in islice(signal.turning_points(now), TURNS))
    return f"{signal.value(now):.9g}{f' ({turning_points})' if signal.continuous else ''}"


def signals(world: World) -> dict[str, SignalOf]:
    found = {name: world.objects.element_signals(name) or {} for name in world.objects.element_names}
    return {f"{name}.{signal}": of for name, every in found.items() for signal, of in every.items()}


def table() -> list[str]:
    with lamp.registered():
        world = everything()
        rows = {name: [described(name, signal)] for name, signal in signals(world).items()}
        for moment in MOMENTS:
            world.advance(moment)
            world.mic488["table"].write("OUT1", 1.0)
            for name, signal in signals(world).items():
                rows[name].append(present(signal, moment))
    return [" | ".join(row) for row in rows.values()]


def test_signals_are_the_reviewed_ones() -> None:
    assert table() == GOLDEN.read_text("utf-8").splitlines()


def test_the_documentation_lists_them() -> None:
    page = (Path(__file__).parents[2] / "docs" / "elements" / "signals.md").read_text("utf-8")
    rows = re.findall(r"^\| `\[\[(\w+)\]\]` \| (.*?) \|", page, re.MULTILINE)
    listed = {kind: set(re.findall(r"`(\w+)`", names)) for kind, names in rows}
    known: dict[str, set[str]] = {}
    with lamp.registered():
        world = everything()
        for kind in listed:
            for spec in ELEMENTS[kind].named(world.spec.elements[kind]):
                names = world.objects.element_signals(spec.name) or {}
                known.setdefault(kind, set()).update(re.sub(r"\d+$", "1", name) for name in names)
        named = {kind for kind, element in ELEMENTS.items() if element.is_named}
    assert set(listed) == named - {"lamp", "body"}
    assert listed == known


if __name__ == "__main__":
    GOLDEN.write_text("\n".join(table()) + "\n", "utf-8")
