"""The M1486 in a world."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.m1486 import datasheet, points
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.pins import CONTROL_PINS, LINE_PINS, OUTPUT_PINS, refuse_taken, settable_pin
from steptwin.m1486.present import state_of
from steptwin.m1486.variants import Store, variant
from steptwin.machine import MachineEvent
from steptwin.simulation.kinds.kind import ControllerKind, LineKind, LinkKind, PointMarks, Terminals
from steptwin.simulation.kinds.m1486 import axes, build, control, faults, lanes, line, memory, programs, table
from steptwin.simulation.kinds.m1486.heldjog import M1486HeldJog
from steptwin.simulation.kinds.m1486.table import M1486Spec
from steptwin.simulation.kinds.m1486.view import M1486View
from steptwin.simulation.kinds.m1486.words import ChipLineWords, follow_writes


def _watch_events(chip: M1486Chip, call: Callable[[MachineEvent], None]) -> None:
    chip.on_event = call


CHARACTERS = LineKind(
    name="m1486",
    meaning="m1486",
    links={
        "pty": LinkKind("raw", "pty", "M1486 line"),
        "serial": LinkKind("raw", "serial", "M1486 line"),
        "tcp": LinkKind("raw", "tcp", "M1486 line"),
        "rfc2217": LinkKind("raw", "tcp", "network port"),
    },
    make=line.make,
    words=ChipLineWords,
    writes=follow_writes,
)

M1486: ControllerKind[M1486Spec, M1486Chip, M1486View] = ControllerKind(
    name="m1486",
    model="M1486",
    article="an",
    spec=table.M1486Spec,
    files=table.files,
    build=build.build,
    watch_events=_watch_events,
    keep_memory=build.keep_memory,
    announced=lambda chip, _: {"kind": "m1486", "chip": f"{chip.address:X}", "variant": chip.variant.name},
    line=CHARACTERS,
    address=lambda spec, chip: chip.address,
    # User lines are both inputs and outputs (manual chapter II).
    terminals=Terminals(digital_inputs=(*LINE_PINS, *CONTROL_PINS), analog_inputs=(), outputs=(*LINE_PINS, *OUTPUT_PINS)),
    input_pin=settable_pin,
    refuse_taken=lambda chip, pin: refuse_taken(pin, chip.interface),
    scale=axes.scale,
    is_idle=lambda chip, now: chip.is_idle(),
    datasheet=datasheet.datasheet,
    pins=lambda chip: datasheet.pins_of(chip.variant),
    datasheet_of=lambda name: datasheet.datasheet_of(variant(name or table.DEFAULT_VARIANT)),
    point=points.live_point,
    marks=PointMarks(points.marks, points.mark_of),
    control=control.CONTROL,
    halt=control.halt,
    motion_ends=control.motion_ends,
    seek=control.seek,
    held_jog=M1486HeldJog,
    state=state_of,
    languages=(memory.COMMANDS,),
    dialect_keys=("variant", "interface"),
    texts=memory.texts,
    download=memory.download,
    programs=programs.programs,
    view=M1486View,
    lanes=lanes.lanes,
    body=faults.body,
    keeps_memory=lambda chip: chip.variant.store is Store.EEPROM,
)
