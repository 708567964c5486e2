from __future__ import annotations

import io
import json
import struct
from bisect import bisect_right
from collections.abc import Callable
from math import acos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from node_client import NodeClient
from tests.files.scene.test_recorder import DEMO, EXAMPLES, JAWS, SWINGS, recorded

from steptwin.controller import SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.files.scene.gltf import write_glb
from steptwin.files.world import World
from steptwin.simulation.space.bodies import half_height
from steptwin.simulation.space.frames import FLOOR, NM_PER_MM, pose


class Player:
    """A file as a viewer of glTF plays it, with the formulas of its specification."""

    def __init__(self, content: bytes) -> None:
        size = struct.unpack_from("<I", content, 12)[0]
        self.data = json.loads(content[20 : 20 + size])
        self._buffer = content[28 + size :]
        self.parents = {child: n for n, node in enumerate(self.data["nodes"]) for child in node.get("children", ())}

    def numbers(self, accessor: int) -> Any:
        its = self.data["accessors"][accessor]
        view = self.data["bufferViews"][its["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[its["type"]]
        return np.frombuffer(self._buffer, "<f4", its["count"] * width, view["byteOffset"]).astype(float).reshape(-1, width)

    def look(self, node: int, path: str, at: float) -> Any:
        for channel in self.data["animations"][0]["channels"]:
            if channel["target"] == {"node": node, "path": path}:
                return self._sample(self.data["animations"][0]["samplers"][channel["sampler"]], at)
        rest = {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0] * 3}[path]
        return np.array(self.data["nodes"][node].get(path, rest))

    def _sample(self, sampler: Any, at: float) -> Any:
        times, values = self.numbers(sampler["input"])[:, 0], self.numbers(sampler["output"])
        assert (np.diff(times) > 0).all()
        cubic = sampler["interpolation"] == "CUBICSPLINE"
        n = bisect_right(times, at) - 1
        if n < 0 or n + 1 == len(times):
            return values[3 * max(n, 0) + 1] if cubic else values[max(n, 0)]
        width = times[n + 1] - times[n]
        t = (at - times[n]) / width
        if sampler["interpolation"] == "STEP":
            return values[n]
        if not cubic:
            one, other = values[n], values[n + 1]
            angle = acos(min(1.0, abs(float(one @ other))))
            other = other if one @ other >= 0 else -other
            return one if angle < 1e-9 else (sin((1 - t) * angle) * one + sin(t * angle) * other) / sin(angle)
        p0, m0, m1, p1 = values[3 * n + 1], values[3 * n + 2], values[3 * n + 3], values[3 * n + 4]
        return (
            (2 * t**3 - 3 * t**2 + 1) * p0 + width * (t**3 - 2 * t**2 + t) * m0
            + (-2 * t**3 + 3 * t**2) * p1 + width * (t**3 - t**2) * m1
        )  # fmt: skip

    def matrix(self, node: int, at: float) -> Any:
        x, y, z, w = self.look(node, "rotation", at)
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        found = np.eye(4)
        found[:3, :3], found[:3, 3] = turn * self.look(node, "scale", at), self.look(node, "translation", at)
        return self.matrix(self.parents[node], at) @ found if node in self.parents else found

    def place(self, node: int, at: float) -> Any:
        """In mm, z up."""
        x, y, z = self.matrix(node, at)[:3, 3] * 1000.0
        return np.array([x, -z, y])

    def called(self, name: str) -> list[int]:
        return [n for n, node in enumerate(self.data["nodes"]) if node["name"] == name]


def player_of(world: World, seconds: float, begin: Nanos = 0) -> Player:
    file = io.BytesIO()
    scene = recorded(world, seconds)
    write_glb(scene, file, begin, round(seconds * SECOND))
    return Player(file.getvalue())


LOADS: dict[str, tuple[Callable[[], World], Nanos]] = {
    "demo": (lambda: World.load(DEMO), 0),
    "palletizer": (lambda: World.load(EXAMPLES / "palletizer/palletizer.toml"), 4 * SECOND),
    "jaws": (lambda: World.from_toml(JAWS), 0),
    "swings": (lambda: World.from_toml(SWINGS), SECOND),
}
"""Worlds, and where their files begin."""


@pytest.mark.parametrize(("load", "begin"), LOADS.values(), ids=LOADS)
def test_everything_is_where_the_world_has_it(load: Callable[[], World], begin: Nanos) -> None:
    """Elements within 0.01 mm, and each workpiece where it is, once."""
    player = player_of(load(), 12.0, begin)
    world = load()
    for now in range(begin, 12 * SECOND, 377_777_777):
        world.advance(now)
        world.sync_all()
        at = (now - begin) / SECOND
        for name, mounted in world.objects.frames.items():
            (*_, node) = (
                player.called(name)[:1] if not mounted.movements else player.called(f"{name}.{mounted.movements[-1].signal}")
            )
            expected = np.array(pose(mounted.frame, FLOOR, now).at) / NM_PER_MM
            assert player.place(node, at) == pytest.approx(expected, abs=0.01), (name, now)
        for name, body in world.objects.workpieces.bodies().items():
            (node,) = [n for n in player.called(name) if player.look(n, "scale", at).any()]
            middle = np.array(pose(body.frame, FLOOR, now).at) / NM_PER_MM + [0, 0, half_height(body.shape) / NM_PER_MM]
            assert player.place(node, at) == pytest.approx(middle, abs=0.05), (name, now)


def test_the_validator_finds_nothing(require_peer: Callable[[str], str], tmp_path: Path) -> None:
    with NodeClient(require_peer("node"), "gltf.js", tmp_path) as client:
        for n, world in enumerate(
            [World.load(DEMO), World.load(EXAMPLES / "press/press.toml"), World.from_toml(JAWS), World.from_toml(SWINGS)]
        ):
            file = tmp_path / f"{n}.glb"
            with file.open("wb") as out:
                write_glb(recorded(world, 8.0), out, 0, 8 * SECOND)
            found = client("validate", file=str(file))
            assert found["messages"] == [], world.spec.name
            assert found["animations"] == 1


def test_at_most_ten_minutes() -> None:
    scene = recorded(World.load(EXAMPLES / "hoist/hoist.toml"), 0.5)
    with pytest.raises(Misuse, match=r"^601 s of motion: a glTF file has at most 600 s; choose a part with --from and --until$"):
        write_glb(scene, io.BytesIO(), 0, 601 * SECOND)
