"""What an axis moves: rotor and load with their stops, play and motor, and the encoder that sees them.

A `Mechanism` follows the plans of one drive. While nothing can come between pulses and load it costs nothing; else each plan
gives a `Course` in closed form. Positions in pulses of the mechanics.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar, NamedTuple, Protocol

from steptwin.errors import Misuse
from steptwin.machine import MILLISECOND, Drive, Nanos
from steptwin.motion.divisions import profile_of
from steptwin.state import Plain, Stateful
from steptwin.world.course import Build, Carried, Course, Standing
from steptwin.world.kernel import Kernel

_OUTDATED = -1
"""No drive has this revision."""
FOLLOW_NS: Nanos = 10 * MILLISECOND
"""A controller that follows an encoder looks at it this often while it turns, so it is notified."""


class Shaft(NamedTuple):
    """What turns an encoder: a course, in the frame of a drive's counted position. Never changed."""

    course: Course
    on_load: bool

    def count(self, now: Nanos) -> int:
        standing = self.course.at(now)
        build = self.course.build
        return ((standing.load if self.on_load else standing.rotor) - build.zero) * build.sign


class EncoderReader(Protocol):
    """A controller that reads encoders. Axes count from 1."""

    def gear_encoder(self, axis: int, counts: int, pulses: int, now: Nanos, /) -> None:
        """The encoder gives ``counts`` per ``pulses`` of what turns it."""
        ...

    def follow_shaft(self, axis: int, shaft: Shaft, now: Nanos, /) -> None:
        """The encoder turns with ``shaft`` from now on."""
        ...

    def turn_encoder(self, axis: int, counts: int, now: Nanos, /) -> None:
        """The encoder turns by ``counts`` at once."""
        ...


@dataclass(frozen=True, slots=True)
class EncoderBuild:
    """An encoder that the controller ``device``, called ``machine`` in the kernel, reads for its axis ``axis`` (from 1).

    ``counts`` (negative: backwards) per ``pulses`` of the drive that turns it; None: as the controller is configured.
    """

    machine: str
    device: EncoderReader
    axis: int
    on_load: bool = False
    counts: int | None = None
    pulses: int = 1


class Mechanism(Stateful):
    """The mechanics of axis ``number`` (from 1) of a machine in ``kernel``. It is a part of the kernel, and carries switches."""

    __slots__ = (
        "_blocked",
        "_changes",
        "_coupled",
        "_course",
        "_due",
        "_encoders",
        "_kernel",
        "_lost",
        "_name",
        "_reported",
        "_reported_course",
        "_revision",
        "_simple",
        "_stall_due",
        "_stalled",
        "build",
        "machine",
        "number",
    )
    FIXED: ClassVar[frozenset[str]] = frozenset({"_encoders", "_kernel", "_name", "_revision", "build", "machine", "number"})

    def __init__(self, kernel: Kernel, machine: str, number: int, build: Build, name: str = "axis") -> None:
        self._kernel = kernel
        self._name = name
        self.machine = machine
        self.number = number
        self.build = build
        self._encoders: list[EncoderBuild] = []
        self._coupled = False
        """Whether encoders have been notified that the drive does not turn them directly."""
        self._due: Nanos | None = None
        """When controllers that follow are next notified that their encoder turns."""
        self._stalled = False
        self._stall_due: Nanos | None = None
        """When the motor loses the field next, or is caught."""
        self._lost = 0
        self._blocked = False
        self._changes = 0
        self._reported: tuple[Carried, ...] = (Carried(kernel.now, True, 0),)
        """Where the load is, as reported last."""
        self._reported_course: Course | None = None
        """The course that was reported."""
        self._simple = build.ideal
        """Nothing has come between pulses and load yet, and nothing can."""
        drive = self._drive
        here = build.sign * drive.plan.count(kernel.now) + build.zero
        if (build.low is not None and here < build.low) or (build.high is not None and here > build.high):
            raise Misuse(f"{machine} axis {number} stands at {here} imp, outside its hard stops {build.low} to {build.high} imp")
        self._revision = drive.revision
        self._course = Course(build, drive.plan, kernel.now, Standing(here, here))

    @property
    def _drive(self) -> Drive:
        return self._kernel.drive_of(self.machine, self.number)

    # ------------------------------------------------------------------ where it is

    def course(self, now: Nanos) -> Course:
        """The course in force at ``now``, the kernel's moment or later."""
        drive = self._drive
        if drive.revision != self._revision:
            self._renew(drive, now)
        return self._course

    def at(self, now: Nanos) -> Standing:
        return self.course(now).at(now)

    def lost(self, now: Nanos) -> int:
        """Pulses by which the rotor is behind the field."""
        course = self.course(now)
        return course.field(now) - course.at(now).rotor

    def version(self) -> object:
        return self._drive.revision, self._changes

    def place(self, now: Nanos) -> int:
        return self.at(now).load

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        return self.course(after).reaches(position, after, direction)

    # ------------------------------------------------------------------ time

    def look(self, now: Nanos) -> None:
        if not self._simple:
            drive = self._drive
            if drive.revision != self._revision:
                self._renew(drive, now)
            elif self._due is not None and self._due <= now:
                self._turn_encoders(now)
            if self._stall_due is not None and self._stall_due <= now:
                self._watch_motor(now)
            self._report_load(now)

    def _report_load(self, now: Nanos) -> None:
        """Report where the load is, unless that follows from earlier reports: a load that goes with its drive needs none."""
        course = self._course
        if course is self._reported_course:
            return
        self._reported_course = course
        carried = _from(course.carried(), now)
        if carried != _from(self._reported, now):
            self._reported = carried
            self._kernel.report(self.machine, "load", str(self.number), carried)

    def deadline(self) -> Nanos | None:
        """Courses are computed ahead: only followers of the axis need to be notified."""
        if self._due is None or self._stall_due is None:
            return self._stall_due if self._due is None else self._due
        return min(self._due, self._stall_due)

    def _watch_motor(self, now: Nanos) -> None:
        """Report where the motor has lost the field, and where it has regained it."""
        stalled = self._course.at(now).stalled
        if stalled is not self._stalled:
            self._stalled = stalled
            text = f"{self._name} loses the field" if stalled else f"{self._name} is caught, {self.lost(now)} pulses behind"
            facts = ("axis", self.number), ("stalled", stalled), ("lost", 0 if stalled else self.lost(now))
            self._kernel.report(self.machine, "event", "stall", text, *facts)
        self._stall_due = self._course.next_stall(now)

    def _renew(self, drive: Drive, now: Nanos, standing: Standing | None = None) -> None:
        """The drive follows another plan, or something has changed in the mechanics."""
        before, plan = self._course, drive.plan
        if standing is None:
            if self._simple:
                here = self.build.sign * plan.count(now) + self.build.zero - self._lost
                standing = Standing(here, here, behind=self._lost)
            else:
                standing = before.at(now)
                # A controller that is switched off counts from 0 again.
                counted_anew = self.build.sign * (plan.count(now) - before.plan.count(now))
                standing = standing._replace(behind=standing.behind + counted_anew)
        jump = profile_of(plan).velocity(now) - profile_of(before.plan).velocity(now)
        self._revision = drive.revision
        self._course = Course(self.build, plan, now, standing, blocked=self._blocked, jump=jump)
        self._changes += 1
        if self._encoders:
            self._turn_encoders(now)
        if self.build.motor is not None:
            self._watch_motor(now)

    # ------------------------------------------------------------------ encoders

    def fit(self, encoder: EncoderBuild, now: Nanos) -> None:
        """Put an encoder on the rotor or the load."""
        self._encoders.append(encoder)
        if encoder.counts is not None:
            encoder.device.gear_encoder(encoder.axis, encoder.counts, encoder.pulses, now)
        if not self._is_own(encoder):
            self._simple = False
        self._turn_encoders(now)

    def _turn_encoders(self, now: Nanos) -> None:
        course = self._course
        self._due = None
        for encoder in self._encoders:
            own = self._is_own(encoder)
            exact = own and course.is_exact and not (encoder.on_load and self.build.play)
            if not exact or self._coupled:
                self._coupled = True
                encoder.device.follow_shaft(encoder.axis, Shaft(course, encoder.on_load), now)
            if not own and profile_of(course.plan).moving(now):
                self._due = now + FOLLOW_NS

    def _is_own(self, encoder: EncoderBuild) -> bool:
        """Whether the axis turns an encoder of its own controller's axis."""
        return (encoder.machine, encoder.axis) == (self.machine, self.number)

    # ------------------------------------------------------------------ what can go wrong

    def block(self, blocked: bool, now: Nanos) -> None:
        """Hold the rotor: pulses are lost; let it go again."""
        standing = self.at(now)
        self._simple = False
        self._blocked = blocked
        stalled = standing.stalled or (not blocked and self.build.motor is not None)
        self._renew(self._drive, now, standing._replace(stalled=stalled))
        self._kernel.mark()

    def lose(self, pulses: int, now: Nanos) -> None:
        """The rotor falls ``pulses`` behind the field (negative: ahead), as far as stops permit."""
        build, (rotor, load, stalled, _) = self.build, self.at(now)
        rotor -= pulses
        if build.low is not None:
            rotor = max(rotor, build.low - build.play)
        if build.high is not None:
            rotor = min(rotor, build.high)
        self._lost += pulses
        self._simple = False
        behind = self.course(now).field(now) - rotor
        self._renew(self._drive, now, Standing(rotor, min(max(load, rotor), rotor + build.play), stalled, behind))
        self._kernel.mark()

    def slip(self, counts: int, now: Nanos) -> None:
        """The encoders turn by ``counts`` on their shaft."""
        for encoder in self._encoders:
            encoder.device.turn_encoder(encoder.axis, counts, now)
        self._kernel.mark()

    # A drive counts its revisions on, whatever is restored: what is kept is whether the course is that of its plan.

    def copy_state(self) -> Plain:
        return super().copy_state(), self._revision == self._drive.revision

    def set_state(self, plain: Plain) -> None:
        """As ever; the drive has its state already."""
        own, is_current = plain
        super().set_state(own)
        self._revision = self._drive.revision if is_current else _OUTDATED


def _from(reported: tuple[Carried, ...], now: Nanos) -> tuple[Carried, ...]:
    """What was reported for ``now`` and later."""
    past = max(bisect_right(reported, now, key=attrgetter("begin")) - 1, 0)
    return (reported[past]._replace(begin=now), *reported[past + 1 :])


class RotorMark:
    """The rotor of a mechanism as a carriage: the index of an encoder is on it."""

    __slots__ = ("_mechanism",)

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism

    def version(self) -> object:
        return self._mechanism.version()

    def place(self, now: Nanos) -> int:
        return self._mechanism.at(now).rotor

    def reaches(self, position: int, after: Nanos, direction: int) -> Nanos | None:
        return self._mechanism.course(after).reaches(position, after, direction, rotor=True)
