"""Things that move parts of a machine against each other at a moment: found while a world runs, because no record says it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

from steptwin.controller import Nanos
from steptwin.simulation.components.beam import BEAM, SEEN
from steptwin.simulation.components.beltgrip import BeltGrip
from steptwin.simulation.components.beltsensor import Sensor
from steptwin.simulation.components.body import BODY, SIGNALS
from steptwin.simulation.components.carrier import Carrier
from steptwin.simulation.components.conveyor import CONVEYOR
from steptwin.simulation.components.conveyortable import stop_terminal
from steptwin.simulation.components.touch import HIT
from steptwin.simulation.space.frames import FLOOR, Frame, path
from steptwin.simulation.world.simulation import Simulation

PUSHED, FALLS, GOES_ON = "pushed", "falls", "goes on"
"""Events of a workpiece that moves from then on."""
STANDS = "stands"
"""Event of a workpiece that does not move from then on, though its belt may."""
TOUCH_NM = 4
"""Most by which places on two belts are rounded."""
PRESENT = SIGNALS["when"]
TRAVEL = "travel"
"""The signal of a belt that moves."""


class NotedMeetings:
    """Notes what beams and sensors of belts see, and what touches in collisions, and what moves those."""

    def __init__(self, world: Simulation) -> None:
        self._world = world
        contacts = (contact for circuit in world.objects.circuits.values() for contact in circuit.contacts)
        self._sensors = {contact.channel: contact for contact in contacts if isinstance(contact, Sensor)}
        self._by = {name: sensor.by(world.now) for name, sensor in self._sensors.items()}
        """The workpiece that a sensor saw last, which somebody may have taken."""
        self._beams = {f"{name}.{SEEN.lower()}": beam for name, beam in world.objects.built(BEAM).items()}
        self._along = {spec.name: spec.towards().axis for spec in world.objects.described.of(BEAM)}
        self._conveyors = world.objects.built(CONVEYOR)
        self.there = {name: {one.workpiece.name for one in it.belt.workpieces} for name, it in self._conveyors.items()}
        """The workpieces that were on each belt at first."""
        self._touching: dict[str, tuple[str, ...]] = {}
        """Those that touched last, by collision."""
        self.seen: dict[tuple[str, Nanos], tuple[str, ...]] = {}
        """The workpiece or part that is seen, or was seen last, or those that touch, by the signal, at its changes."""
        self.movers: dict[tuple[str, Nanos], tuple[str, ...]] = {}
        """The signals that moved what a beam sees or a collision compares, by its name, at its changes."""

        self.holders: dict[tuple[str, Nanos], str] = {}
        """The workpiece before one that comes to stand on a belt, the pusher, or the terminal of the stop that holds it, by its
        name and the moment."""
        carriers = (one for parts in world.objects.elements.values() for one in parts.items() if isinstance(one[1], Carrier))
        self._met = {name: _Met(world, name, one.grip) for name, one in carriers if isinstance(one.grip, BeltGrip)}

    def is_met(self, carrier: str, now: Nanos) -> bool:
        """Whether a workpiece is where a cup or gripper would take it from a belt at a moment."""
        met = self._met[carrier].changes
        return met[bisect_right(met, now, key=lambda one: one[0]) - 1][1]

    def stands(self, conveyor: str, workpiece: str, now: Nanos) -> None:
        """A workpiece comes to stand on a belt."""
        belt = self._conveyors[conveyor].belt
        placed = next((one for one in belt.workpieces if one.workpiece.name == workpiece), None)
        if placed is None or placed.held is None:
            return
        ahead = belt.occupant(placed.held + 1, placed.held + 1 + belt.from_nm(TOUCH_NM), now, beside=placed)
        if ahead is not None:
            self.holders[workpiece, now] = ahead[1].workpiece.name
            return
        for bar in belt.bars:
            if bar.workpiece == workpiece and abs(bar.place - placed.held) <= belt.from_nm(TOUCH_NM):
                self.holders[workpiece, now] = bar.by
                return
        for number, stop in enumerate(self._conveyors[conveyor].spec.stops, start=1):
            if belt.to_grid(stop.at) == placed.held:
                self.holders[workpiece, now] = f"{conveyor}.{stop_terminal(number).lower()}"

    def sees(self, signal: str, now: Nanos) -> None:
        """A signal changes, which may be that of a sensor."""
        beam, sensor = self._beams.get(signal), self._sensors.get(signal)
        if beam is not None and beam.by:
            name = beam.block.name
            self.seen[signal, now] = (beam.by,)
            self.movers[name, now] = movers(self._world, name, beam.by, now, self._along[name])
        elif sensor is not None and (workpiece := sensor.by(now) or self._by.get(signal)):
            self._by[signal] = workpiece
            self.seen[signal, now] = (workpiece,)

    def touch(self, collision: str, parts: tuple[str, ...], now: Nanos) -> None:
        """Parts touch in a collision; those that touched last are apart again, if none are given."""
        parts = self._touching[collision] = parts or self._touching.get(collision, ())
        if parts:
            self.seen[f"{collision}.{HIT.lower()}", now] = parts
            self.movers[collision, now] = movers(self._world, parts[0], parts[1], now)


class _Met:
    """Notes whether a workpiece is where one would be taken from a belt, at each event of that, of the belts, and of what
    drives those. As `steptwin.simulation.scheduler.subscribers.SchedulerSubscriber`."""

    def __init__(self, world: Simulation, name: str, grip: BeltGrip) -> None:
        self._grip = grip
        self.changes = [(world.now, grip.is_met(world.now))]
        belts = [one for one in world.objects.described.of(CONVEYOR) if one.name in grip.depends_on]
        drives = [world.axes[one.axis].spec.drive[0] for one in belts if one.axis is not None]
        world.objects.scheduler_of[name].subscribe(self, (*grip.depends_on, *drives))

    def leave(self, moment: Nanos) -> None:
        """It need not know."""

    def look(self, now: Nanos) -> None:
        is_met = self._grip.is_met(now)
        if is_met is not self.changes[-1][1]:
            self.changes.append((now, is_met))


def movers(world: Simulation, one: str, other: str, now: Nanos, along: int | None = None) -> tuple[str, ...]:
    """Signals that change where an element, body or workpiece is, as seen from another one: ``x.position``, ``belt.travel``; with
    the events of workpieces, ``belt.1.pushed``. Those that move at a moment, if any do, and not ``along`` an axis only; of a body
    that comes or goes at the moment just that, ``arm.present``."""
    bodies = world.objects.built(BODY)
    whens = {name: bodies[name].signals().get(PRESENT) for name in (one, other) if name in bodies}
    flips = tuple(f"{name}.{PRESENT}" for name, when in whens.items() if when and when.value(now) != when.value(now - 1))
    if flips:
        return flips
    steps = [step for step in path(_frame(world, one), _frame(world, other)) if step.motion is not None]
    moving = [step.frame for step in steps if step.motion is not None and not step.motion.is_still]
    moving = [frame for frame in moving if _moves(frame, now)] or moving
    across = [frame for frame in moving if frame.joint is not None and (frame.joint.turns or frame.joint.along.axis != along)]
    return tuple(dict.fromkeys(signal for frame in across or moving for signal in _signals(world, frame)))


def _frame(world: Simulation, name: str) -> Frame:
    workpiece = world.objects.workpieces.bodies().get(name)
    if workpiece is not None:
        return workpiece.frame
    frames = world.objects.frames
    return frames[name].frame if name in frames else FLOOR


def _moves(frame: Frame, now: Nanos) -> bool:
    piece = None if frame.joint is None else next(frame.joint.motion.pieces(now), None)
    return piece is not None and piece.speed(now, now + 1) > 0.0


def _signals(world: Simulation, frame: Frame) -> Iterator[str]:
    frames = world.objects.frames
    movement = frames.movement(frame)
    if movement is not None:
        yield f"{frame.name.removesuffix(f'.{movement.signal}')}.{movement.signal}"
        return
    workpiece, _, way = frame.name.rpartition(".")
    match way:
        case "belt":
            yield from (f"{one.name}.{TRAVEL}" for one in frame.line()[1:] if one.name in frames and one.name != workpiece)
            yield f"{workpiece}.{GOES_ON}"
        case "push":
            yield f"{workpiece}.{PUSHED}"
        case "fall":
            yield f"{workpiece}.{FALLS}"
