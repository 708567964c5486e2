"""Warnings about bodies and nests that lie in bodies when the world begins, where nobody looks for their contacts, or that hang
just above one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, product

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.motion.trig import length
from steptwin.simulation.components.body import BODY
from steptwin.simulation.components.bodytable import BodySpec, body_of
from steptwin.simulation.components.builtobjects import BuiltObjects
from steptwin.simulation.components.collision import COLLISION
from steptwin.simulation.components.frames import Frames, bodies_on
from steptwin.simulation.components.mount import Movement, to_nm
from steptwin.simulation.components.nest import NEST
from steptwin.simulation.components.nesttable import NestSpec
from steptwin.simulation.components.workpieces import WORKPIECES
from steptwin.simulation.space.bodies import OVERLAP_NM, Body, Box, Placed, contains, gap
from steptwin.simulation.space.contacts import Pair
from steptwin.simulation.space.frames import HERE, NM_PER_MM, Frame, Joint, X, Y, Z, along
from steptwin.simulation.space.pieces import Range
from steptwin.simulation.space.sweeps import ROUNDING_NM, Sweep, meet, swept
from steptwin.simulation.toml.reader import TomlText

DOUBTFUL = "D011"
START: Nanos = 0

OVERLAP = Message("simulation.bodies-overlap", "{one} and {other} overlap by {by:g} mm when the world begins")
LIES_INSIDE = Message("simulation.lies-inside", "{one} lies inside {other}")
STANDS_IN = Message("simulation.stands-in", "{one} stands {by:g} mm deep in {on}, which it is on")
MAY_OVERLAP = Message("simulation.may-overlap-hint", "if they may, a [[collision]] with except = [['{one}', '{other}']] says so")
GIVE_AT = Message("simulation.give-at-hint", "without at it is at the middle of the lower face of {on}")
HANGS = Message("simulation.hangs", "{one} hangs in the air, {by:g} mm above {other}")
LEAST_AIR_NM = 5_000_000
"""Below so much air something was meant to stand there. Above it, what it stands on may just not be described."""
NEST_INSIDE = Message("simulation.nest-inside", "workpieces in {nest} are inside {body}, whose top is {by:g} mm above it")


def check_overlaps(text: TomlText, objects: BuiltObjects) -> None:
    """Warn of bodies and nests that lie in bodies. Bodies that come and go are left out."""
    frames = objects.frames
    described = {one.name: one for one in objects.described.of(BODY)}
    every = {name: body_of(one, frames) for name, one in described.items()}
    lasting = {name: one for name, one in described.items() if one.when is None}
    permitted = {
        frozenset(pair)
        for collision in objects.described.of(COLLISION)
        for one, other in collision.apart_from
        if WORKPIECES not in (one, other)
        for pair in product(*(bodies_on(frames[name], every, name) for name in (one, other)))
    }
    around = {name: swept(every[name], _present) for name in lasting}
    for one, other in combinations(lasting.values(), 2):
        if meet(around[one.name], around[other.name]) and frozenset((one.name, other.name)) not in permitted:
            _check_pair(text, frames, (one, every[one.name]), (other, every[other.name]))
    for nest in objects.described.of(NEST):
        for name in lasting:
            _check_nest(text, frames, nest, every[name])
    for its in lasting.values():
        _check_air(text, frames, its, around)


def _present(frame: Frame, joint: Joint) -> Range:
    position = joint.motion.at(START)
    return position, position


def _pair(one: Body, other: Body) -> Pair | None:
    """Two bodies that overlap when the world begins; None where they do not, or where that is not calculated."""
    try:
        pair = Pair(one, other)
    except Misuse:
        return None
    return pair if pair.overlap(START) else None


def _check_pair(text: TomlText, frames: Frames, one: tuple[BodySpec, Body], other: tuple[BodySpec, Body]) -> None:
    pair = _pair(one[1], other[1])
    if pair is None:
        return
    placed = _placed(pair, _positions(pair))
    by = -gap(*placed).apart / NM_PER_MM
    moved = frames.between(one[1].frame, other[1].frame)
    if moved:
        if not _stay_together(pair, moved, frames):
            message = OVERLAP(one=one[0].name, other=other[0].name, by=by)
            text.warn(_place(text, other[0]), DOUBTFUL, message, MAY_OVERLAP(one=one[0].name, other=other[0].name))
        return
    for (spec, _), (outer, _), (its, around) in ((other, one, (placed[1], placed[0])), (one, other, (placed[0], placed[1]))):
        if spec.on == outer.name and spec.at is None:
            text.warn(spec.path, DOUBTFUL, STANDS_IN(one=spec.name, on=outer.name, by=by), GIVE_AT(on=outer.name))
            return
        if contains(around, its):
            text.warn(_place(text, spec), DOUBTFUL, LIES_INSIDE(one=spec.name, other=outer.name))
            return


def _check_air(text: TomlText, frames: Frames, spec: BodySpec, around: Mapping[str, Sweep]) -> None:
    """Warn of a body that touches none, and is just above one that it does not move against."""
    its = around[spec.name]
    others = {name: other for name, other in around.items() if name != spec.name}
    if any(all(_is_beside(its, other, axis, ROUNDING_NM) for axis in (X, Y, Z)) for other in others.values()):
        return
    above = {
        name: its.low[Z] - other.high[Z] for name, other in others.items() if all(_is_beside(its, other, k, 0.0) for k in (X, Y))
    }
    near = {name: gap for name, gap in above.items() if 0.0 < gap <= LEAST_AIR_NM}
    below = min(near, key=near.__getitem__, default=None)
    if below is not None and not frames.between(frames[spec.name].frame, frames[below].frame):
        text.warn(_place(text, spec), DOUBTFUL, HANGS(one=spec.name, other=below, by=near[below] / NM_PER_MM))


def _is_beside(one: Sweep, other: Sweep, axis: int, margin: float) -> bool:
    """Whether they have a place along an axis in common, or one within a margin."""
    return one.low[axis] < other.high[axis] + margin and other.low[axis] < one.high[axis] + margin


def _place(text: TomlText, spec: BodySpec | NestSpec) -> tuple[str | int, ...]:
    at = (*spec.path, "at")
    return at if text.is_given(at) else spec.path


def _positions(pair: Pair) -> list[float]:
    return [0.0 if step.motion is None else step.motion.at(START) for step in pair.steps]


def _placed(pair: Pair, positions: Sequence[float]) -> tuple[Placed, Placed]:
    at = along(pair.steps, positions, pair.axis)[-1]
    (one, other), (centre, other_centre) = pair.outlines, pair.centres
    return Placed.at(one, centre, HERE), Placed.at(other, other_centre, at)


def _stay_together(pair: Pair, moved: Sequence[Movement], frames: Frames) -> bool:
    """Whether two bodies that overlap always do, as a slide and its rail or the parts of a hinge, or it is not known."""
    if any(one.turns for one in moved):
        return len(moved) > 1 or _is_hinge(pair)
    positions = _positions(pair)
    ends: list[tuple[float, ...]] = []
    for n, step in enumerate(pair.steps):
        movement = None if n not in pair.moving else frames.movement(step.frame)
        if n not in pair.moving:
            ends.append((positions[n],))
        elif movement is None or movement.travel is None:
            return True
        else:
            ends.append(tuple(end * movement.per_unit * NM_PER_MM for end in movement.travel))
    return all(gap(*_placed(pair, those)).apart < OVERLAP_NM for those in product(*ends))


def _is_hinge(pair: Pair) -> bool:
    """Whether the line about which they turn goes through both."""
    n, step = next((n, step) for n, step in enumerate(pair.steps) if step.turns)
    u, v, _ = along(pair.steps, _positions(pair), pair.axis)[n if step.is_back else n + 1].place
    return all(length(*one.corner_from(u, v)) <= one.outline.radius for one in _placed(pair, _positions(pair)))


def _check_nest(text: TomlText, frames: Frames, nest: NestSpec, body: Body) -> None:
    """Warn of a nest whose workpieces do not come out of a body that it moves with."""
    bottom = nest.bottom(frames.base(nest.name))
    if frames.between(bottom.frame, body.frame):
        return
    half = to_nm((nest.workpiece or (0.001,))[-1]) // 2
    (x, y, _), shape = bottom.centre, bottom.shape
    if not isinstance(shape, Box):
        return
    pair = _pair(Body(nest.name, bottom.frame, Box((*shape.half[:2], half)), (x, y, half)), body)
    if pair is None or pair.axis != Z:
        return
    its, around = _placed(pair, _positions(pair))
    below = around.place[2] + around.outline.half_w - its.place[2] - its.outline.half_w
    if below >= 0.0 and its.place[2] - its.outline.half_w >= around.place[2] - around.outline.half_w:
        by = (below + 2.0 * its.outline.half_w) / NM_PER_MM
        text.warn(_place(text, nest), DOUBTFUL, NEST_INSIDE(nest=nest.name, body=body.name, by=by))
