"""What happens in described worlds, record by record: golden/traces.txt and, of elements, golden/elements.txt.

The rules behind it have their own tests; here whole worlds are compared, so that no moment and no value changes unnoticed.
Regenerate with ``PYTHONPATH=tests/support python tests/simulation/test_traces.py`` and read the diff.

A case is ``=== name, for 5 s``, the description, ``---``, the trace: moment in ms, machine, kind, subject, value. Plans are shown
by the counts at their beginning and end, and their end; loads pulse by pulse of their changes. A description that begins with
``# every 50 ms: x.position`` has the values of these signals between the records. ``@ name`` begins a file that it names.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.motion.divisions import StepTrain, profile_of
from steptwin.motion.profile import Profile
from steptwin.simulation.scheduler.trace import TraceRecord

GOLDEN = tuple(Path(__file__).parent / "golden" / name for name in ("traces.txt", "elements.txt"))
CASE, RESULT, TIME = "=== ", "---\n", ", for "
FILE = re.compile(r"^@ (.+)\n", re.MULTILINE)
SAMPLED = re.compile(r"# every (\d+) ms: (.*)\n")


def trace(name: str, description: str, *, restores: bool = False) -> Iterator[str]:
    """``restores``: from each moment with values on, another world goes on from a snapshot."""
    what, _, time = name.partition(TIME)
    end = float(time.removesuffix(" s"))
    text, *named = FILE.split(description)
    files = dict(zip(named[::2], (content.encode() for content in named[1::2]), strict=True))
    world = World.from_toml(text, files, name=what)
    rows: list[tuple[int, str]] = []
    if sampled := SAMPLED.match(description):
        period_ms, signals = int(sampled[1]), sampled[2].split(", ")
        for moment_ms in range(period_ms, round(1000 * end) + 1, period_ms):
            world.run(until=moment_ms / 1000)
            rows.append((world.now, " ".join(f"{world.read(signal):.9g}" for signal in signals)))
            if restores:
                world = world.branch(world.snapshot())
    stopped = world.run(until=end)
    lines = [(record.time, _line(record)) for record in world.trace]
    lines += [(moment, f"{_ms(moment)} : {row}") for moment, row in rows]
    yield from (line for _, line in sorted(lines, key=itemgetter(0)))
    for axis in world.axis:
        there = world.axis[axis]
        yield f"{axis} at {there.position:.9g}, lost {there.lost:.9g}{', stalled' if there.stalled else ''}"
    yield f"{world.time:.9g} s{f', stopped: {stopped}' if stopped else ''}"


def _line(record: TraceRecord) -> str:
    return f"{_ms(record.time)} {record.controller} {record.kind} {record.subject} {_shown(record.value)}".rstrip()


def _shown(value: object) -> str:
    if isinstance(value, Profile | StepTrain):
        profile = profile_of(value)
        if profile.end is None:
            return (
                f"{profile.base} → on at {profile.velocity(profile.start):.9g} to {profile.velocity(profile.start + 10**10):.9g}"
            )
        return f"{profile.base} → {profile.count(profile.end)} by {_ms(profile.end)}"
    if isinstance(value, bytes):
        return value.hex(" ")
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, tuple):
        return " ".join(f"({' '.join(_shown(part) for part in one)})" if isinstance(one, tuple) else _shown(one) for one in value)
    return str(value)


def _ms(moment: int) -> str:
    return f"{moment / 1e6:.12g}"


def cases(golden: Path) -> list[tuple[str, str, str]]:
    """Name, description and trace."""
    found = []
    for part in golden.read_text(encoding="utf-8").split(CASE)[1:]:
        name, _, body = part.partition("\n")
        description, _, expected = body.partition(RESULT)
        found.append((name, description, expected.strip("\n")))
    return found


ALL = [case for golden in GOLDEN for case in cases(golden)]


@pytest.mark.parametrize(("name", "description", "expected"), ALL, ids=[case[0] for case in ALL])
def test_traces_are_the_reviewed_ones(name: str, description: str, expected: str) -> None:
    assert list(trace(name, description)) == expected.splitlines()


@pytest.mark.parametrize(("name", "description", "expected"), cases(GOLDEN[1]), ids=[case[0] for case in cases(GOLDEN[1])])
def test_worlds_that_are_restored_again_and_again_have_the_same_traces(name: str, description: str, expected: str) -> None:
    assert list(trace(name, description, restores=True)) == expected.splitlines()


if __name__ == "__main__":
    for path in GOLDEN:
        head = path.read_text(encoding="utf-8").split(CASE)[0]
        path.write_text(
            head
            + "\n".join(
                f"{CASE}{name}\n{description}{RESULT}" + "".join(f"{line}\n" for line in trace(name, description))
                for name, description, _ in cases(path)
            ),
            encoding="utf-8",
        )
