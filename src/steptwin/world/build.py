"""From a description to machines in kernels: one kernel for all that is joined by wires, lines and mechanics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial

from steptwin.diagnostics import Diagnostic, Severity, SourceText, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.machine import MachineEvent, MotionController, Nanos
from steptwin.world.chance import Chance
from steptwin.world.contacts import Button, Circuit, Switch, Zone
from steptwin.world.course import Build
from steptwin.world.faults import Faults
from steptwin.world.kernel import Kernel, PinName, Wire
from steptwin.world.kind import ANALOG_INPUT, DIGITAL_INPUT, OUTPUT, AnyKind, Member
from steptwin.world.kinds import line_kinds
from steptwin.world.lines import Line
from steptwin.world.mechanics import EncoderBuild, Mechanism, RotorMark
from steptwin.world.names import Unknown
from steptwin.world.scale import Scale, motor_of, scale_of
from steptwin.world.sources import WAVEFORMS, AnalogSource
from steptwin.world.spec import AxisSpec, ButtonSpec, ControllerSpec, LineSpec, SourceSpec, SwitchSpec, WorldSpec
from steptwin.world.tomlplaces import Path
from steptwin.world.trace import Recorder, TraceRecord

Files = Mapping[str, bytes]
"""Contents of the files a description names, and of non-volatile memories (`memory_file`)."""
Keep = Callable[[str, bytes, Nanos], None]
"""Keeps the new non-volatile memory of a controller that is named, at a moment, and returns when it is safe. Raises `OSError`."""


def memory_file(name: str) -> str:
    """The name among the files of a world of what a controller has in its non-volatile memory at first."""
    return f"state:{name}"


@dataclass(frozen=True, slots=True)
class Fitted:
    """An axis with its mechanics."""

    spec: AxisSpec
    kernel: Kernel
    mechanism: Mechanism
    scale: Scale

    def units(self, pulses: int) -> float:
        scale = self.scale.pulses_per_unit
        return pulses * scale.denominator / scale.numerator


@dataclass(slots=True)
class WorldParts:
    """Everything a world is made of, by name."""

    spec: WorldSpec
    faults: Faults
    record: Recorder
    kernels: list[Kernel] = field(default_factory=list)
    kernel_of: dict[str, Kernel] = field(default_factory=dict)
    """Of machines and lines."""
    machines: dict[str, MotionController] = field(default_factory=dict)
    kind_of: dict[str, AnyKind] = field(default_factory=dict)
    """Of machines."""
    lines: dict[str, Line] = field(default_factory=dict)
    line_of: dict[str, tuple[Line, int]] = field(default_factory=dict)
    """Line and unit (or address) of a machine."""
    axes: dict[str, Fitted] = field(default_factory=dict)
    buttons: dict[str, tuple[Button, Kernel]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    """Warnings about the files that the description names."""


def build(spec: WorldSpec, files: Files, record: Recorder, keep: Keep | None = None) -> WorldParts:
    """The machines of a description at time 0. Raises `WorldError` where its parts do not fit together.

    ``keep`` is called whenever a controller has a new non-volatile memory.
    """
    return _Builder(spec, files, record, keep).plan


class _Builder:
    def __init__(self, spec: WorldSpec, files: Files, record: Recorder, keep: Keep | None) -> None:
        self.spec = spec
        self.files = files
        self._keep = keep
        self.plan = WorldParts(spec, Faults(spec.seed), record)
        self.plan.faults.sinks.append(record)
        self._driven: dict[PinName, Path] = {}
        """What drives each input."""
        self._circuits: dict[PinName, tuple[Circuit, str | None]] = {}
        """The contacts of inputs, and their ``join``."""
        self._make_machines()
        self._make_kernels()
        self._make_lines()
        for axis in spec.axes:
            self._unless_wrong(axis.path, partial(self._fit, axis))
        for axis in spec.axes:
            self._unless_wrong(axis.path, partial(self._fit_encoder, axis))
        for wire in spec.wires:
            self._unless_wrong(wire.path, partial(self._wire, wire.source, wire.target, wire.path, wire.inverted, wire.delay))
        for button in spec.buttons:
            self._unless_wrong(button.path, partial(self._button, button))
        for source in spec.sources:
            self._unless_wrong(source.path, partial(self._source, source))
        if not spec.text.findings:
            for circuit, _ in self._circuits.values():
                circuit.close()

    def _unless_wrong(self, path: Path, action: Callable[[], None]) -> None:
        """Do something for the table at ``path``, unless it has an error already; errors are collected there."""
        if self.spec.text.is_wrong(path):
            return
        try:
            action()
        except SourceErrors as error:
            self.spec.text.wrong_file(path, error)
        except Misuse as error:
            self.spec.text.wrong_reference(path, error)

    # ------------------------------------------------------------------ machines

    def _make_machines(self) -> None:
        for spec in self.spec.controllers:
            self._unless_wrong(spec.path, partial(self._add_machine, spec))

    def _add_machine(self, spec: ControllerSpec) -> None:
        memory = self.files.get(memory_file(spec.name))
        machine = spec.kind.build(spec, memory, self)
        self.plan.machines[spec.name] = machine
        self.plan.kind_of[spec.name] = spec.kind
        spec.kind.watch_events(machine, partial(_record_event, self.plan.record, spec.name))
        keep = self._keep
        if keep is not None:
            spec.kind.keep_memory(machine, memory, lambda data: keep(spec.name, data, machine.now))

    def data(self, name: str) -> bytes:
        """As `BuildContext.data`."""
        found = self.files.get(name)
        if found is None:
            raise Misuse(f"the content of the file {name!r} is not given with the description")
        return found

    def warn(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `BuildContext.warn`."""
        shown = [finding for finding in findings if finding.severity is Severity.WARNING]
        if shown and (text := render(source, shown)) not in self.plan.warnings:
            self.plan.warnings.append(text)

    # ------------------------------------------------------------------ kernels

    def _make_kernels(self) -> None:
        """Machines that share a line, a wire or mechanics share a kernel; kernels go by their first machine."""
        joined = {name: name for name in [*self.plan.machines, *(line.name for line in self.spec.lines)]}

        def root(name: str) -> str:
            while joined[name] != name:
                joined[name] = joined[joined[name]]
                name = joined[name]
            return name

        order = {name: i for i, name in enumerate(joined)}
        for one, other, path in self._joints():
            unknown = [name for name in dict.fromkeys((one, other)) if name not in joined]
            for name in unknown:
                if not self.spec.text.may_be_broken(name):
                    near = self.spec.text.near(name, joined)
                    there = ", ".join(joined) or "none"
                    fix = self.spec.text.replacement(path, name, self.spec.text.meant(name, joined))
                    self.spec.text.wrong(path, "D009", f"nothing is called {name!r}{near}", f"there are {there}", fix)
            if unknown:
                continue
            first, second = sorted((root(one), root(other)), key=order.__getitem__)
            joined[second] = first
        for name in joined:
            kernel = self.plan.kernel_of.get(root(name))
            if kernel is None:
                kernel = Kernel(record=self.plan.record)
                self.plan.kernels.append(kernel)
            self.plan.kernel_of[root(name)] = self.plan.kernel_of[name] = kernel
            if name in self.plan.machines:
                kernel.add(name, self.plan.machines[name])

    def _joints(self) -> Iterator[tuple[str, str, Path]]:
        spec = self.spec
        drives = {axis.name: axis.drive[0] for axis in spec.axes}
        for controller in spec.controllers:
            if controller.line is not None:
                yield controller.name, controller.line, (*controller.path, "line")
        for axis in spec.axes:
            yield axis.drive[0], axis.drive[0], (*axis.path, "drive")
            for switch in axis.switches:
                yield axis.drive[0], switch.target[0], (*switch.path, "to")
            if axis.encoder is not None and axis.encoder.follows in drives:
                yield axis.drive[0], drives[axis.encoder.follows], (*axis.encoder.path, "follows")
        for wire in spec.wires:
            yield wire.source[0], wire.target[0], wire.path
        for button in spec.buttons:
            yield button.target[0], button.target[0], (*button.path, "to")
        for source in spec.sources:
            yield source.target[0], source.target[0], (*source.path, "to")

    # ------------------------------------------------------------------ lines

    def _make_lines(self) -> None:
        for spec in self.spec.lines:
            self._unless_wrong(spec.path, partial(self._line, spec))

    def _line(self, spec: LineSpec) -> None:
        plan, kind = self.plan, line_kinds()[spec.kind]
        members: list[Member] = []
        for controller in self.spec.controllers:
            if controller.line != spec.name or controller.name not in plan.machines:
                continue
            if controller.kind.line is not kind:
                raise Misuse(f"{controller.name!r} cannot be on a line of kind {kind.name}")
            machine = plan.machines[controller.name]
            members.append(Member(spec=controller, machine=machine, address=controller.kind.address(controller, machine)))
        if not members and self.spec.text.is_any_wrong(*self.spec.text.controllers):
            self.spec.text.leave_out(spec.name)
            return
        if not members:
            raise Misuse("nothing is on this line")
        kernel = self._kernel(spec.name)
        line = kind.make(spec, members, kernel, plan.record, plan.faults)
        kernel.add_part(line)
        plan.lines[spec.name] = line
        for member in members:
            plan.line_of[member.spec.name] = line, member.address

    # ------------------------------------------------------------------ mechanics

    def _fit(self, spec: AxisSpec) -> None:
        plan = self.plan
        machine, drive = spec.drive
        number = int(drive[1:]) if drive.startswith("M") and drive[1:].isdecimal() else 0
        axes = len(self._machine(machine).axes)
        if not 1 <= number <= axes:
            raise Misuse(f"drive = '{machine}.{drive}': {machine} has {', '.join(f'M{n}' for n in range(1, axes + 1))}")
        taken = [axis.spec.name for axis in plan.axes.values() if axis.spec.drive == spec.drive]
        if taken:
            raise Misuse(f"drive = '{machine}.{drive}' moves {taken[0]!r} already")
        kernel = self._kernel(machine)
        scale = scale_of(spec, plan.kind_of[machine].scale(spec, plan.machines[machine], number))
        pulses = scale.nearest
        build = Build(
            sign=-1 if spec.inverted else 1,
            zero=pulses(spec.start),
            low=None if spec.travel is None else pulses(spec.travel[0]),
            high=None if spec.travel is None else pulses(spec.travel[1]),
            play=pulses(spec.backlash),
            period_p=scale.period_p,
            motor=None if spec.motor is None else motor_of(spec.motor, spec.kind, scale),
        )
        mechanism = Mechanism(kernel, machine, number, build, spec.name)
        kernel.add_part(mechanism)
        plan.axes[spec.name] = Fitted(spec, kernel, mechanism, scale)
        for n, switch in enumerate(spec.switches, start=1):
            self._unless_wrong(switch.path, partial(self._switch, plan.axes[spec.name], switch, f"{spec.name}.switch{n}"))

    def _switch(self, axis: Fitted, spec: SwitchSpec, lane: str) -> None:
        scale = axis.scale
        pulses = scale.nearest
        zone = Zone(None, None)
        if spec.below is not None:
            zone = Zone(None, pulses(spec.below), pulses(spec.hysteresis))
        elif spec.above is not None:
            zone = Zone(pulses(spec.above), None, pulses(spec.hysteresis))
        elif spec.position is not None:
            half = 0.5 * spec.width
            usual = scale.turn if axis.spec.kind == "rotary" else None
            period = usual if spec.period is None else scale.pulses(spec.period)
            zone = Zone(pulses(spec.position - half), pulses(spec.position + half), pulses(spec.hysteresis), period)
        circuit = self._circuit(axis.kernel, spec.target, (*spec.path, "to"), spec.join)
        part = Switch(
            circuit,
            axis.mechanism,
            zone,
            axis.kernel.now,
            normally_closed=spec.contact == "NC",
            bounce_ns=spec.bounce,
            bounces=spec.bounces,
            chance=self._chance(circuit),
            lane=lane,
        )
        axis.kernel.add_part(part)

    def _fit_encoder(self, spec: AxisSpec) -> None:
        plan = self.plan
        fitted = plan.axes.get(spec.name)
        machine = plan.machines.get(spec.drive[0])
        if fitted is None or machine is None:
            return
        encoder, mechanism = spec.encoder, fitted.mechanism
        name = spec.drive[0]
        kind = plan.kind_of[name]
        encoders = kind.encoders
        if encoders is None:
            if encoder is not None:
                raise Misuse(f"encoder: {name} is {kind.title}, which reads none")
            return
        now = fitted.kernel.now
        reader = encoders.reader(machine)
        if encoder is None:
            if not mechanism.build.ideal:
                mechanism.fit(EncoderBuild(name, reader, mechanism.number), now)
            return
        turned = fitted
        if encoder.follows is not None:
            other = plan.axes.get(encoder.follows)
            if other is None:
                raise Unknown(encoder.follows, f"encoder: follows = {encoder.follows!r}: axes are {', '.join(plan.axes)}")
            turned = other
        counts: Fraction | None = None
        if encoder.counts_per_unit is not None:
            counts = Fraction(str(encoder.counts_per_unit)) / turned.scale.pulses_per_unit
        elif encoder.counts_per_rev is not None:
            counts = Fraction(encoder.counts_per_rev, turned.scale.pulses_per_rev)
        if encoder.slip:
            if counts is None:
                counts = encoders.counts_per_pulse(machine, mechanism.number)
            counts *= 1 - Fraction(str(encoder.slip))
        on_load = encoder.mount == "load" or encoder.follows is not None
        numerator, denominator = (None, 1) if counts is None else (counts.numerator, counts.denominator)
        turned.mechanism.fit(EncoderBuild(name, reader, mechanism.number, on_load, numerator, denominator), now)
        if encoder.index:
            low = fitted.scale.nearest(encoder.offset)
            period = fitted.scale.pulses_per_rev
            target = (name, encoders.index_input(mechanism.number))
            circuit = self._circuit(fitted.kernel, target, (*encoder.path, "index"), None)
            zone = Zone(low, low + encoder.index_width - 1, 0, period)
            fitted.kernel.add_part(Switch(circuit, RotorMark(turned.mechanism), zone, now))

    # ------------------------------------------------------------------ wires, buttons, sources

    def _machine(self, name: str) -> MotionController:
        """What has pins and axes: no line."""
        found = self.plan.machines.get(name)
        if found is None and name not in self.plan.kernel_of:
            raise Unknown(name, f"nothing is called {name!r}")
        if found is None:
            raise Misuse(f"{name!r} is a line; machines are {', '.join(self.plan.machines)}")
        return found

    def _check_terminal(self, name: PinName, kind: str) -> None:
        machine, its = self._machine(name.machine), self.plan.kind_of[name.machine]
        its.terminals.check(name, kind)
        its.refuse_taken(machine, name.pin)

    def _kernel(self, name: str) -> Kernel:
        found = self.plan.kernel_of.get(name)
        if found is None:
            raise Unknown(name, f"nothing is called {name!r}")
        return found

    def _input(self, name: tuple[str, str], path: Path, kind: str = DIGITAL_INPUT) -> PinName:
        """An input that nothing else drives."""
        target = PinName(*name)
        text = self.spec.text
        if target in self._driven:
            raise Misuse(f"{target} is driven already, from line {text.line(self._driven[target])}")
        self._check_terminal(target, kind)
        self._driven[target] = path
        return target

    def _circuit(self, kernel: Kernel, name: tuple[str, str], path: Path, join: str | None) -> Circuit:
        """What a contact is part of: an input of its own, or one that it shares with contacts that are joined in the same way."""
        target = PinName(*name)
        there, their_join = self._circuits.get(target, (None, None))
        if there is None:
            circuit = Circuit(kernel, self._input(name, path), in_series=join == "series")
            self._circuits[target] = circuit, join
            return circuit
        if join is None or join != their_join:
            line = self.spec.text.line(self._driven[target])
            raise Misuse(
                f"{target} is driven already, from line {line}: contacts that share an input all have join = 'parallel', "
                "or all join = 'series'"
            )
        return there

    def _chance(self, circuit: Circuit) -> Chance:
        """Of the contact that is put into a circuit next."""
        number = f" {len(circuit.contacts) + 1}" if circuit.contacts else ""
        return Chance(self.spec.seed, f"bounce {circuit.target}{number}")

    def _wire(self, source: tuple[str, str], target: tuple[str, str], path: Path, inverted: bool, delay: Nanos) -> None:
        kernel = self._kernel(source[0])
        self._check_terminal(PinName(*source), OUTPUT)
        kernel.connect(Wire(PinName(*source), self._input(target, path), inverted, delay))

    def _button(self, spec: ButtonSpec) -> None:
        kernel = self._kernel(spec.target[0])
        circuit = self._circuit(kernel, spec.target, spec.path, spec.join)
        button = Button(
            circuit,
            normally_closed=spec.contact == "NC",
            bounce_ns=spec.bounce,
            bounces=spec.bounces,
            chance=self._chance(circuit),
            lane=spec.name,
        )
        button.rest_at(spec.contact == "NC")
        kernel.add_part(button)
        self.plan.buttons[spec.name] = button, kernel

    def _source(self, spec: SourceSpec) -> None:
        kernel = self._kernel(spec.target[0])
        target = self._input(spec.target, spec.path, ANALOG_INPUT)
        kernel.add_part(AnalogSource(kernel, target, WAVEFORMS[spec.kind](spec), spec.period))


def _record_event(record: Recorder, machine: str, event: MachineEvent) -> None:
    record(TraceRecord(event.time, machine, "event", event.code, event.text, event.facts))
