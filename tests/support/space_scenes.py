"""Random scenes of two bodies on moving frames, and a model of them in numpy that shares no code with the search.

The model samples every 10 µs and then bisects to 0.1 ns. It turns by radians and has corners in the coordinates of the floor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random

import numpy as np

from steptwin.controller import SECOND, Nanos
from steptwin.motion.profile import Profile, Segment, ramp
from steptwin.motion.profile import cruise as cruising
from steptwin.simulation.space.bodies import Body, Box, Cylinder
from steptwin.simulation.space.frames import FLOOR, Direction, Frame, Joint
from steptwin.simulation.space.pieces import Motion, pieces_of_profile, standing

MM = 10**6
SAMPLE_S = 10e-6
LONG_NS = 10_000
"""A contact or a gap that is longer cannot be between two samples."""
END_NS = 400_000_000


@dataclass
class Move:
    """Speeds at moments, linear between them."""

    times: list[float]
    speeds: list[float]
    start: float

    def positions(self, t: np.ndarray) -> np.ndarray:
        times, speeds = np.array(self.times), np.array(self.speeds)
        lengths = np.diff(times)
        begins = self.start + np.concatenate(([0.0], np.cumsum(0.5 * (speeds[:-1] + speeds[1:]) * lengths)))
        n = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        rest = np.minimum(t, times[-1]) - times[n]
        return begins[n] + speeds[n] * rest + 0.5 * (np.diff(speeds) / lengths)[n] * rest * rest

    def profile(self) -> Profile:
        segments: list[Segment] = []
        at = self.start
        for (t0, v0), (t1, v1) in pairwise(zip(self.times, self.speeds, strict=True)):
            segments.append(ramp(t0, at, v0, v1, abs(v1 - v0) / (t1 - t0)) if v0 != v1 else cruising(t0, t1, at, v0))
            at += 0.5 * (v0 + v1) * (t1 - t0)
        return Profile(0, 0, tuple(segments), at)


@dataclass
class Link:
    """What a frame does with what is on it."""

    at: tuple[int, int, int]
    axis: int
    sign: int
    turns: bool
    move: Move | float


@dataclass
class Part:
    """A body with its links, from the floor on."""

    links: list[Link]
    half: tuple[int, int, int] | None
    cylinder: tuple[int, int] | None
    centre: tuple[int, int, int]

    @property
    def size(self) -> tuple[int, int, int]:
        """Halves of the box around it."""
        if self.cylinder is not None:
            return self.cylinder[0], self.cylinder[0], self.cylinder[1]
        return self.half or (0, 0, 0)


@dataclass
class Scene:
    axis: int
    """About which everything turns."""
    shared: int
    """The number of links from the floor that both have."""
    parts: tuple[Part, Part]


# ---------------------------------------------------------------------- scenes


def random_scene(seed: int) -> Scene:
    chance = Random(seed)
    axis = chance.choice((2, 2, 2, 0, 1))
    may_turn = chance.random() < 0.6
    shared = [_link(chance, axis, may_turn) for _ in range(chance.choice((0, 0, 1, 2)))]
    parts = [
        Part(
            [*shared, *(_link(chance, axis, may_turn) for _ in range(chance.choice((0, 1, 1, 2)) + n))],
            *_shape(chance, axis),
            _vector(chance, 40, axis, 5),
        )
        for n in (0, 1)
    ]
    return Scene(axis, len(shared), (parts[0], parts[1]))


def _shape(chance: Random, axis: int) -> tuple[tuple[int, int, int] | None, tuple[int, int] | None]:
    if axis == 2 and chance.random() < 0.35:
        return None, (chance.randint(5 * MM, 40 * MM), chance.randint(5 * MM, 30 * MM))
    half = [chance.randint(5 * MM, 60 * MM) for _ in range(3)]
    if chance.random() < 0.2:
        beam = chance.randrange(3)
        half = [one if n == beam else 0 for n, one in enumerate(half)]
    return (half[0], half[1], half[2]), None


def _vector(chance: Random, most: int, axis: int, most_along: int) -> tuple[int, int, int]:
    x, y, z = (chance.randint(-most * MM, most * MM) if n != axis else chance.randint(-most_along * MM, 0) for n in range(3))
    return x, y, z


def _link(chance: Random, axis: int, may_turn: bool) -> Link:
    turns = may_turn and chance.random() < 0.5
    about = axis if turns else chance.choice([n for n in range(3) if n != axis] * 3 + [axis])
    fast = 6.0 if turns else 800.0 * MM
    move: Move | float = _move(chance, fast)
    if turns and chance.random() < 0.2:
        move = chance.choice((0.5, 1.0, chance.uniform(-2.0, 2.0)))
    return Link(_vector(chance, 60, axis, 5), about, chance.choice((1, -1)), turns, move)


def _move(chance: Random, fast: float) -> Move:
    times, speeds = [0.0], [0.0]
    while times[-1] < 0.35:
        target = 0.0 if speeds[-1] and chance.random() < 0.3 else chance.uniform(-fast, fast)
        if target * speeds[-1] < 0.0:
            target = 0.0
        for speed, most in ((target, 0.06), (target, 0.1)):
            times.append(times[-1] + chance.uniform(0.01, most))
            speeds.append(speed)
        if speeds[-1] == 0.0 and speeds[-2] == 0.0:
            times[-1], speeds[-1] = times[-2] + 0.02, chance.uniform(-fast, fast)
    times.append(times[-1] + 0.03)
    speeds.append(0.0)
    return Move(times, speeds, 0.0)


def bodies_of(scene: Scene) -> tuple[Body, Body]:
    shared = FLOOR
    for link in scene.parts[0].links[: scene.shared]:
        shared = _frame(link, shared)
    found = []
    for n, part in enumerate(scene.parts):
        frame = shared
        for link in part.links[scene.shared :]:
            frame = _frame(link, frame)
        shape = Box(part.half) if part.half is not None else Cylinder(*(part.cylinder or (1, 1)))
        found.append(Body(f"body{n}", frame, shape, part.centre))
    return found[0], found[1]


def _frame(link: Link, on: Frame) -> Frame:
    motion = standing(link.move) if isinstance(link.move, float) else motion_of(link.move.profile())
    return Frame("frame", on, link.at, Joint(motion, Direction(link.axis, link.sign), link.turns))


def motion_of(profile: Profile) -> Motion:
    return Motion(lambda: profile, lambda now: pieces_of_profile(profile, now))


# ---------------------------------------------------------------------- the model


class Model:
    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def depth(self, t: np.ndarray) -> np.ndarray:
        """By how many nm they overlap at moments in s; negative while they are apart."""
        axis = self.scene.axis
        u, v = (axis + 1) % 3, (axis + 2) % 3
        places = [self._place(part, t) for part in self.scene.parts]
        sizes = [part.size for part in self.scene.parts]
        along = np.abs(places[0][0][axis] - places[1][0][axis]) - sizes[0][axis] - sizes[1][axis]
        found = along
        if all(part.cylinder for part in self.scene.parts):
            across = np.hypot(places[0][0][u] - places[1][0][u], places[0][0][v] - places[1][0][v]) - sizes[0][0] - sizes[1][0]
            return -np.maximum(found, across)
        corners = [
            self._corners(place, angle, (part.half[u], part.half[v]), u, v)
            for part, (place, angle) in zip(self.scene.parts, places, strict=True)
            if part.half
        ]
        if len(corners) == 2:
            for _, angle in places:
                for more in (0.0, np.pi / 2):
                    c, s = np.cos(angle + more), np.sin(angle + more)
                    ways = [np.stack([c * x + s * y for x, y in those]) for those in corners]
                    lows, highs = [w.min(axis=0) for w in ways], [w.max(axis=0) for w in ways]
                    found = np.maximum(found, np.maximum(lows[0] - highs[1], lows[1] - highs[0]))
            return -found
        box, disc = (0, 1) if self.scene.parts[0].half else (1, 0)
        (centre, angle), (place, _) = places[box], places[disc]
        half = self.scene.parts[box].half or (0, 0, 0)
        du, dv = place[u] - centre[u], place[v] - centre[v]
        c, s = np.cos(angle), np.sin(angle)
        x, y = np.abs(c * du + s * dv) - half[u], np.abs(c * dv - s * du) - half[v]
        far = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0)) + np.minimum(np.maximum(x, y), 0.0)
        return -np.maximum(found, far - sizes[disc][0])

    def _place(self, part: Part, t: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        """The centre and the angle, rad, on the floor."""
        u, v = (self.scene.axis + 1) % 3, (self.scene.axis + 2) % 3
        place, angle = [np.zeros_like(t) for _ in range(3)], np.zeros_like(t)

        def shift(by: list[np.ndarray | float]) -> None:
            c, s = np.cos(angle), np.sin(angle)
            place[self.scene.axis] = place[self.scene.axis] + by[self.scene.axis]
            place[u], place[v] = place[u] + c * by[u] - s * by[v], place[v] + s * by[u] + c * by[v]

        for link in part.links:
            shift(list(link.at))
            way = np.full_like(t, link.move) if isinstance(link.move, float) else link.move.positions(t)
            if link.turns:
                angle = angle + link.sign * way * (np.pi / 2)
            else:
                shift([link.sign * way if n == link.axis else 0.0 for n in range(3)])
        shift(list(part.centre))
        return place, angle

    @staticmethod
    def _corners(
        place: list[np.ndarray], angle: np.ndarray, half: tuple[int, int], u: int, v: int
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        c, s = np.cos(angle), np.sin(angle)
        signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
        return [(place[u] + c * a * half[0] - s * b * half[1], place[v] + s * a * half[0] + c * b * half[1]) for a, b in signs]

    def touches(self, t: np.ndarray) -> np.ndarray:
        return self.depth(t) > 0.5

    def changes(self) -> list[float]:
        """The moments, ns, at which contacts begin and end, in turn, as far as samples show them."""
        t = np.arange(0.0, END_NS / SECOND + SAMPLE_S, SAMPLE_S)
        there = self.touches(t)
        found = []
        for n in np.flatnonzero(there[1:] != there[:-1]):
            low, high = float(t[n]), float(t[n + 1])
            while high - low > 1e-10:
                middle = 0.5 * (low + high)
                low, high = (middle, high) if self.touches(np.array([middle]))[0] == there[n] else (low, middle)
            found.append(high * SECOND)
        return found

    def at(self, now: Nanos) -> float:
        """Depth at a moment, nm."""
        return float(self.depth(np.array([now / SECOND]))[0])

    def deepest(self) -> tuple[Nanos, float]:
        """When they overlap most, and by how much: the best sample, and what is near it."""
        begin, end = 0.0, END_NS / SECOND
        for _ in range(3):
            t = np.linspace(begin, end, 2001)
            depths = self.depth(t)
            best = int(depths.argmax())
            begin, end = t[max(best - 1, 0)], t[min(best + 1, 2000)]
        return round(t[best] * SECOND), float(depths[best])


def grown(scene: Scene, more: int) -> Scene:
    """The scene with a greater first body."""
    part = scene.parts[0]
    half = None if part.half is None else (part.half[0] + more, part.half[1] + more, part.half[2] + more)
    cylinder = None if part.cylinder is None else (part.cylinder[0] + more, part.cylinder[1] + more)
    return replace(scene, parts=(replace(part, half=half, cylinder=cylinder), scene.parts[1]))


def grazing(scene: Scene) -> tuple[Scene, Scene] | None:
    """Two scenes, a nm apart in size: in the first the bodies pass each other, in the second they touch. None where they touch
    already, or are far from it."""
    low, high = 0, 1 << 27
    if Model(scene).deepest()[1] > 0.5 or Model(grown(scene, high)).deepest()[1] <= 0.5:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if Model(grown(scene, middle)).deepest()[1] > 0.5 else (middle, high)
    return grown(scene, low), grown(scene, high)
