"""What happens in described worlds, record by record: golden/traces.txt.

The rules behind it have their own tests; here whole worlds are compared, so that no moment and no value changes unnoticed.
Regenerate with ``PYTHONPATH=tests/support python tests/world/test_traces.py`` and read the diff.

A case is ``=== name, for 5 s``, the description, ``---``, the trace: moment in ms, machine, kind, subject, value. Plans are shown
by the counts at their beginning and end, and their end; loads pulse by pulse of their changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from steptwin.files.world import World
from steptwin.motion.divisions import StepTrain, profile_of
from steptwin.motion.profile import Profile
from steptwin.world.trace import TraceRecord

GOLDEN = Path(__file__).parent / "golden" / "traces.txt"
CASE, RESULT, TIME = "=== ", "---\n", ", for "


def trace(name: str, description: str) -> Iterator[str]:
    what, _, seconds = name.partition(TIME)
    world = World.from_toml(description, name=what)
    stopped = world.run(for_=seconds)
    yield from (_line(record) for record in world.trace)
    for axis in world.axis:
        there = world.axis[axis]
        yield f"{axis} at {there.position:.9g}, lost {there.lost:.9g}{', stalled' if there.stalled else ''}"
    yield f"{world.time:.9g} s{f', stopped: {stopped}' if stopped else ''}"


def _line(record: TraceRecord) -> str:
    return f"{_ms(record.time)} {record.machine} {record.kind} {record.subject} {_shown(record.value)}".rstrip()


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


def cases() -> list[tuple[str, str, str]]:
    """Name, description and trace."""
    found = []
    for part in GOLDEN.read_text(encoding="utf-8").split(CASE)[1:]:
        name, _, body = part.partition("\n")
        description, _, expected = body.partition(RESULT)
        found.append((name, description, expected.strip("\n")))
    return found


@pytest.mark.parametrize(("name", "description", "expected"), cases(), ids=[case[0] for case in cases()])
def test_traces_are_the_reviewed_ones(name: str, description: str, expected: str) -> None:
    assert list(trace(name, description)) == expected.splitlines()


if __name__ == "__main__":
    head = GOLDEN.read_text(encoding="utf-8").split(CASE)[0]
    GOLDEN.write_text(
        head
        + "\n".join(
            f"{CASE}{name}\n{description}{RESULT}" + "".join(f"{line}\n" for line in trace(name, description))
            for name, description, _ in cases()
        ),
        encoding="utf-8",
    )
