"""The page has things in space where the simulation has them: its code, run in node, against the exact poses."""

from __future__ import annotations

import json
import math
import random
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest
from tests.studio.conftest import ROOT, web_builder

from steptwin.simulation.space.frames import AXES, FLOOR, NM_PER_MM, Direction, Frame, Joint, pose
from steptwin.simulation.space.pieces import standing

WEB = ROOT / "studio-web"
CASES = 3000
LONGEST_CHAIN = 8
NEAR_MM = 0.001
WIDEST_MM = 3000.0


class Chain:
    """Frames that carry each other, as the simulation has them and as a description gives them; turns are about one axis."""

    def __init__(self, chance: random.Random) -> None:
        self.frame = FLOOR
        self.frames: list[dict[str, Any]] = []
        self.values: dict[str, float] = {}
        about = chance.randrange(3)
        for n in range(chance.randint(1, LONGEST_CHAIN)):
            self._add(f"frame{n}", chance, about)
        others = self.frames[:-1]
        chance.shuffle(others)
        self.frames = [*others, self.frames[-1]]

    def _add(self, name: str, chance: random.Random, about: int) -> None:
        turns = chance.random() < 0.4
        along = Direction(about if turns else chance.randrange(3), chance.choice((1, -1)))
        at_nm = chance.randint(-(10**9), 10**9), chance.randint(-(10**9), 10**9), chance.randint(-(10**9), 10**9)
        per_unit = chance.choice((360.0, 1.0, 0.9)) if turns else chance.choice((1.0, 1000.0, 25.4))
        # Also after many turns, and in quarters.
        value = chance.choice((chance.uniform(-1, 1) * WIDEST_MM, float(chance.randint(-8, 8)) * 90.0)) / per_unit
        moved = value * per_unit / 90.0 if turns else value * per_unit * NM_PER_MM
        on = None if self.frame is FLOOR else self.frame.name
        self.frame = Frame(name, self.frame, at_nm, Joint(standing(moved), along, turns))
        at = [one / NM_PER_MM for one in at_nm]
        signal = f"{name}.position"
        joint = {"signal": signal, "along": str(along), "turns": turns, "per_unit": per_unit}
        self.frames.append({"name": name, "kind": "axis", "on": on, "at": at, "along": None, "joints": [joint]})
        self.values[signal] = value

    @property
    def numbers(self) -> list[float]:
        """Its turn as a matrix, row by row, then its place in mm."""
        exact = pose(self.frame, FLOOR, 0)
        angle = math.radians(exact.angle_q % 4 * 90.0)
        one, other = (exact.about + 1) % len(AXES), (exact.about + 2) % len(AXES)
        matrix = [[float(row == column) for column in range(3)] for row in range(3)]
        matrix[one][one] = matrix[other][other] = math.cos(angle)
        matrix[other][one], matrix[one][other] = math.sin(angle), -math.sin(angle)
        return [*matrix[0], *matrix[1], *matrix[2], *(place / NM_PER_MM for place in exact.at)]


def _chains() -> Iterator[Chain]:
    chance = random.Random(20_261)
    yield from (Chain(chance) for _ in range(CASES))


@pytest.mark.usefixtures("require_node")
def test_page_has_frames_where_the_simulation_has_them() -> None:
    web_builder().install(WEB, tests=True)
    chains = list(_chains())
    given = json.dumps([[{"frames": one.frames, "bodies": []}, one.values] for one in chains])
    node = str(web_builder().node_folder() / "node")
    answer = subprocess.run([node, str(WEB / "scripts/poses.mjs")], input=given, capture_output=True, text=True, check=True)
    for chain, found in zip(chains, json.loads(answer.stdout), strict=True):
        assert found == pytest.approx(chain.numbers, abs=NEAR_MM), chain.frames
