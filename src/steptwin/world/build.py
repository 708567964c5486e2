"""From a description to machines in kernels: one kernel for all that is joined by wires, lines and mechanics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial

from steptwin.diagnostics import Diagnostic, Severity, Source, render
from steptwin.errors import Misuse
from steptwin.m1486.chip import M1486
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import interface
from steptwin.m1486.syntax import parse as parse_m1486
from steptwin.m1486.variants import Store, Variant, variant
from steptwin.machine import Event, Nanos
from steptwin.mic488.config import BAUDS, ConfigError, ControllerConfig, examine_config
from steptwin.mic488.device import Mic488
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.inputs import index_input
from steptwin.mic488.program import LoadedProgram, load, setup_of
from steptwin.mic488.registers import firmware
from steptwin.textcodec import decode
from steptwin.wbc.check import check
from steptwin.wbc.decompile import IMAGE, program_of
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.world.chance import Chance
from steptwin.world.contacts import Button, Circuit, Switch, Zone
from steptwin.world.course import Build
from steptwin.world.description import config_of
from steptwin.world.faults import Faults
from steptwin.world.kernel import Kernel, PinName, Wire
from steptwin.world.lines import ChipLine, Line, ModbusLine, timing_of
from steptwin.world.mechanics import EncoderBuild, Mechanism, RotorMark
from steptwin.world.names import Unknown
from steptwin.world.scale import Scale, motor_of, scale_of
from steptwin.world.sources import Constant, Sine, Table, Waveform
from steptwin.world.sources import Source as AnalogSource
from steptwin.world.spec import AxisSpec, ButtonSpec, LineSpec, M1486Spec, Mic488Spec, SourceSpec, SwitchSpec, WorldSpec
from steptwin.world.terminals import ANALOG_INPUT, DIGITAL_INPUT, OUTPUT, check_terminal
from steptwin.world.tomlplaces import Path
from steptwin.world.trace import Record, Recorder

Files = Mapping[str, bytes]
"""Contents of the files a description names."""


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
class Plan:
    """Everything a world is made of, by name."""

    spec: WorldSpec
    faults: Faults
    record: Recorder
    kernels: list[Kernel] = field(default_factory=list)
    kernel_of: dict[str, Kernel] = field(default_factory=dict)
    """Of machines and lines."""
    machines: dict[str, Mic488 | M1486] = field(default_factory=dict)
    lines: dict[str, Line] = field(default_factory=dict)
    line_of: dict[str, tuple[Line, int]] = field(default_factory=dict)
    """Line and unit (or address) of a machine."""
    axes: dict[str, Fitted] = field(default_factory=dict)
    buttons: dict[str, tuple[Button, Kernel]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    """What is doubtful in the files that the description names, for people."""


def build(spec: WorldSpec, files: Files, record: Recorder) -> Plan:
    """The machines of a description at time 0. Raises `WorldError` where its parts do not fit together."""
    return _Builder(spec, files, record).plan


class _Builder:
    def __init__(self, spec: WorldSpec, files: Files, record: Recorder) -> None:
        self.spec = spec
        self.files = files
        self.plan = Plan(spec, Faults(spec.seed), record)
        self.plan.faults.sinks.append(record)
        self._driven: dict[PinName, Path] = {}
        """What drives each input."""
        self._circuits: dict[PinName, tuple[Circuit, str | None]] = {}
        """The contacts of inputs, and their ``join``."""
        self._make_machines()
        self._make_kernels()
        self._make_lines()
        for axis in spec.axes:
            self._told(axis.path, partial(self._fit, axis))
        for axis in spec.axes:
            self._told(axis.path, partial(self._fit_encoder, axis))
        for wire in spec.wires:
            self._told(wire.path, partial(self._wire, wire.source, wire.target, wire.path, wire.inverted, wire.delay))
        for button in spec.buttons:
            self._told(button.path, partial(self._button, button))
        for source in spec.sources:
            self._told(source.path, partial(self._source, source))
        if not spec.text.findings:
            for circuit, _ in self._circuits.values():
                circuit.close()

    def _told(self, path: Path, action: Callable[[], None]) -> None:
        """Do something for the table at ``path``, unless something is wrong with it already; what is wrong is told there."""
        if self.spec.text.is_wrong(path):
            return
        try:
            action()
        except Misuse as error:
            self.spec.text.wrong_reference(path, error)

    # ------------------------------------------------------------------ machines

    def _make_machines(self) -> None:
        for spec in self.spec.mic488:
            self._told(spec.path, partial(self._add_machine, spec, self._mic488))
        for chip in self.spec.m1486:
            self._told(chip.path, partial(self._add_machine, chip, self._m1486))

    def _add_machine(self, spec: Mic488Spec | M1486Spec, make: Callable[..., Mic488 | M1486]) -> None:
        machine = make(spec)
        self.plan.machines[spec.name] = machine
        machine.on_event = partial(_record_event, self.plan.record, spec.name)

    def _data(self, name: str) -> bytes:
        found = self.files.get(name)
        if found is None:
            raise Misuse(f"the content of the file {name!r} is not given with the description")
        return found

    def _text(self, name: str) -> str:
        return decode(self._data(name), name).text

    def _warn(self, source: Source, findings: Iterable[Diagnostic]) -> None:
        shown = [finding for finding in findings if finding.severity is Severity.WARNING]
        if shown and (text := render(source, shown)) not in self.plan.warnings:
            self.plan.warnings.append(text)

    def _mic488(self, spec: Mic488Spec) -> Mic488:
        base = ControllerConfig()
        if spec.config is not None:
            file = IniFile.parse(self._data(spec.config), spec.config)
            base, found = examine_config(file, spec.firmware)
            if any(finding.severity is Severity.ERROR for finding in found):
                raise ConfigError(file.source, found)
            self._warn(file.source, found)
        config = config_of(spec, base)
        programs, positions = self._banks(spec, config)
        statement_time = STATEMENT_TIME if spec.statement_time is None else spec.statement_time
        return Mic488(
            config, spec.firmware, lenient=spec.lenient, programs=programs, positions=positions, statement_time=statement_time
        )

    def _banks(self, spec: Mic488Spec, config: ControllerConfig) -> tuple[dict[int, LoadedProgram], dict[int, PositionTable]]:
        """What is in the banks. Names of positions are found in the table of the same bank, or else in the only one there is."""
        number = firmware(spec.firmware).banks
        for key, given in (("programs", spec.all_programs), ("positions", spec.positions)):
            for bank, name in given:
                if bank >= number:
                    raise Misuse(f"{key}: {name} is for bank {bank}: firmware {spec.firmware} has banks 0 to {number - 1}")
        tables = {bank: self._positions(name) for bank, name in spec.positions}
        sources: dict[int, Source] = {}
        for bank, name in spec.all_programs:
            if name.lower().endswith(IMAGE):
                sources[bank], table, doubts = program_of(self._data(name), name)
                self._warn(sources[bank], doubts)
                if table.rows:
                    tables.setdefault(bank, table)
            else:
                sources[bank] = Source(name, self._text(name))
        only = next(iter(tables.values())) if len(tables) == 1 else None
        programs: dict[int, LoadedProgram] = {}
        for bank, name in spec.all_programs:
            checked = check(sources[bank].text, tables.get(bank, only), setup_of(config), dialect_for(spec.firmware))
            if checked.errors:
                raise Misuse(f"the program does not check:\n{render(sources[bank], checked.errors)}")
            self._warn(sources[bank], checked.diagnostics)
            programs[bank] = load(checked, name)
        return programs, tables

    def _positions(self, name: str) -> PositionTable:
        source = Source(name, self._text(name))
        table, findings = parse_positions(source.text)
        errors = [finding for finding in findings if finding.severity is Severity.ERROR]
        if errors or table is None:
            raise Misuse(f"positions do not check:\n{render(source, errors)}")
        self._warn(source, findings)
        return table

    def _m1486(self, spec: M1486Spec) -> M1486:
        kind = variant(spec.variant)
        image = b"" if spec.program is None else _image(self._text(spec.program), spec.program, kind)
        timed = any(line.name == spec.line and line.timing != "off" for line in self.spec.lines)
        baud = spec.baud
        if baud is None:
            baud = next((line.baud for line in self.spec.lines if line.name == spec.line), None)
        return M1486(
            kind,
            address=spec.address,
            interface=interface(spec.interface),
            baud=baud,
            statement_ns=spec.statement_time,
            is_timed=timed,
            image=image,
        )

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
                    self.spec.text.wrong(path, "D009", f"nothing is called {name!r}{near}", f"there are {there}")
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
        for controller in (*spec.mic488, *spec.m1486):
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
            self._told(spec.path, partial(self._line, spec))

    def _line(self, line_spec: LineSpec) -> None:
        name, kind, baud, timed = line_spec.name, line_spec.kind, line_spec.baud, line_spec.timing
        plan, kernel = self.plan, self._kernel(name)
        chips: list[M1486] = []
        devices: dict[int, Mic488] = {}
        names: dict[int, str] = {}
        for spec in (*self.spec.mic488, *self.spec.m1486):
            if spec.line != name or spec.name not in plan.machines:
                continue
            machine = plan.machines[spec.name]
            if isinstance(machine, M1486) is not (kind == "m1486"):
                raise Misuse(f"{spec.name!r} cannot be on a line of kind {kind}")
            if isinstance(machine, M1486):
                chips.append(machine)
                names[machine.address] = spec.name
                continue
            unit = machine.config.address if not isinstance(spec, Mic488Spec) or spec.unit is None else spec.unit
            if unit in devices:
                raise Misuse(f"unit {unit} is both {names[unit]!r} and {spec.name!r}")
            devices[unit] = machine
            names[unit] = spec.name
        if not names and self.spec.text.is_any_wrong("mic488", "m1486"):
            self.spec.text.leave_out(name)
            return
        if not names:
            raise Misuse("nothing is on this line")
        if kind == "modbus" and baud is not None and baud not in BAUDS:
            raise Misuse(f"baud = {baud}: a MIC488 has {', '.join(map(str, BAUDS))} bit/s")
        line: Line
        if kind == "m1486":
            if timed == "strict":
                raise Misuse("timing = 'strict' is for lines of kind modbus: an M1486 has no time-out between characters")
            line = ChipLine(kernel, name, plan.record, plan.faults, chips)
        else:
            baud = baud or next(iter(devices.values())).config.ports[0].baud
            timing = None if timed == "off" else timing_of(baud, strict=timed == "strict")
            line = ModbusLine(
                kernel, name, plan.record, plan.faults, devices=devices, timing=timing, baud=baud, gap=line_spec.gap
            )
        kernel.add_part(line)
        plan.lines[name] = line
        for unit, machine_name in names.items():
            plan.line_of[machine_name] = line, unit

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
        scale = scale_of(spec, plan.machines[machine], number)
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
            self._told(switch.path, partial(self._switch, plan.axes[spec.name], switch, f"{spec.name}.switch{n}"))

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
        if fitted is None:
            return
        encoder, mechanism = spec.encoder, fitted.mechanism
        if not isinstance(machine, Mic488):
            if encoder is not None:
                raise Misuse(f"encoder: {spec.drive[0]} is an M1486, which reads none")
            return
        now = fitted.kernel.now
        if encoder is None:
            if not mechanism.build.ideal:
                mechanism.fit(EncoderBuild(spec.drive[0], machine, mechanism.number), now)
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
                own = machine.axes[mechanism.number - 1].encoder
                counts = Fraction(own.enc_resol, own.mot_resol)
            counts *= 1 - Fraction(str(encoder.slip))
        on_load = encoder.mount == "load" or encoder.follows is not None
        numerator, denominator = (None, 1) if counts is None else (counts.numerator, counts.denominator)
        turned.mechanism.fit(EncoderBuild(spec.drive[0], machine, mechanism.number, on_load, numerator, denominator), now)
        if encoder.index:
            low = fitted.scale.nearest(encoder.offset)
            period = fitted.scale.pulses_per_rev
            target = (spec.drive[0], f"IN{index_input(mechanism.number - 1) + 1}")
            circuit = self._circuit(fitted.kernel, target, (*encoder.path, "index"), None)
            zone = Zone(low, low + encoder.index_width - 1, 0, period)
            fitted.kernel.add_part(Switch(circuit, RotorMark(turned.mechanism), zone, now))

    # ------------------------------------------------------------------ wires, buttons, sources

    def _machine(self, name: str) -> Mic488 | M1486:
        """What has pins and axes: no line."""
        found = self.plan.machines.get(name)
        if found is None and name not in self.plan.kernel_of:
            raise Unknown(name, f"nothing is called {name!r}")
        if found is None:
            raise Misuse(f"{name!r} is a line; machines are {', '.join(self.plan.machines)}")
        return found

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
        check_terminal(self._machine(target.machine), target, kind)
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
        check_terminal(self._machine(source[0]), PinName(*source), OUTPUT)
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
        kernel.add_part(AnalogSource(kernel, target, _waveform(spec), spec.period))


def _record_event(record: Recorder, machine: str, event: Event) -> None:
    record(Record(event.time, machine, "event", event.code, event.text))


def _image(text: str, name: str, kind: Variant) -> bytes:
    parsed = parse_m1486(text)
    errors = [finding for finding in parsed.diagnostics if finding.severity is Severity.ERROR]
    if errors:
        raise Misuse(f"the program does not check:\n{render(Source(name, text), errors)}")
    if kind.store is not Store.EEPROM:
        raise Misuse(f"program: {kind.title} forgets its program when it is switched off; send it over the line")
    return image_of(parsed.program, kind)


def _waveform(spec: SourceSpec) -> Waveform:
    repeat = None if spec.repeat is None else spec.repeat / 1e9
    if spec.kind == "constant":
        return Constant(spec.value)
    if spec.kind == "sine":
        return Sine(spec.value, spec.amplitude, spec.frequency, spec.phase)
    if spec.kind == "ramp":
        if spec.ramp_time <= 0:
            raise Misuse("a ramp needs 'over': how long it takes")
        return Table(((0.0, spec.begin), (spec.ramp_time / 1e9, spec.end)), repeat)
    if not spec.points:
        raise Misuse("a table needs points")
    return Table(spec.points, repeat)
