"""What dead-man jogs send to controllers, what moves by it and when it stands: golden/deadmanjogs.txt.

Rules have their own tests (test_deadmanjog_*.py); here whole recordings are compared.
Regenerate with ``PYTHONPATH=tests/support python tests/simulation/test_deadmanjog_transcripts.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from deadmanjog_rig import CHIPS, MIC, TIMED, Rig
from mic488_rig import loaded
from transcripts import Bench, Case, cases, regenerate

from steptwin.controller import MILLISECOND
from steptwin.motion.divisions import profile_of
from steptwin.simulation.kinds.m1486.deadmanjog import M1486DeadManJog
from steptwin.simulation.kinds.mic488.deadmanjog import Mic488DeadManJog
from steptwin.simulation.script import steps as script
from steptwin.subject import commands
from steptwin.subject.payloads import FramePayload, PlanPayload

GOLDENS = [Path(__file__).parent / "golden/deadmanjogs.txt"]


class JogWire:
    """The lines of a world, as transcripts see them."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._begun = rig.world.now
        self._sent: list[tuple[int, bytes]] = []
        self._moves: list[str] = []

    @property
    def now(self) -> int:
        return self._rig.world.now

    @property
    def sent(self) -> list[tuple[int, bytes]]:
        self._take()
        return self._sent

    def moves(self) -> list[str]:
        self._take()
        new = self._moves[:]
        self._moves.clear()
        return new

    def _take(self) -> None:
        for event in self._rig.followed.take().events:
            payload = event.payload
            if isinstance(payload, FramePayload) and payload.direction == "in":
                self._sent.append((event.time, payload.data))
            elif isinstance(payload, PlanPayload):
                end = profile_of(payload.plan).end
                until = "" if end is None else f" until {self._ms(end)}"
                self._moves.append(f"{self._ms(event.time)} {payload.text}{until}")

    def _ms(self, now: int) -> str:
        return f"{(now - self._begun) / MILLISECOND:.9g}"


def bench(options: str) -> Bench:
    """Options: ``mic`` with its ACC and DEC in mm/s² or ``chip`` with its type, and ``timed``."""
    kind, value, *more = options.split()
    timing = TIMED if "timed" in more else ""
    rig = Rig(MIC.format(acc=value, timing=timing) if kind == "mic" else CHIPS.format(variant=value, timing=timing))
    wire: Any = JogWire(rig)

    def run(for_ms: float) -> None:
        rig.run(for_ms)

    def write(**values: float) -> None:
        rig.subject.do(script.Write(tuple(("a", register, value) for register, value in values.items())))

    def program(text: str) -> None:
        rig.world.mic488["a"].device.load_program(0, loaded(text)[0])

    def chip_jog(velocity: float, axis: int = 1, line: str | None = "chips") -> M1486DeadManJog:
        return M1486DeadManJog(rig.world.m1486["drum"].chip, line, commands.Jog("drum", axis, velocity))

    def mic_jog(velocity: float, axis: int = 1) -> Mic488DeadManJog:
        return Mic488DeadManJog(rig.world.mic488["a"].device, "bus", commands.Jog("a", axis, velocity))

    of_rig = {"begin": rig.begin, "do": rig.subject.do, "at": rig.position, "jogs": rig.jogs, "world": rig.world}
    own = {"run": run, "write": write, "program": program, "chip_jog": chip_jog, "mic_jog": mic_jog}
    return Bench(
        wire=wire,
        names=of_rig | own | {name: getattr(commands, name) for name in ("Enable", "Home", "Jog", "StopAxes")},
        fault=lambda *fault: fault,
        passed=dict,
        shown=lambda data: data.decode().replace("\r", "←") if kind == "chip" else data[:-2].hex(),
        happened=wire.moves,
    )


@pytest.mark.parametrize("case", cases(*GOLDENS), ids=lambda case: case.name)
def test_transcripts_are_the_reviewed_ones(case: Case) -> None:
    assert case.transcript(bench).splitlines() == case.expected.splitlines()


if __name__ == "__main__":
    regenerate(bench, *GOLDENS)
