"""The kinds of faults of physics."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.controller import Nanos
from steptwin.errors import Misuse
from steptwin.messages import Message
from steptwin.simulation.faults.active import ActiveFault
from steptwin.simulation.faults.controller import FaultyController
from steptwin.simulation.faults.effects import ChangeEffect, MomentEffect, SaveEffect, WindowEffect
from steptwin.simulation.faults.table import (
    AXIS,
    LONGEST_MS,
    LONGEST_S,
    OFF,
    PIN,
    Fault,
    FaultCategory,
    FaultKind,
    FaultValue,
    Layer,
    Need,
    Occasion,
    number,
    whole,
)


def _axis(active: ActiveFault) -> int:
    return int(active.fault.number("axis"))


IS_BLOCKED = Message("simulation.axis-is-blocked", "M{axis} is blocked for {time:g} s")


def _stall(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    axis = _axis(active)
    controller.report(active, now, IS_BLOCKED(axis=axis, time=active.fault.number("for_s")))
    controller.block(active, axis, now, now + active.ns("for_s"))


LOSES_PULSES = Message("simulation.axis-loses-pulses", "M{axis} loses {pulses} pulses")


def _lose_steps(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    axis, given = _axis(active), active.fault.whole("pulses")
    pulses = controller.body.shafts[axis - 1].period_p if given is None else given
    controller.report(active, now, LOSES_PULSES(axis=axis, pulses=pulses))
    controller.lose(axis, pulses, now)


MANY_PERIODS = 50
"""A turn of a motor of 200 full steps: what a stall that nobody notices costs at least."""


def _losses(controller: FaultyController, axis: int) -> tuple[Mapping[str, FaultValue], ...]:
    """The least that a rotor loses, and much."""
    period = controller.body.shafts[axis - 1].period_p
    return {"pulses": period}, {"pulses": MANY_PERIODS * period}


ENCODER_SLIPS = Message("simulation.encoder-slips", "the encoder of M{axis} slips by {counts} counts")


def _slip(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    axis, counts = _axis(active), int(active.fault.number("counts"))
    controller.report(active, now, ENCODER_SLIPS(axis=axis, counts=counts))
    controller.body.slip(axis, counts, now)


NO_SUPPLY = Message("simulation.no-supply-for", "no supply for {time:g} s")


def _drop_supply(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    controller.report(active, now, NO_SUPPLY(time=active.fault.number("for_s")))
    controller.drop_supply(now, now + active.ns("for_s"))


def _stick(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    controller.stick(active, now)


def _fail_master(active: ActiveFault, controller: FaultyController, now: Nanos) -> None:
    controller.fail_master(active, now)


BOUNCES = Message("simulation.pin-bounces", "{pin} bounces {times} times in {time:g} ms")


def _bounce(active: ActiveFault, controller: FaultyController, pin: str, levels: tuple[float, float], now: Nanos) -> None:
    """To the second level it has gone; back and there again some times, the last time at the end of the bouncing."""
    bounces, within = active.fault.whole("bounces") or 1, active.ns("for_ms")
    moments = sorted(1 + active.chance.below(within) for _ in range(2 * bounces - 1))
    changes = [(now + at, pin, to) for at, to in zip((*moments, within), levels * bounces, strict=True)]
    controller.report(active, now, BOUNCES(pin=pin, times=bounces, time=active.fault.number("for_ms")))
    controller.bounce(changes)


FAULT_OF_AN_ANALOG_INPUT = Message(
    "simulation.fault-of-an-analog-input", "fault bounce: pin = {pin!r} is an analog input, which has no switch"
)


def _needs_switch(controller: FaultyController, fault: Fault) -> None:
    pin = controller.pin_of(fault)
    if pin.startswith("AIN"):
        raise Misuse(FAULT_OF_AN_ANALOG_INPUT(pin=pin))


SAVE_IS_CUT = Message("simulation.save-is-cut", "no supply after {written} of {count} bytes were saved")


def _cut_power(active: ActiveFault, controller: FaultyController, old: bytes, kept: bytearray, now: Nanos) -> None:
    written = active.fault.whole("written")
    written = active.chance.below(len(kept) + 1) if written is None else min(written, len(kept))
    kept[written:] = old[written:]
    controller.report(active, now, SAVE_IS_CUT(written=written, count=len(kept)))
    controller.cut_supply(now, now + active.ns("for_s"))


BYTE_IS_WORN = Message("simulation.byte-is-worn", "after {saves} saves byte {byte} is worn out")


def _wear(active: ActiveFault, controller: FaultyController, old: bytes, kept: bytearray, now: Nanos) -> None:
    good = active.fault.whole("writes") or 0
    if active.struck > good and len(active.worn) < len(kept):
        sound = [index for index in range(len(kept)) if index not in active.worn]
        active.worn.append(sound[active.chance.below(len(sound))])
        controller.report(active, now, BYTE_IS_WORN(saves=active.struck, byte=active.worn[-1]))
    for index in active.worn:
        kept[index] = old[index]


PHYSICS = (
    FaultKind(
        "stall",
        Layer.PHYSICS,
        Occasion.MOMENT,
        "The shaft is blocked: pulses go on and turn nothing.",
        (AXIS, number("for_s", "How long.", 1e-6, LONGEST_S, default=1.0)),
        effect=MomentEffect(_stall, lasts=True),
    ),
    FaultKind(
        "lost-steps",
        Layer.PHYSICS,
        Occasion.MOMENT,
        "The shaft falls behind the pulses, in their direction, and stays there.",
        (AXIS, whole("pulses", "By how many pulses; negative: ahead.", -(10**9), 10**9, otherwise="four full steps")),
        effect=MomentEffect(_lose_steps),
        tried=_losses,
    ),
    FaultKind(
        "slip",
        Layer.PHYSICS,
        Occasion.MOMENT,
        "The encoder slips on the shaft.",
        (AXIS, whole("counts", "By how many counts.", -(10**9), 10**9, default=4)),
        effect=MomentEffect(_slip),
        needs=Need.ENCODER,
        faulty=FaultCategory.SENSOR,
    ),
    FaultKind(
        "stuck",
        Layer.PHYSICS,
        Occasion.ALWAYS,
        "An input keeps a level, whatever its switch does; or an output, whatever the controller does.",
        (PIN, number("value", "The level; volts on analog inputs.", 0, 10, otherwise="the one it has")),
        effect=WindowEffect(_stick),
        faulty=FaultCategory.SENSOR,
        tried=({"value": 0.0}, {"value": 1.0}),
    ),
    FaultKind(
        "master-error",
        Layer.PHYSICS,
        Occasion.ALWAYS,
        "A slave of the controller's own Modbus master does not answer: M_STATUS is 3.",
        effect=WindowEffect(_fail_master),
        needs=Need.MODBUS_MASTER,
        faulty=FaultCategory.LINE,
    ),
    FaultKind(
        "bounce",
        Layer.PHYSICS,
        Occasion.CHANGE,
        "A switch bounces: its input changes to and fro before it settles.",
        (
            PIN,
            whole("bounces", "How often it goes back.", 1, 1000, default=3),
            number("for_ms", "How long that takes.", 1e-3, LONGEST_MS, default=5.0),
        ),
        effect=ChangeEffect(_bounce),
        check=_needs_switch,
        faulty=FaultCategory.SENSOR,
    ),
    FaultKind(
        "supply-drop",
        Layer.PHYSICS,
        Occasion.MOMENT,
        "The supply fails and comes back: nothing answers, drives and outputs are off, then it is as after power-on.",
        (OFF,),
        effect=MomentEffect(_drop_supply),
        faulty=FaultCategory.POWER,
    ),
    FaultKind(
        "power-cut",
        Layer.PHYSICS,
        Occasion.SAVE,
        "The supply fails while memory is being saved: what was not yet written keeps its old content.",
        (OFF, whole("written", "Bytes written until then.", 0, None, otherwise="any number")),
        effect=SaveEffect(_cut_power),
        faulty=FaultCategory.POWER,
    ),
    FaultKind(
        "wear",
        Layer.PHYSICS,
        Occasion.SAVE,
        "The memory is worn out: with each save one more byte, chosen by chance, keeps what it has for ever.",
        (whole("writes", "Saves that go well.", 0, None, default=100_000),),
        effect=SaveEffect(_wear),
        faulty=FaultCategory.MEMORY,
        tried=({"writes": 0},),
    ),
)
