"""The actions of steps and of external programs on a world, at the present moment."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, get_args

from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.tables import complete
from steptwin.wire.rtu import encode_frame
from steptwin.world import script as do
from steptwin.world.control import Halt
from steptwin.world.kernel import Kernel
from steptwin.world.kind import lacks
from steptwin.world.lines import SCRIPTS
from steptwin.world.master import ANSWER_NS
from steptwin.world.programtexts import Destination, name_of_text
from steptwin.world.trace import TraceRecord
from steptwin.world.wires import PinName

if TYPE_CHECKING:
    from steptwin.world.plant import Plant


class Bytes(NamedTuple):
    """Bytes that an external program sends at its place on a line."""

    line: str
    place: str
    kind: str
    data: bytes


class See(NamedTuple):
    """A record of a vision system arrives at a controller."""

    machine: str
    number: float
    x: float
    y: float
    angle: float


class Download(NamedTuple):
    """A text goes into the program memory of a controller."""

    machine: str
    place: str
    """One of the places of `steptwin.world.programtexts.program_texts`."""
    text: str


class SetVariable(NamedTuple):
    """A debugger sets a variable of a controller's program."""

    machine: str
    name: str
    value: float


class Leave(NamedTuple):
    """An external program has disconnected."""

    line: str
    place: str


class EndScripts(NamedTuple):
    """Scripts of the description, and texts that are being typed into controllers, end. Buttons that are held are released when
    their time is over."""


class Refused(NamedTuple):
    """A controller could not do what a script from outside commanded; a replay has the command no more."""

    text: str


ExternalInput: TypeAlias = do.Step | Bytes | See | SetVariable | Download | Leave | Refused | Halt | EndScripts
"""An input from outside a world. Recorded with its moment, it can be replayed."""


def size_of(what: ExternalInput) -> int:
    """Bytes of a program outside in it, which have no bound of their own."""
    if isinstance(what, Download):
        return len(what.text)
    return len(what.data) if isinstance(what, Bytes) else 0


FOR_SCRIPTS = frozenset(
    {do.Wait, do.At, do.Until, do.Stop, do.Read, do.Call, do.Order, do.UntilOver, do.ExpectReached, do.Repeat}
)
"""Steps that only scripts can execute; all others have their action here."""


def act(plant: Plant, what: ExternalInput) -> None:
    """Execute an external input. Raises `Misuse` for unknown names, and for steps that only scripts can execute."""
    action = ACTIONS.get(type(what))
    if action is None:
        raise Misuse(f"{what}: only scripts can execute this step")
    action(plant, what)


def _record(plant: Plant, machine: str, what: str, value: object) -> None:
    plant.trace.add(TraceRecord(plant.now, machine, "input", what, value))


@contextmanager
def _now(plant: Plant, name: str) -> Generator[Kernel]:
    """The kernel of a machine or line, advanced to the present; it settles after the action."""
    kernel = plant.touch(name)
    yield kernel
    kernel.mark(name)
    kernel.settle()


def _set(plant: Plant, step: do.Set) -> None:
    for name, pin, value in step.levels:
        known = plant.input_pin(name, pin, value)
        kernel = plant.touch(name)  # as `_now`, but with hundreds of levels at a moment
        kernel.set_input(PinName(name, known), value)
        kernel.mark(name)
        kernel.settle()


def _press(plant: Plant, step: do.Press) -> None:
    _move_button(plant, step.button, pressed=True)
    if step.duration is not None:
        plant.schedule(_releasing(step.button), (do.Wait(step.duration), do.Release(step.button)))


def _release(plant: Plant, step: do.Release) -> None:
    _move_button(plant, step.button, pressed=False)


_RELEASE = "release "


def _releasing(button: str) -> str:
    """The name of the script that releases a button after a time. Scripts of a description have no blank in their names."""
    return f"{_RELEASE}{button}"


def _downloading(machine: str) -> str:
    """The name of the script that types a text into a controller."""
    return f"download {machine}"


def is_release(script: str) -> bool:
    return script.startswith(_RELEASE)


def _move_button(plant: Plant, name: str, *, pressed: bool) -> None:
    button, _ = plant.button(name)
    plant.unschedule(_releasing(name))
    with _now(plant, button.machine):
        _record(plant, button.machine, name, "pressed" if pressed else "released")
        button.press(pressed, plant.now)


def _write(plant: Plant, step: do.Write) -> None:
    parts, now = plant.parts, plant.now
    for name, values in plant.by_machine(step):
        registers = plant.registers(name)
        kernel = plant.touch(name)  # as `_now` does: every write of every script comes here
        machine, on = parts.machines[name], parts.line_of.get(name)
        for pdu in plant.requests(name, registers, values):
            if on is not None:
                line, unit = on
                line.master.ask(encode_frame(unit, pdu), ANSWER_NS, now)
            else:
                _record(plant, name, "request", pdu)
                registers.execute(machine, pdu, now)
        kernel.mark(name if on is None else on[0].name)
        kernel.settle()


def _halt(plant: Plant, given: Halt) -> None:
    with _now(plant, given.machine):
        on = plant.parts.line_of.get(given.machine)
        if on is not None:
            line, unit = on
            line.recall(unit, plant.now)
        _record(plant, given.machine, "stop", given.scope)
        plant.unschedule(_downloading(given.machine))
        plant.kind(given.machine).halt(plant.machine(given.machine), given, plant.now)


def _end_scripts(plant: Plant, given: EndScripts) -> None:
    plant.end_scripts()


def _request(plant: Plant, step: do.Request) -> None:
    line = plant.line_called(step.line)
    with _now(plant, step.line):
        line.master.ask(encode_frame(step.unit, step.pdu), step.within, plant.now)


def _send(plant: Plant, step: do.Send) -> None:
    line = plant.line_called(step.line)
    with _now(plant, step.line):
        line.receive(SCRIPTS, step.data, plant.now)


def _bytes(plant: Plant, given: Bytes) -> None:
    line = plant.line_called(given.line)
    with _now(plant, given.line):
        line.connect(given.place, given.kind)
        line.receive(given.place, given.data, plant.now)


def _see(plant: Plant, given: See) -> None:
    vision = plant.vision(given.machine)
    with _now(plant, given.machine):
        _record(plant, given.machine, "vision", given[1:])
        vision.see(plant.machine(given.machine), given[1:], plant.now)


def _download(plant: Plant, given: Download) -> None:
    kind = plant.kind(given.machine)
    if kind.download is None:
        raise lacks(given.machine, kind, "program memory")
    with _now(plant, given.machine):
        on = plant.parts.line_of.get(given.machine)
        source = SourceText(name_of_text(plant, given.machine, given.place), given.text)
        to = Destination(given.machine, None if on is None else on[0].name, given.place)
        found = kind.download(plant.machine(given.machine), to, source)
        found.put(plant.now)
        _record(plant, given.machine, "download", given.place)
        plant.downloaded[given.machine, given.place] = source
    if found.typed:
        plant.schedule(_downloading(given.machine), found.typed)


def _set_variable(plant: Plant, given: SetVariable) -> None:
    with _now(plant, given.machine):
        plant.programs_of(given.machine).set_variable(given.name, given.value, plant.now)


def _leave(plant: Plant, given: Leave) -> None:
    line = plant.line_called(given.line)
    plant.touch(given.line)
    line.leave(given.place)


def _refused(plant: Plant, given: Refused) -> None:
    plant.report_refused(given.text)


def _power_cycle(plant: Plant, step: do.PowerCycle) -> None:
    machine = plant.machine(step.machine)
    with _now(plant, step.machine):
        _record(plant, step.machine, "power-cycle", "")
        machine.power_cycle(plant.now)


def _turn(plant: Plant, step: do.Turn) -> None:
    encoders = plant.encoders(step.machine)
    with _now(plant, step.machine):
        _record(plant, step.machine, f"M{step.axis} turned", step.counts)
        encoders.reader(plant.machine(step.machine)).turn_encoder(step.axis, step.counts, plant.now)


def _couple(plant: Plant, step: do.Couple) -> None:
    encoders = plant.encoders(step.machine)
    with _now(plant, step.machine):
        _record(plant, step.machine, f"M{step.axis} coupled", step.coupling)
        encoders.couple(plant.machine(step.machine), step.axis, step.coupling, plant.now)


def _set_fault(plant: Plant, step: do.SetFault) -> None:
    plant.put_fault(step.fault)


def _clear_fault(plant: Plant, step: do.ClearFault) -> None:
    faults = plant.parts.faults
    if step.name in (active.name for active in faults.active):  # otherwise it was cleared already or is not set yet
        plant.settle_all()
        faults.remove(step.name, plant.now)


def _expect(plant: Plant, step: do.Expect) -> None:
    plant.expect(step.condition)


def _note(plant: Plant, step: do.Note) -> None:
    if plant.trace.watchers:
        plant.settle_all()  # earlier events are shown first

    plant.trace.add(TraceRecord(plant.now, "world", "event", "note", step.text))


ACTIONS: Mapping[type, Callable[[Plant, Any], None]] = complete(
    "step",
    [kind for kind in get_args(ExternalInput) if kind not in FOR_SCRIPTS],
    "action",
    {
        do.Set: _set,
        do.Press: _press,
        do.Release: _release,
        do.Write: _write,
        do.Request: _request,
        do.Send: _send,
        do.PowerCycle: _power_cycle,
        do.Turn: _turn,
        do.Couple: _couple,
        do.SetFault: _set_fault,
        do.ClearFault: _clear_fault,
        do.Expect: _expect,
        do.Note: _note,
        Bytes: _bytes,
        See: _see,
        Download: _download,
        SetVariable: _set_variable,
        Leave: _leave,
        Refused: _refused,
        Halt: _halt,
        EndScripts: _end_scripts,
    },
)
