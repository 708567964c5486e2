"""Courses, profiles and stretches of motions as text, to the nanosecond."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from steptwin.machine import MILLISECOND, Nanos
from steptwin.motion import Profile
from steptwin.motion.divisions import Plan
from steptwin.motion.elastic import DriveStretch
from steptwin.simulation.mechanics.course import Build, Course, CoursePiece, MechanicalState
from steptwin.simulation.mechanics.free import slow_from
from steptwin.simulation.mechanics.loadmotion import load_stretches


def piece_text(piece: CoursePiece, of: Nanos) -> str:
    rotor, load = ((f"{value:+}" if follows else f"at {value}") for follows, value in (piece[2:4], piece[4:6]))
    state = f"{' stalled' if piece.stalled else ''}{f' behind {piece.behind}' if piece.behind else ''}"
    state += f" stop {piece.stop}" if piece.stop else ""
    return f"  {piece.begin - of} {'↑' if piece.direction > 0 else '↓'} rotor {rotor} load {load}{state}"


def course_text(
    build: Build, plan: Plan, state: MechanicalState, more: dict[str, object], begin: Nanos, of: Nanos
) -> Iterator[str]:
    course = Course(build, plan, begin, state, **more)  # type: ignore[arg-type]
    yield from (piece_text(piece, of) for piece in course.pieces)
    said = (f"{one.begin - of} {'drive' if one.follows else 'at'} {one.pulses}" for one in course.load_pieces())
    yield f"  told: {', '.join(said)}; exact {course.is_exact}; at stop {course.stop(begin)}, then {course.next_stop(begin)}"
    stall, stalls = course.next_stall(begin), []
    while stall is not None:
        stalls.append(f"{stall - of}{course.why_stalled(stall)}")
        stall = course.next_stall(stall)
    if stalls or build.motor is not None:
        looks = " ".join(f"{course.vibration(begin + n * 211 * MILLISECOND):.9g}" for n in range(5))
        yield f"  stalls: {', '.join(stalls)}; vibration {looks}"
    for rotor in (False, True):
        found = []
        for after in (begin, of + 700 * MILLISECOND):
            for position in (-65, -20, -3, 8, 55):
                reached = (course.reaches(position, max(begin, after), way, rotor=rotor) for way in (1, -1))
                found.append("/".join("-" if one is None else f"{one - of}" for one in reached))
        yield f"  {'rotor' if rotor else 'load'}: {' '.join(found)}"
    at = (begin + n * 150 * MILLISECOND for n in range(6))
    yield "  " + " ".join(f"{course.position(now):.9g}{'←'[: course.leads(now)]}{'*'[: course.moves(now)]}" for now in at)
    yield from (f"  {stretch_text(one, of)}" for one in islice(load_stretches(course, begin + 40 * MILLISECOND), 5))


def stretch_text(one: DriveStretch, of: Nanos) -> str:
    return f"{one.begin - of}: {' '.join(f'{value:.9g}' for value in one[1:])}"


def profile_text(found: Profile) -> str:
    parts = (
        f"[{s.end_s:.9g} {s.anchor_s:.9g}: {s.c0:.9g} {s.c1:.9g} {s.c2:.9g} {s.c3:.9g} {s.direction}]" for s in found.segments
    )
    slow = " ".join(str(slow_from(found, found.start, speed)) for speed in (0.0, 20.0, 150.0, 400.0))
    return f"{found.start} {found.base} {found.final_p:.9g} {' '.join(parts)} slow {slow}"
