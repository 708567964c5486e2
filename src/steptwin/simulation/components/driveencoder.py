"""Encoders that belts and DC motors turn: ``follows`` of ``[axis.encoder]`` names what no controller moves."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from fractions import Fraction
from functools import partial
from typing import ClassVar, NamedTuple

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.components.axis import AXIS, BuiltAxis
from steptwin.simulation.components.elementcontext import ElementContext
from steptwin.simulation.components.encoder import EncoderSpec
from steptwin.simulation.mechanics.belt import ConstantDrive
from steptwin.simulation.mechanics.mechanics import FOLLOW_NS, EncoderBuild, Mechanism
from steptwin.simulation.mechanics.rampeddrive import RampedDrive
from steptwin.simulation.mechanics.scale import exact_fraction
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.state import Plain, Stateful

NO_INDEX = Message("simulation.encoder-has-no-index", "encoder: {name!r} is no axis: an encoder on it has no index")
NEEDS_COUNTS = Message("simulation.encoder-needs-counts", "encoder: follows = {name!r} needs {key}: counts per {unit}")


class Turned(NamedTuple):
    """A kind of drive that turns encoders: ``key`` of `EncoderSpec` has the counts for each ``unit``, of so many ``steps``."""

    name: str
    drive: Mechanism | ConstantDrive | RampedDrive
    key: str
    unit: str
    steps: Fraction


class DriveShaft(NamedTuple):
    """The motion of an encoder shaft: of a drive that has not been switched since. Immutable."""

    drive: ConstantDrive | RampedDrive

    def count(self, now: Nanos) -> int:
        return self.drive.grid_position(now)


class DriveEncoder(Stateful):
    """Turns an encoder with a drive, and notifies the controller that reads it, which may follow, every `FOLLOW_NS` meanwhile."""

    FIXED: ClassVar[tuple[str, ...]] = ("_drive", "_encoder", "_scheduler", "_seen")
    __slots__ = (*FIXED, "_due")

    def __init__(self, scheduler: Scheduler, encoder: EncoderBuild, drive: ConstantDrive | RampedDrive) -> None:
        self._scheduler = scheduler
        self._encoder = encoder
        self._drive = drive
        self._seen: object = None
        self._due: Nanos | None = None

    def update(self, now: Nanos) -> None:
        drive, encoder = self._drive, self._encoder
        if drive.version() != self._seen or (self._due is not None and self._due <= now):
            self._seen = drive.version()
            encoder.device.follow_shaft(encoder.axis, DriveShaft(copy(drive)), now)
            self._due = now + FOLLOW_NS if drive.runs or now < drive.straight_from() else None

    def deadline(self) -> Nanos | None:
        return self._due

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self._seen = None


def fit_encoders(turned: Turned, context: ElementContext) -> None:
    """Put on a belt or a motor the encoders that follow it."""
    axes: Mapping[str, BuiltAxis] = context.objects.built(AXIS)
    for axis in axes.values():
        spec = axis.spec.encoder
        if spec is not None and spec.follows == turned.name:
            context.text.unless_wrong((*spec.path, "follows"), partial(_fit, axis, spec, turned, context))


def _fit(axis: BuiltAxis, spec: EncoderSpec, turned: Turned, context: ElementContext) -> None:
    controller = axis.spec.drive[0]
    inputs = context.kind(controller).encoders
    given = spec.counts_per_unit if turned.key == "counts_per_unit" else spec.counts_per_rev
    if inputs is None:
        return  # the axis has reported that its controller reads none
    if spec.index:
        raise Misuse(NO_INDEX(name=turned.name))
    if not given:
        raise Misuse(NEEDS_COUNTS(name=turned.name, key=turned.key, unit=turned.unit))
    counts = exact_fraction(given) * (1 - exact_fraction(spec.slip)) / turned.steps
    reader, number, now = inputs.reader(context.controller(controller)), axis.mechanism.number, axis.scheduler.now
    encoder = EncoderBuild(controller, reader, number, True, counts.numerator, counts.denominator)
    if isinstance(turned.drive, Mechanism):
        turned.drive.fit(encoder, now)
        return
    reader.gear_encoder(number, counts.numerator, counts.denominator, now)
    axis.scheduler.add_part(DriveEncoder(axis.scheduler, encoder, turned.drive), (turned.name,))
    context.objects.turned.add(controller)
