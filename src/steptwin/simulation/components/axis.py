"""``[[axis]]``: what a drive moves, with its stops, play, motor, switches and encoder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message, text_of
from steptwin.motion.trig import PI
from steptwin.simulation.components.element import Element, Stands
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.elementspec import ElementSpecs, NamedSpec, Reference
from steptwin.simulation.components.encoder import EncoderSpec
from steptwin.simulation.components.motor import MotorSpec, motor_of
from steptwin.simulation.components.mount import UPRIGHT, Movement, MoverSpec
from steptwin.simulation.components.switch import SwitchSpec, channel_of, put_switch, warn_of_useless, zone_of
from steptwin.simulation.kinds.kind import EncoderInputs
from steptwin.simulation.logic.contacts import Switch, Zone
from steptwin.simulation.logic.signal import SignalOf, SignalsOf
from steptwin.simulation.mechanics.effort import Effort
from steptwin.simulation.mechanics.mechanics import EncoderBuild, Mechanism, RotorMark
from steptwin.simulation.mechanics.scale import LENGTHS, TURNS, GivenScale, Scale, exact_fraction, scale_of
from steptwin.simulation.mechanics.trajectory import Build, Trajectory
from steptwin.simulation.scheduler.scheduler import Scheduler, Source
from steptwin.simulation.space.frames import NM_PER_MM
from steptwin.simulation.space.pieces import Motion, gear_of, geared, pieces_of_trajectory
from steptwin.simulation.toml.names import Unknown, WrongTerminal
from steptwin.simulation.toml.reader import TomlText
from steptwin.simulation.toml.table import key, table, table_in, tables_in
from steptwin.simulation.toml.values import (
    OUTPUT,
    OUTPUT_PIN,
    Terminal,
    axis_number,
    flag,
    name_value,
    number,
    pair,
    pin_name,
    text_value,
    whole,
    word,
)

HAS_NO_MOTOR = Message("simulation.axis-has-no-motor", "axis {axis!r} has no [axis.motor]")
MECHANICS = ("position", "lost", "stalled")
"""Signals of an axis that show where it is."""


@table("[[axis]]")
class AxisSpec(NamedSpec, MoverSpec):
    name: str = key(name_value, "how scripts and conditions name it")
    drive: Terminal = key(pin_name, "what drives it: an axis of a controller, such as table.M1")
    kind: str = key(word("linear", "rotary"), "what moves", default="linear")
    unit: str | None = key(
        text_value,
        "of its positions: mm, cm, m, degree, rev or anything; default degree if rotary, else mm with pulses_per_unit or pitch, "
        "else that of its drive",
        default=None,
    )
    pulses_per_unit: float | None = key(
        number(0.0, above=True),
        "pulses (M1486: minimum microsteps) per unit; else by pitch, by revolution, by gear",
        default=None,
    )
    pitch: float | None = key(
        number(0.0, above=True),
        "units per motor revolution, instead of pulses_per_unit",
        default=None,
        excludes=("pulses_per_unit",),
    )
    pulses_per_rev: int | None = key(
        whole(1, 10**7), "pulses per motor revolution; default mot_resol; M1486: 64 × full_steps", default=None
    )
    inverted: bool = key(flag, "whether positive pulses go down", default=False)
    travel: tuple[float, float] | None = key(pair, "hard stops, in its unit", default=None)
    start: float = key(number(), "where it stands when the world begins, in its unit", default=0.0)
    power: Terminal | None = key(
        OUTPUT_PIN, "output that gives its motor power, such as a contact; its controller counts on without", default=None
    )
    backlash: float = key(number(0.0), "play between motor and load, in its unit", default=0.0)
    mm_per_unit: float | None = key(
        number(0.0, above=True), "mm that it moves what is on it per unit, where its unit is no length", default=None, order=2
    )
    switches: tuple[SwitchSpec, ...] = tables_in("switch", SwitchSpec)
    encoder: EncoderSpec | None = table_in("encoder", EncoderSpec)
    motor: MotorSpec | None = table_in("motor", MotorSpec)

    @property
    def scale(self) -> GivenScale:
        return GivenScale(
            controller=self.drive[0],
            is_rotary=self.kind == "rotary",
            unit=self.unit,
            pulses_per_unit=self.pulses_per_unit,
            pitch=self.pitch,
            pulses_per_rev=self.pulses_per_rev,
            full_steps=None if self.motor is None else self.motor.full_steps,
        )

    def check(self, text: TomlText) -> None:
        if self.encoder is not None and self.encoder.follows == self.name:
            text.wrong(
                (*self.encoder.path, "follows"),
                "D007",
                f"follows = {self.name!r} is its own axis: an encoder is on it anyway",
            )
        start, travel = (*self.path, "start"), self.travel
        if travel is not None and not travel[0] <= self.start <= travel[1] and not text.is_wrong(start):
            text.wrong(start, "D007", f"start = {self.start:g} is outside travel = {list(travel)}")
        if travel is not None:
            lasting = [one for one in self.switches if self.kind != "rotary" or one.position is None]
            warn_of_useless(text, lasting, self.name, travel)


@dataclass(frozen=True, slots=True)
class BuiltAxis:
    """An axis with its mechanics."""

    spec: AxisSpec
    scheduler: Scheduler
    mechanism: Mechanism
    scale: Scale

    @property
    def source(self) -> Source:
        return self.scheduler.source(self.spec.name)

    def units(self, pulses: int) -> float:
        scale = self.scale.pulses_per_unit
        return pulses * scale.denominator / scale.numerator


def _refers(spec: AxisSpec, described: ElementSpecs) -> Iterator[Reference]:
    yield Reference(spec.drive[0], spec.drive[0], (*spec.path, "drive"))
    if spec.power is not None:
        yield Reference(spec.drive[0], spec.power[0], (*spec.path, "power"))
    for switch in spec.switches:
        yield Reference(spec.drive[0], switch.target[0], (*switch.path, "to"))
    if spec.encoder is not None and spec.encoder.follows is not None:
        drives = {axis.name: axis.drive[0] for axis in described.of(AXIS)}
        followed = spec.encoder.follows
        others = (one.name for specs in described.values() for one in specs if isinstance(one, NamedSpec))
        if followed in drives or followed in others:  # one that is not an axis is connected, too: what is wrong is `follows`
            yield Reference(spec.drive[0], drives.get(followed, followed), (*spec.encoder.path, "follows"))


def _build(spec: AxisSpec, context: ElementContext) -> BuiltAxis:
    controller = spec.drive[0]
    scheduler = context.scheduler(controller)
    number, scale, build = context.memo.once(spec.path, lambda: _checked(spec, context))
    power = None if spec.power is None else context.terminal(spec.power, OUTPUT)
    mechanism = Mechanism(scheduler, controller, number, build, spec.name, power)
    scheduler.add_part(mechanism, (controller, *(() if power is None else (power.controller,))), spec.name)
    fitted = BuiltAxis(spec, scheduler, mechanism, scale)
    for n, switch in enumerate(spec.switches, start=1):
        context.text.unless_wrong(switch.path, partial(_put_switch, fitted, switch, channel_of(spec.name, n), context))
    return fitted


def _checked(spec: AxisSpec, context: ElementContext) -> tuple[int, Scale, Build]:
    """The number of its drive, its scale and its mechanics. Raises `Misuse`."""
    controller, drive = spec.drive
    number = axis_number(drive)
    axes = len(context.controller(controller).axes)
    if not 1 <= number <= axes:
        there = ", ".join(f"M{n}" for n in range(1, axes + 1))
        raise WrongTerminal(f"{controller}.{drive}", f"drive = '{controller}.{drive}': {controller} has {there}", None)
    taken = [axis.spec.name for axis in context.objects.built(AXIS).values() if axis.spec.drive == spec.drive]
    if taken:
        raise Misuse(f"drive = '{controller}.{drive}' moves {taken[0]!r} already")
    scale = scale_of(spec.scale, context.kind(controller).scale(spec.scale, context.controller(controller), number))
    pulses = scale.nearest
    build = Build(
        sign=-1 if spec.inverted else 1,
        zero=pulses(spec.start),
        low=None if spec.travel is None else pulses(spec.travel[0]),
        high=None if spec.travel is None else pulses(spec.travel[1]),
        play=pulses(spec.backlash),
        period_p=scale.period_p,
        motor=None if spec.motor is None else motor_of(spec.motor, scale),
        coasts_unpowered=spec.motor is not None and spec.motor.when_off == "free",
        may_lose_power=spec.power is not None,
    )
    if build.coasts_unpowered and build.motor is not None:
        build.motor.check_coasting()
    return number, scale, replace(build, zero=build.zero - (build.lies or 0))


def _put_switch(axis: BuiltAxis, spec: SwitchSpec, channel: str, context: ElementContext) -> None:
    def zone() -> Zone:
        usual = axis.scale.turn if axis.spec.kind == "rotary" else None
        period = usual if spec.period is None else axis.scale.pulses(spec.period)
        return zone_of(spec, axis.scale.nearest, period)

    put_switch(axis.scheduler, axis.mechanism, axis.spec.drive[0], context.memo.once(spec.path, zone), spec, channel, context)


def _connect(spec: AxisSpec, fitted: BuiltAxis, context: ElementContext) -> None:
    _fit_encoder(fitted, spec.encoder, context.objects.built(AXIS), context)


def _fit_encoder(axis: BuiltAxis, spec: EncoderSpec | None, axes: Mapping[str, BuiltAxis], context: ElementContext) -> None:
    """Put an encoder on an axis, or on the one that it follows. Without one, mechanics between pulses and load turn that of the
    controller."""
    mechanism = axis.mechanism
    name = axis.spec.drive[0]
    kind, controller = context.kind(name), context.controller(name)
    encoders = kind.encoders
    if encoders is None:
        if spec is not None:
            raise Misuse(f"encoder: {name} is {kind.title}, which reads none")
        return
    now = axis.scheduler.now
    reader = encoders.reader(controller)
    if spec is None:
        if not mechanism.build.ideal:
            mechanism.fit(EncoderBuild(name, reader, mechanism.number), now)
        return
    turned = axis
    if spec.follows is not None:
        other = axes.get(spec.follows)
        if other is None:
            _check_followed(spec.follows, axes, context)
            return  # it is fitted to it when that is built
        turned = other
    counts = _counts(spec, turned, encoders, controller, mechanism.number)
    on_load = spec.mount == "load" or spec.follows is not None
    numerator, denominator = (None, 1) if counts is None else (counts.numerator, counts.denominator)
    turned.mechanism.fit(EncoderBuild(name, reader, mechanism.number, on_load, numerator, denominator), now)
    if spec.index:
        low = axis.scale.nearest(spec.offset)
        target = (name, encoders.index_input(mechanism.number))
        circuit = context.circuit(axis.scheduler, target, (*spec.path, "index"), None)
        zone = Zone(low, low + spec.index_width - 1, 0, axis.scale.pulses_per_rev)
        axis.scheduler.add_part(Switch(circuit, RotorMark(turned.mechanism), zone, now), (turned.spec.name,))


def _check_followed(name: str, axes: Iterable[str], context: ElementContext) -> None:
    """Raise `Misuse` unless encoders may follow what is called so, which is no axis."""
    specs = (one for specs in context.objects.described.values() for one in specs)
    others = [one.name for one in specs if isinstance(one, NamedSpec) and one.turns_encoders]
    if name not in others:
        raise Unknown(name, f"encoder: follows = {name!r}: permitted are {', '.join((*axes, *others))}")


def _counts(spec: EncoderSpec, turned: BuiltAxis, encoders: EncoderInputs[Any], controller: Any, number: int) -> Fraction | None:
    """Counts per pulse of what turns it; None: as the controller is configured."""
    counts: Fraction | None = None
    if spec.counts_per_unit is not None:
        counts = exact_fraction(spec.counts_per_unit) / turned.scale.pulses_per_unit
    elif spec.counts_per_rev is not None:
        counts = Fraction(spec.counts_per_rev, turned.scale.pulses_per_rev)
    if spec.slip:
        if counts is None:
            counts = encoders.counts_per_pulse(controller, number)
        counts *= 1 - exact_fraction(spec.slip)
    return counts


def find_axis(name: str, context: ElementContext) -> BuiltAxis:
    """The axis called ``name``."""
    found = context.objects.built(AXIS).get(name)
    if found is None:
        raise Unknown(name, f"no axis is called {name!r}")
    return found


def turning_points_of_axis(fitted: BuiltAxis, now: Nanos) -> Iterator[Nanos]:
    """Moments after ``now`` between which its load moves one way."""
    return iter(fitted.mechanism.trajectory(now).turning_points(now))


def moves(fitted: BuiltAxis, now: Nanos) -> bool:
    """Whether its load moves, or will: one that goes on for ever at one velocity has no turning point."""
    trajectory = fitted.mechanism.trajectory(now)
    return bool(trajectory.turning_points(now)) or (trajectory.carries(now) and trajectory.moves(now))


def _signals(fitted: BuiltAxis) -> Mapping[str, SignalOf]:
    mechanism, turning = fitted.mechanism, partial(turning_points_of_axis, fitted)
    up, down = fitted.scale.pulses_per_unit.as_integer_ratio()
    source, version, unit = (fitted.source,), mechanism.version, fitted.scale.unit

    def signal(of: Callable[[Trajectory, Nanos], float], unit: str = "") -> SignalOf:
        return SignalOf(
            source,
            lambda now: of(mechanism.trajectory(now), now),
            turning,
            version,
            unit,
            freeze=lambda now: partial(of, mechanism.trajectory(now)),
        )

    def effort(
        of: Callable[[Effort, Nanos], float], factor: float, unit: str, bounds: tuple[float, float] | None = None
    ) -> SignalOf:
        return SignalOf(
            source,
            lambda now: of(mechanism.effort(now), now) * factor,
            lambda now: mechanism.effort(now).turning_points(now),
            lambda: (version(), mechanism.has_current),
            unit,
            bounds,
            freeze=lambda now: partial(_times, partial(of, mechanism.effort(now)), factor),
        )

    position = signal(lambda trajectory, now: trajectory.load_at(now) * down / up, unit)
    lost = signal(lambda trajectory, now: float(trajectory.field(now) - trajectory.at(now).rotor))
    stalled = signal(lambda trajectory, now: float(trajectory.at(now).stalled))
    found = dict(zip(MECHANICS, (position, lost, stalled), strict=True))
    found["power"] = SignalOf(source, lambda now: float(mechanism.has_current))
    found["speed"] = effort(Effort.speed, down / up, f"{unit}/s")
    if mechanism.build.motor is None:
        return SignalsOf(found, dict.fromkeys(("torque", "reserve", "force"), HAS_NO_MOTOR(axis=fitted.spec.name)))
    found["torque"] = effort(Effort.torque, 1.0, "N·m")
    most = max(torque for _, torque in mechanism.build.motor.curve)
    found["reserve"] = effort(Effort.reserve, 1.0, "N·m", (0.0, most))
    try:
        found["force"] = effort(Effort.torque, *_per_torque(fitted))
    except Misuse as error:
        return SignalsOf(found, {"force": text_of(error)})
    return found


IS_STALLED = Message("simulation.axis-is-stalled", "its motor is stalled")
LOST = "lost"
HAS_LOST = Message("simulation.axis-has-lost", "is {distance:g} {unit} beside what its controller counts")


def _stands(fitted: BuiltAxis, now: Nanos) -> Stands | None:
    trajectory = fitted.mechanism.trajectory(now)
    at = trajectory.at(now)
    if at.stalled:
        return Stands(IS_STALLED(), signal="stalled")
    return is_beside(fitted, trajectory.field(now) - at.rotor)


def is_beside(fitted: BuiltAxis, lost: int) -> Stands | None:
    """The state of an axis that has lost so many pulses since its controller knew where it is; None where there are none."""
    return Stands(HAS_LOST(distance=fitted.units(lost), unit=fitted.scale.unit), signal=LOST) if lost else None


def _per_torque(axis: BuiltAxis) -> tuple[float, str]:
    """The force or the torque at the load for a torque at the motor, without losses, and its unit. Raises `Misuse` for an axis in
    a unit whose length is not known."""
    scale, turns = axis.scale, TURNS.get(axis.scale.unit)
    revs = scale.pulses_per_unit / scale.pulses_per_rev
    if turns is not None:
        return float(revs / turns), "N·m"
    return 2.0 * PI * 1000.0 * float(revs / mm_per_unit(axis)), "N"


def _times(of: Callable[[Nanos], float], factor: float, now: Nanos) -> float:
    return of(now) * factor


def mm_per_unit(axis: BuiltAxis) -> Fraction:
    """mm in a unit of an axis. Raises `Misuse` where that is not known."""
    given, metres = axis.spec.mm_per_unit, LENGTHS.get(axis.scale.unit)
    if given is not None and metres is None:
        return exact_fraction(given)
    if given is not None:
        raise Misuse(f"mm_per_unit = {given:g}: {axis.spec.name!r} is in {axis.scale.unit}, which is a length already")
    if metres is None:
        raise Misuse(f"{axis.spec.name!r} counts in {axis.scale.unit}: what is on it needs its mm_per_unit")
    return metres * 1000


def nm_per_pulse(axis: BuiltAxis) -> Fraction:
    """nm of a linear axis in a pulse of its drive."""
    return mm_per_unit(axis) * NM_PER_MM / axis.scale.pulses_per_unit


def degrees_per_unit(axis: BuiltAxis) -> Fraction:
    """Degrees in a unit of a rotary axis. Raises `Misuse` where its unit is no angle."""
    revs = TURNS.get(axis.scale.unit)
    if revs is None:
        raise Misuse(
            f"{axis.spec.name!r} counts in {axis.scale.unit}: what is on it turns by {' or '.join(TURNS)}; "
            "a belt that it moves has mm_per_unit"
        )
    return revs * 360


def load_motion(axis: BuiltAxis, per_pulse: Fraction) -> Motion:
    """The motion of the load of an axis, ``per_pulse`` of the result for a pulse."""
    mechanism = axis.mechanism
    gear = gear_of(per_pulse)
    return Motion(mechanism.version, lambda now: geared(pieces_of_trajectory(mechanism.trajectory(now), now), gear))


def summed_travel(axes: Sequence[BuiltAxis], shares: Sequence[float]) -> tuple[float, float] | None:
    """Where a sum of shares of positions may be; None where the travel of an axis is not known."""
    ends = [
        (axis.spec.travel[0] * share, axis.spec.travel[1] * share)
        for axis, share in zip(axes, shares, strict=True)
        if axis.spec.travel is not None
    ]
    return (sum(map(min, ends)), sum(map(max, ends))) if len(ends) == len(axes) else None


def _moves(spec: AxisSpec, axis: BuiltAxis) -> Sequence[Movement]:
    blocks, sources = (axis.mechanism.block,), (spec.name,)
    if spec.kind == "rotary":
        degrees = degrees_per_unit(axis)
        motion = load_motion(axis, degrees / 90 / axis.scale.pulses_per_unit)
        return (
            Movement("position", motion, spec.towards(UPRIGHT), float(degrees), blocks, sources, turns=True, travel=spec.travel),
        )
    motion, per_unit, heading = load_motion(axis, nm_per_pulse(axis)), float(mm_per_unit(axis)), axis.mechanism.heading
    return (Movement("position", motion, spec.towards(), per_unit, blocks, sources, travel=spec.travel, heading=heading),)


AXIS: Element[AxisSpec, BuiltAxis] = Element(
    spec=AxisSpec,
    refers=_refers,
    build=_build,
    connect=_connect,
    signals=_signals,
    moves=_moves,
    stands=_stands,
)
