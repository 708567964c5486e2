"""A machine in a run as a binary glTF 2.0 file, with keys at the ends of the polynomials of its motions.

Polynomials along a way are exact, but for single precision: a moment is rounded to a 2⁻²⁴ of itself, and the machine is at that
moment where its key says. Turns are linear between keys, at most `SLACK_DEG` from the motion. A workpiece has a node on each
element that carries it, which has a size only meanwhile.
"""

from __future__ import annotations

import json
import struct
from array import array
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from math import ceil, cos, radians, sin, sqrt
from typing import IO, Any, NamedTuple

from steptwin import __version__
from steptwin.controller import SECOND, Nanos
from steptwin.durations import duration_text
from steptwin.errors import Misuse
from steptwin.files.scene.cubics import Cubic
from steptwin.files.scene.recordedscene import RecordedScene, Stint
from steptwin.files.scene.scenescript import SceneScript
from steptwin.jsonvalues import to_json
from steptwin.subject.scene import MoveState

LONGEST_NS: Nanos = 600 * SECOND
SLACK_DEG = 0.01

_FLOAT, _SHORT = 5126, 5123
_ARRAY, _INDICES = 34962, 34963
_NO_SIZE = (0.0, 0.0, 0.0)


def write_glb(scene: RecordedScene, file: IO[bytes], begin: Nanos, until: Nanos) -> None:
    """Write what moves from ``begin``, which is 0 s there, to ``until``. Raises `Misuse` for more than ten minutes, and without
    the script that knows what elements look like."""
    if until - begin > LONGEST_NS:
        raise Misuse(
            f"{duration_text(until - begin)} of motion: a glTF file has at most {duration_text(LONGEST_NS)}; "
            "choose a part with --from and --until"
        )
    made = _Gltf(scene, begin, until)
    content = json.dumps(made.to_json(), separators=(",", ":"), ensure_ascii=False).encode()
    content += b" " * (-len(content) % 4)
    data = bytes(made.data) + b"\0" * (-len(made.data) % 4)
    file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(content) + 8 + len(data)))
    file.write(struct.pack("<I4s", len(content), b"JSON") + content)
    file.write(struct.pack("<I4s", len(data), b"BIN\0") + data)


class _Key(NamedTuple):
    """A value, and how fast it changes up to there and from there on, per second."""

    time: float
    value: float
    before: float
    after: float


class _Gltf:
    """The parts of a file while they are made. Nodes are in mm with z up, below one that has y up and m."""

    def __init__(self, scene: RecordedScene, begin: Nanos, until: Nanos) -> None:
        self.data = bytearray()
        self._scene, self._begin, self._until = scene, begin, max(until, begin + 1)
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._materials: dict[tuple[str, bool], int] = {}
        self._shapes: list[tuple[int, int, int]] = []
        self._meshes: dict[object, int] = {}
        self._list_of_meshes: list[dict[str, Any]] = []
        self._times: dict[tuple[float, ...], int] = {}
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        half = sqrt(0.5)
        top = {"name": scene.machine.name or "machine", "rotation": [-half, 0.0, 0.0, half], "scale": [0.001] * 3}
        self._nodes: list[dict[str, Any]] = [top]
        self._carrying: dict[str | None, int] = {None: 0}
        """Nodes that what is on an element hangs on."""
        self._standing: dict[str, int] = {}
        frames = {frame.name: frame for frame in scene.machine.scene.frames}
        for name in frames:
            self._add_frame(frames, name)
        self._add_solids(list(frames))

    def to_json(self) -> dict[str, object]:
        found: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"steptwin {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": self._nodes,
        }
        if self._list_of_meshes:
            materials = [_material(color, is_light=is_light) for color, is_light in self._materials]
            found |= {"meshes": self._list_of_meshes, "materials": materials}
        if self._channels:
            found["animations"] = [{"name": "run", "samplers": self._samplers, "channels": self._channels}]
        if self._accessors:
            buffers = [{"byteLength": len(self.data)}]
            found |= {"accessors": self._accessors, "bufferViews": self._views, "buffers": buffers}
        return found

    # ------------------------------------------------------------------ nodes

    def _node(self, on: int, name: str, **more: object) -> int:
        self._nodes.append({"name": name, **more})
        self._nodes[on].setdefault("children", []).append(len(self._nodes) - 1)
        return len(self._nodes) - 1

    def _add_frame(self, frames: Mapping[str, Any], name: str) -> None:
        if name in self._carrying:
            return
        frame = frames[name]
        if frame.on is not None:
            self._add_frame(frames, frame.on)
        node = self._standing[name] = self._node(self._carrying[frame.on], name, translation=list(frame.at))
        for joint in frame.joints:
            node = self._node(node, joint.signal)
            axis = [one * joint.per_unit for one in _direction(joint.along)]
            if joint.turns:
                self._turn(node, joint.signal, axis)
            else:
                self._move(node, joint.signal, (0.0, 0.0, 0.0), axis)
        self._carrying[name] = node

    def _add_solids(self, frames: Sequence[str]) -> None:
        scene = self._scene
        pieces = {name: place for name, stints in scene.workpieces.items() for _, place in stints[::-1] if place is not None}
        drawn = SceneScript().call("solids", to_json(scene.machine), to_json(tuple(pieces.values())))
        self._shapes = [self._shape(mesh["places"], mesh["normals"], mesh["indices"]) for mesh in drawn["meshes"]]
        for solid in drawn["solids"]:
            if solid["piece"] is not None:
                self._add_workpiece(solid["piece"], solid, scene.workpieces[solid["piece"]])
                continue
            carrying = self._carrying if solid["isCarried"] else self._standing
            name, size, slide = solid["element"], solid["size"], solid["slide"]
            node = self._node(carrying[frames[solid["frame"]]], name, translation=solid["at"], scale=size, mesh=self._mesh(solid))
            if slide is not None:
                self._move(node, slide["signal"], solid["at"], slide["by"])
            if solid["shown"] is not None:
                shown = [(cubic.begin, cubic.c0 > 0.0) for cubic in scene.motions.get(solid["shown"], [])]
                self._show(node, size, shown)

    def _add_workpiece(self, name: str, solid: Mapping[str, Any], stints: Sequence[Stint]) -> None:
        ends = [*(one.begin for one in stints[1:]), self._until + 1]
        for (begin, place), end in zip(stints, ends, strict=True):
            if place is None or end <= self._begin or begin > self._until:
                continue
            (x, y, z), (dx, dy, dz), half = place.at, solid["at"], radians(place.yaw) / 2.0
            c, s = cos(2.0 * half), sin(2.0 * half)
            at, size = [x + c * dx - s * dy, y + s * dx + c * dy, z + dz + place.height / 2.0], solid["size"]
            look = {"translation": at, "rotation": [0.0, 0.0, sin(half), cos(half)], "scale": size, "mesh": self._mesh(solid)}
            parent = self._carrying[place.on]
            for move in place.moves[1:]:
                parent = self._node(parent, name)
                self._go_on(parent, move, (0.0, 0.0, 0.0), begin, end)
            node = self._node(parent, name, **look)
            for move in place.moves[:1]:
                self._go_on(node, move, at, begin, end)
            self._show(node, size, [(self._begin, False), (begin, True), (end, False)])

    # ------------------------------------------------------------------ motions

    def _spans(self, signal: str, begin: Nanos, end: Nanos) -> list[tuple[Nanos, Cubic]]:
        """Polynomials from ``begin`` to ``end``, each with its end; none where the signal is unknown."""
        spans = self._scene.motions.get(signal, [])
        first = max(bisect_right(spans, begin, key=lambda one: one.begin) - 1, 0)
        last = bisect_right(spans, end, key=lambda one: one.begin)
        chosen = spans[first:last]
        ends = [*(one.begin for one in chosen[1:]), end]
        return [(until, one) for until, one in zip(ends, chosen, strict=True) if until > max(begin, one.begin)]

    def _go_on(self, node: int, move: MoveState, at: Sequence[float], begin: Nanos, end: Nanos) -> None:
        """A node goes on with a workpiece from ``at``."""
        by = [one * move.per_unit for one in _direction(move.along)]
        self._move(node, move.signal, at, by, move.at, begin, end)

    def _move(
        self,
        node: int,
        signal: str,
        at: Sequence[float],
        by: Sequence[float],
        zero: float = 0.0,
        begin: Nanos = 0,
        end: Nanos | None = None,
    ) -> None:
        """A node goes from ``at``, where it is while a signal is ``zero``, by so far for a unit of it."""
        begin, end = max(begin, self._begin), self._until if end is None else min(end, self._until)
        spans = self._spans(signal, begin, end)
        if not spans:
            return

        def place(value: float) -> list[float]:
            return [a + b * (value - zero) for a, b in zip(at, by, strict=True)]

        self._nodes[node]["translation"] = place(spans[0][1].at(max(begin, spans[0][1].begin)))
        if all(one.c1 == one.c2 == one.c3 == 0.0 and one.c0 == spans[0][1].c0 for _, one in spans):
            return
        ways = self._ways(spans, max(begin, spans[0][1].begin))
        if len(ways) > 1:
            values = [
                one for way in ways for one in ([b * way.before for b in by], place(way.value), [b * way.after for b in by])
            ]
            self._animate(node, "translation", [way.time for way in ways], list(chain(*values)), "VEC3", "CUBICSPLINE")

    def _ways(self, spans: Sequence[tuple[Nanos, Cubic]], begin: Nanos) -> list[_Key]:
        """Keys where polynomials meet, at moments of single precision."""
        found: list[_Key] = []
        moments = [begin, *(until for until, _ in spans)]
        for n, moment in enumerate(moments):
            before, after = (spans[n - 1][1] if n else None), (spans[n][1] if n < len(spans) else None)
            time = _single((moment - self._begin) / SECOND)
            now = self._begin + time * SECOND
            there = before if after is None or (before is not None and now < moment) else after
            slopes = [0.0 if one is None else one.slope(now) for one in (before, after)]
            if found and found[-1].time == time:
                found[-1] = found[-1]._replace(after=slopes[1])
            elif there is not None:
                found.append(_Key(time, there.at(now), *slopes))
        return found

    def _turn(self, node: int, signal: str, axis: Sequence[float]) -> None:
        """A node turns by so many degrees for a unit of a signal."""
        spans = self._spans(signal, self._begin, self._until)
        per_unit = next((one for one in axis if one != 0.0), 0.0)
        if not spans:
            return
        moments: list[Nanos] = [max(self._begin, spans[0][1].begin)]
        for until, one in spans:
            begin = moments[-1]
            seconds = (until - begin) / SECOND
            bend = max(abs(2.0 * one.c2 + 6.0 * one.c3 * (t - one.begin) / SECOND) for t in (begin, until))
            turned = abs(one.at(until) - one.at(begin)) + bend * seconds * seconds / 8.0
            count = max(1, ceil(seconds * sqrt(bend * abs(per_unit) / (8.0 * SLACK_DEG))), ceil(turned * abs(per_unit) / 90.0))
            moments += (begin + (until - begin) * k // count for k in range(1, count + 1))
        keys = self._keys(moments)
        starts = [max(self._begin, one.begin) for _, one in spans]

        def turn(time: float) -> list[float]:
            now = self._begin + round(time * SECOND)
            half = radians(spans[max(bisect_right(starts, now) - 1, 0)][1].at(now) * per_unit) / 2.0
            return [*(sin(half) * (1.0 if one else 0.0) for one in axis), cos(half)]

        self._nodes[node]["rotation"] = turn(keys[0])
        if all(one.c1 == one.c2 == one.c3 == 0.0 and one.c0 == spans[0][1].c0 for _, one in spans) or len(keys) < 2:
            return
        self._animate(node, "rotation", keys, [one for time in keys for one in turn(time)], "VEC4", "LINEAR")

    def _show(self, node: int, size: Sequence[float], changes: Iterable[tuple[Nanos, bool]]) -> None:
        """A node is there from some moments on, and not from others."""
        by_time: dict[float, bool] = {}
        for moment, is_there in changes:
            if moment <= self._until:
                by_time[_single(max(moment - self._begin, 0) / SECOND)] = is_there
        if not by_time:
            return
        self._nodes[node]["scale"] = size if by_time.get(0.0, True) else _NO_SIZE
        if len(set(by_time.values())) > 1:
            values = [one for is_there in by_time.values() for one in (size if is_there else _NO_SIZE)]
            self._animate(node, "scale", list(by_time), values, "VEC3", "STEP")

    def _keys(self, moments: Iterable[Nanos]) -> list[float]:
        """Seconds in single precision, each later than the one before."""
        found: list[float] = []
        for moment in moments:
            time = _single((moment - self._begin) / SECOND)
            if not found or time > found[-1]:
                found.append(time)
        return found

    def _animate(
        self, node: int, path: str, times: Sequence[float], values: Sequence[float], kind: str, interpolation: str
    ) -> None:
        key = tuple(times)
        if key not in self._times:
            self._times[key] = self._accessor(array("f", times), "SCALAR", with_range=True)
        sampler = {"input": self._times[key], "output": self._accessor(array("f", values), kind), "interpolation": interpolation}
        self._samplers.append(sampler)
        self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    # ------------------------------------------------------------------ shapes

    def _mesh(self, solid: Mapping[str, Any]) -> int:
        shape, look = solid["mesh"], (solid["color"], solid["material"] == "light")
        if (shape, look) not in self._meshes:
            places, normals, indices = self._shapes[shape]
            primitive = {
                "attributes": {"POSITION": places, "NORMAL": normals},
                "indices": indices,
                "material": self._materials.setdefault(look, len(self._materials)),
            }
            self._list_of_meshes.append({"primitives": [primitive]})
            self._meshes[shape, look] = len(self._list_of_meshes) - 1
        return self._meshes[shape, look]

    def _shape(self, places: Sequence[float], normals: Sequence[float], indices: Sequence[int]) -> tuple[int, int, int]:
        return (
            self._accessor(array("f", places), "VEC3", _ARRAY, with_range=True),
            self._accessor(array("f", normals), "VEC3", _ARRAY),
            self._accessor(array("H", indices), "SCALAR", _INDICES),
        )

    def _accessor(self, numbers: array[Any], kind: str, target: int | None = None, *, with_range: bool = False) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        content = struct.pack(f"<{len(numbers)}{numbers.typecode}", *numbers)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        self._views.append(view if target is None else {**view, "target": target})
        self.data += content
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[kind]
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": _FLOAT if numbers.typecode == "f" else _SHORT,
            "count": len(numbers) // width,
            "type": kind,
        }
        if with_range:
            accessor |= {name: [find(numbers[k::width]) for k in range(width)] for name, find in (("min", min), ("max", max))}
        self._accessors.append(accessor)
        return len(self._accessors) - 1


def _single(time: float) -> float:
    return struct.unpack("<f", struct.pack("<f", time))[0]


def _direction(along: str) -> list[float]:
    """``-z``: 0, 0, −1."""
    return [(-1.0 if along[0] == "-" else 1.0) if axis == along[1] else 0.0 for axis in "xyz"]


def _material(color: str, *, is_light: bool) -> dict[str, object]:
    """``#RRGGBB``, which is sRGB, where glTF takes linear values."""
    shares = [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    surface = {"baseColorFactor": [*linear, 0.3 if is_light else 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"pbrMetallicRoughness": surface, **({"alphaMode": "BLEND"} if is_light else {})}
