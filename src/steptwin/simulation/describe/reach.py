"""Warnings about cups and jaws that never come to a workpiece, beams that never see what they are for, belts that go on
elsewhere, and pushers that do not go far enough.

All that moves may be anywhere within its travel, independently; without a known travel anywhere. So a warning holds whatever the
machine does, and one that is not given says nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf
from typing import NamedTuple

from steptwin.messages import Message
from steptwin.simulation.components.beam import BEAM
from steptwin.simulation.components.beltspace import BeltSpace
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.bodytable import body_of
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.conveyortable import ConveyorSpec
from steptwin.simulation.components.frames import bodies_on
from steptwin.simulation.components.gripper import GRIPPER
from steptwin.simulation.components.mount import to_nm
from steptwin.simulation.components.nest import NEST
from steptwin.simulation.components.vacuum import VACUUM
from steptwin.simulation.components.workpieces import REACH_NM, WORKPIECES
from steptwin.simulation.describe.overlaps import DOUBTFUL
from steptwin.simulation.space.bodies import Body, Box, half_height
from steptwin.simulation.space.frames import AXES, NM_PER_MM, TURN_Q, Frame, Joint, Z
from steptwin.simulation.space.pieces import Range
from steptwin.simulation.space.sweeps import ROUNDING_NM, Sweep, swept
from steptwin.simulation.toml.reader import TomlText

TOO_HIGH = Message(
    "simulation.stays-too-high", "{tool} never comes to a workpiece: it stays {by:g} mm too high for those on {on}"
)
TOO_LOW = Message("simulation.stays-too-low", "{tool} never comes to a workpiece: it stays {by:g} mm too low for those on {on}")
BESIDE = Message(
    "simulation.stays-beside", "{tool} never comes to a workpiece: along {axis} it stays {by:g} mm beside those on {on}"
)
SEES_NOTHING = Message("simulation.beam-never-sees", "{beam} never sees {what}: along {axis} they stay {by:g} mm apart")

BELTS_APART = Message(
    "simulation.belts-apart", "{belt} goes on to {next}, but along {axis} its end stays {by:g} mm away from the beginning of that"
)
NOT_PUSHED_OFF = Message(
    "simulation.not-pushed-off", "{pusher} does not push workpieces off {belt}: their middle comes to {by:g} mm before its edge"
)
PUSH_FARTHER = Message(
    "simulation.push-farther-hint", "a workpiece leaves when its middle is beyond the edge: more than {by:g} mm farther"
)


def check_reach(text: TomlText, objects: BuiltObjects) -> None:
    """Warn of cups, jaws, beams, belts and pushers that do not do what they are for."""
    _Reach(text, objects).check()


class _Tool(NamedTuple):
    """A cup or jaws. It takes what has its top at most ``above`` nm below its origin, and its bottom at most ``below`` nm above
    that."""

    name: str
    path: tuple[str | int, ...]
    point: Body
    above: int
    below: int


class _Support(NamedTuple):
    """A face, and the height above it of the workpieces that come to be on it without anything that takes some, nm; None where
    none do."""

    face: Body
    tops: int | None


class _Miss(NamedTuple):
    """How far two things always stay apart: the most along an axis, whose sign is that from the second to the first."""

    by: float
    axis: int
    sign: int


class _Reach:
    def __init__(self, text: TomlText, objects: BuiltObjects) -> None:
        self._text = text
        self._described = objects.described
        self._frames = frames = objects.frames
        self._bodies = {one.name: body_of(one, frames) for one in objects.described.of(BODY)}
        self._tools = [*self._find_tools()]
        belts = objects.described.of(CONVEYOR)
        nests = [nest for nest in objects.described.of(NEST) if nest.filled and nest.workpiece is not None]
        sizes = [size for size in (*(belt.workpiece for belt in belts), *(nest.workpiece for nest in nests)) if size is not None]
        self._heights = [to_nm(size[-1]) for size in sizes]
        self._aside = max((to_nm(sum(size[:-1])) for size in sizes), default=0)
        """No workpiece reaches farther from its middle."""
        self._supports = [*self._find_supports(objects)]

    def _find_tools(self) -> Iterator[_Tool]:
        for cup in self._described.of(VACUUM):
            if cup.is_mounted:
                yield _Tool(cup.name, cup.path, self._point(cup.name), to_nm(cup.reach), REACH_NM)
        for jaws in self._described.of(GRIPPER):
            if jaws.is_mounted:
                yield _Tool(jaws.name, jaws.path, self._point(jaws.name), -to_nm(jaws.overlap), to_nm(jaws.overlap))

    def _point(self, name: str) -> Body:
        return Body(name, self._frames.base(name), Box((0, 0, 0)))

    def _find_supports(self, objects: BuiltObjects) -> Iterator[_Support]:
        on_belts = [to_nm(belt.workpiece[-1]) for belt in self._described.of(CONVEYOR)]
        for name, belt in objects.built(CONVEYOR).items():
            if name in self._frames:
                (face,) = BeltSpace(belt, self._frames).supports()
                yield _Support(face, max(on_belts))
        for nest in self._described.of(NEST):
            (nx, ny), height = nest.cells, 0 if nest.workpiece is None else to_nm(nest.workpiece[-1])
            tops = -(-nest.filled // (nx * ny)) * height if nest.filled and height else None
            yield _Support(nest.bottom(self._frames.base(nest.name)), tops)
        for spec in self._described.of(BODY):
            if spec.holds_workpieces:
                body = self._bodies[spec.name]
                (x, y, z), half = body.centre, half_height(body.shape)
                flat = Box((*body.shape.half[:2], 0)) if isinstance(body.shape, Box) else Box((body.shape.radius,) * 2 + (0,))
                yield _Support(Body(body.name, body.frame, flat, (x, y, z + half)), None)

    def check(self) -> None:
        if self._heights:
            self._check_tools()
        self._check_beams()
        self._check_belts()
        self._check_pushers()

    # ------------------------------------------------------------------ cups and jaws

    def _check_tools(self) -> None:
        first = {tool.name: [*self._misses(tool, are_moved=False)] for tool in self._tools}
        are_moved = any(miss is None for misses in first.values() for miss, _ in misses)
        for tool in self._tools:
            misses = [*self._misses(tool, are_moved=True)] if are_moved else first[tool.name]
            found = [(miss, on) for miss, on in misses if miss is not None]
            if found and len(found) == len(misses) and not (are_moved and self._meets_another(tool)):
                (by, axis, sign), on = min(found, key=lambda one: one[0].by)
                mm = by / NM_PER_MM
                if axis == Z:
                    message = (TOO_HIGH if sign > 0 else TOO_LOW)(tool=tool.name, on=on, by=mm)
                else:
                    message = BESIDE(tool=tool.name, on=on, by=mm, axis=AXES[axis])
                self._text.warn(self._place(tool.path), DOUBTFUL, message)

    def _misses(self, tool: _Tool, *, are_moved: bool) -> Iterator[tuple[_Miss | None, str]]:
        """How far a tool stays away from workpieces on each support. ``are_moved``: others may have put some on any of them."""
        for face, tops in self._supports:
            if tops is None and not are_moved:
                continue
            high = inf if are_moved or tops is None else tops
            point, around = self._together(tool.point, face)
            yield _apart(point, self._grown(around, -tool.below, high + tool.above)), face.name

    def _meets_another(self, tool: _Tool) -> bool:
        """Whether it may take a workpiece that another one holds."""
        others = (self._together(tool.point, one.point) for one in self._tools if one is not tool)
        return any(_apart(point, self._grown(around, -inf, inf)) is None for point, around in others)

    def _grown(self, around: Sweep, low: float, high: float) -> Sweep:
        """Where workpieces may be above a face: all around, and between two heights."""
        (x, y, z), (u, v, w), aside = around.low, around.high, self._aside
        return Sweep((x - aside, y - aside, z + low), (u + aside, v + aside, w + high))

    def _place(self, path: tuple[str | int, ...]) -> tuple[str | int, ...]:
        at = (*path, "at")
        return at if self._text.is_given(at) else path

    # ------------------------------------------------------------------ beams

    def _check_beams(self) -> None:
        for beam in self._described.of(BEAM):
            rays = [*beam.segments(self._frames.base(beam.name), beam.hysteresis)]
            for wanted in beam.sees:
                if wanted == WORKPIECES:
                    misses = [*self._misses_of_workpieces(rays)]
                else:
                    names = bodies_on(self._frames[wanted], self._bodies, wanted)
                    misses = [_apart(*self._together(ray, self._bodies[name])) for ray in rays for name in names]
                found = [miss for miss in misses if miss is not None]
                if found and len(found) == len(misses):
                    by, axis, _ = min(found, key=lambda one: one.by)
                    message = SEES_NOTHING(beam=beam.name, what=wanted, by=by / NM_PER_MM, axis=AXES[axis])
                    self._text.warn(
                        (*beam.path, "sees") if self._text.is_given((*beam.path, "sees")) else beam.path, DOUBTFUL, message
                    )

    def _misses_of_workpieces(self, rays: Iterable[Body]) -> Iterator[_Miss | None]:
        """Seen from the floor: workpieces are where supports are, and where tools carry them or let them fall."""
        if not self._heights:
            return
        held = [swept(tool.point, self._range) for tool in self._tools]
        highest = max((one.high[Z] + max(self._heights) for one in held), default=-inf)
        places = [self._grown(one, -inf, max(self._heights)) for one in held]
        for face, tops in self._supports:
            if tops is not None or held:
                around = swept(face, self._range)
                low, (x, y, z) = self._grown(around, 0, tops or 0)
                places.append(Sweep(low, (x, y, max(z, highest))))
        for ray in rays:
            yield from (_apart(swept(ray, self._range), place) for place in places)

    # ------------------------------------------------------------------ belts

    def _check_belts(self) -> None:
        """Warn where workpieces would fly from belt to belt: over more than the largest of them, besides half of both widths."""
        belts = {belt.name: belt for belt in self._described.of(CONVEYOR)}
        for belt in belts.values():
            following = None if belt.next is None else belts.get(belt.next)
            if following is None or belt.name not in self._frames or following.name not in self._frames:
                continue
            end, begin = [0, 0, 0], self._point(following.name)
            towards = belt.towards()
            end[towards.axis] = towards.sign * to_nm(belt.length)
            last = Body(belt.name, self._frames.base(belt.name), Box((0, 0, 0)), (end[0], end[1], end[2]))
            around, there = self._together(last, begin)
            largest = max(self._aside, *self._heights)
            room = largest + (to_nm(belt.width) + to_nm(following.width)) // 2
            (x, y, z), (u, v, w) = there
            grown = Sweep((x - room, y - room, z - largest), (u + room, v + room, w + largest))
            if _apart(around, grown) is not None and (miss := _apart(around, there)) is not None:
                by = miss.by / NM_PER_MM
                message = BELTS_APART(belt=belt.name, next=following.name, by=by, axis=AXES[miss.axis])
                self._text.warn((*belt.path, "next"), DOUBTFUL, message)

    # ------------------------------------------------------------------ pushers

    def _check_pushers(self) -> None:
        """Warn of those that let workpieces hang over the edge of a belt, and leave them on it."""
        for spec in self._described.of(BODY):
            for belt in self._described.of(CONVEYOR) if spec.pushes else ():
                missing = self._missing(self._bodies[spec.name], belt) if belt.name in self._frames else None
                if missing is not None:
                    by = round(missing / NM_PER_MM, 3)
                    message = NOT_PUSHED_OFF(pusher=spec.name, belt=belt.name, by=by)
                    self._text.warn(spec.path, DOUBTFUL, message, PUSH_FARTHER(by=by))

    def _missing(self, pusher: Body, belt: ConveyorSpec) -> float | None:
        """How far before its edge the workpieces in the middle of a belt have their own middle when a pusher has gone as far as
        it may; None unless all of them hang over the edge then, and stay."""
        its, point = self._together(pusher, self._point(belt.name))
        (along, sign), edge, margin = belt.towards(), to_nm(belt.width) / 2, 4 * ROUNDING_NM
        across, ends = 1 - along, sorted((0, sign * to_nm(belt.length)))
        coming = self._coming_to(belt)
        if not coming or point.high[across] - point.low[across] > margin:
            return None  # it moves across itself
        is_beside = its.high[along] <= point.low[along] + ends[0] or its.low[along] >= point.high[along] + ends[1]
        highest = point.high[Z] + max(to_nm(one.workpiece[-1]) for one in coming)
        if is_beside or its.high[Z] <= point.low[Z] or its.low[Z] >= highest:
            return None
        halves = [to_nm((*one.workpiece[:-1], one.workpiece[0])[one.towards().axis == along]) / 2 for one in coming]
        low, high = its.low[across] - point.low[across], its.high[across] - point.high[across]
        shape = pusher.shape
        thick = 2 * (shape.half[across] if isinstance(shape, Box) else shape.radius)
        for first, last in ((low + thick, high), (thick - high, -low)):  # its face, on the way to one side and to the other
            left = [edge - last - half for half in halves]
            comes = all(first <= margin - half and half <= edge for half in halves)
            if comes and all(-margin <= by < half for by, half in zip(left, halves, strict=True)):
                return max(0.0, *left)
        return None

    def _coming_to(self, belt: ConveyorSpec) -> list[ConveyorSpec]:
        """The conveyors whose workpieces come along one, as far as they say how large those are."""
        found = {belt.name: belt}
        for _ in self._described.of(CONVEYOR):
            found |= {one.name: one for one in self._described.of(CONVEYOR) if one.next in found}
        return [one for one in found.values() if self._text.is_given((*one.path, "workpiece"))]

    # ------------------------------------------------------------------ where things may be

    def _together(self, one: Body, other: Body) -> tuple[Sweep, Sweep]:
        """Where two bodies may be, seen from the last frame that both are on."""
        line = one.frame.line()
        common = next((frame for frame in other.frame.line() if any(frame is its for its in line)), None)
        return swept(one, self._range, common), swept(other, self._range, common)

    def _range(self, frame: Frame, joint: Joint) -> Range:
        movement = self._frames.movement(frame)
        if joint.turns:
            return 0.0, float(TURN_Q)
        if movement is None or movement.travel is None:
            return -inf, inf
        low, high = (end * movement.per_unit * NM_PER_MM for end in movement.travel)
        return low, high


def _apart(one: Sweep, other: Sweep) -> _Miss | None:
    """None where they meet."""
    margin = 2 * ROUNDING_NM
    misses = [
        miss
        for axis in range(len(AXES))
        for miss in (
            _Miss(one.low[axis] - other.high[axis] + margin, axis, 1),
            _Miss(other.low[axis] - one.high[axis] + margin, axis, -1),
        )
    ]
    most = max(misses, key=lambda miss: miss.by)
    return most if most.by > margin else None
