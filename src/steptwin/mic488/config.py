"""The configuration of a MIC488, and the vendor's ``.cfg`` file.

The file itself is an `IniFile`, which loses nothing; here its values get types, ranges and meaning. Missing keys have their
defaults (MIC-27); unknown names have no effect and give a warning. Numbers take a decimal point or a decimal comma.

Diagnostics: C001–C004 form of the file; C005 name that is not known; C006 no number; C007 no whole number; C008 not
permitted; C009 limit switch on an encoder input of an axis that uses its encoder; C010 limit switch on a channel of an encoder
that another axis uses; C011 no section of a configuration in the whole file. C001, C003, C005 and C010 are warnings.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Any

from steptwin.diagnostics import Diagnostic, Fix, Severity, SourceText, Span, in_order, render
from steptwin.errors import SourceErrors
from steptwin.mic488.encoding import DINT_MAX, DINT_MIN, REAL_MAX
from steptwin.mic488.inifile import IniEntry, IniFile
from steptwin.mic488.ranges import ValueRange
from steptwin.mic488.registermap import Firmware
from steptwin.mic488.registers import AXES, DEFAULT_FIRMWARE, INPUTS, firmware
from steptwin.nearmiss import NearMiss

PORTS = 2
ANALOG_INPUTS = 2
UNITS = ("imp", "rev", "degree", "mm", "cm", "m")
BAUDS = (9600, 19200, 38400, 57600, 115200)

NO_INPUT = 20
"""``InKL``, ``InKR``: none. 0–7 are IN1–IN8, 8–19 channels C, B, A of encoders 1–4 used as inputs."""
_FIRST_CHANNEL = 8
_CHANNELS = "CBA"


@dataclass(frozen=True, slots=True)
class AxisConfig:
    """``[Axis0]``…``[Axis3]``. Quantities in configured units (u, u/s, u/s²)."""

    unit: int = 0
    """Index into `UNITS`."""
    gear: float = 1.0
    """Pulses per unit."""
    acc: float = 1000.0
    dec: float = 1000.0
    vel: float = 1000.0
    mot_resol: int = 3200
    """Pulses per motor revolution."""
    enc_resol: int = 400
    """Encoder counts per drive revolution, after ×4 quadrature."""
    enc_offset: int = 0
    """Encoder counter after reset."""
    home_mode: int = 0
    """HOME0–HOME4."""
    limit_mode: int = 0
    """0 off, 1 KL, 2 KR, 3 KL and KR."""
    in_kl: int = NO_INPUT
    """Input (from 0) of the left switch, for homing and as limit; `NO_INPUT` for none."""
    in_kr: int = NO_INPUT
    pos_ctrl_mode: int = 0
    """0 off, 1 ENCODER, 2 ENCFOLLOW."""
    err_ctrl_mode: int = 0
    """0 NONE, 1 ERRMODE0, 2 ERRMODE1, 3 ERRMODE2."""
    kp: float = 50.0
    """Gain of the position correction."""
    # MIC-19: the vendor's tool has no keys for these.
    enc_tolerance: int = 4
    """Encoder counts by which a position may be missed."""
    enc_settle_ms: int = 100
    """Time from the end of a move to the beginning of the correction."""
    err_time_ms: int = 2000
    """Longest time for which a drive may be blocked, or a correction make no progress."""
    # MIC-8: the vendor's tool has no key for this.
    en_wired: int = 1
    """Whether EN controls the drive; 0: motion commands move the axis with EN off too."""

    @property
    def unit_name(self) -> str:
        return UNITS[self.unit]

    @property
    def uses_encoder(self) -> bool:
        """Position control needs the axis' encoder, and so does homing to its channel C (HOME3, HOME4)."""
        return self.pos_ctrl_mode != 0 or self.home_mode >= 3


@dataclass(frozen=True, slots=True)
class InputConfig:
    """``[IN0]``…``[IN19]``."""

    filter: int = 0
    """0 10 ms, 1 50 ms, 2 100 ms, 3 250 ms, 4 500 ms."""
    level: int = 0
    """0 active high, 1 active low."""
    interrupt: int = 0
    """Preset of CFGINT_INn: 0 off, 1 rising, 2 falling, 3 both edges."""


@dataclass(frozen=True, slots=True)
class AnalogConfig:
    """``[AIN0]``, ``[AIN1]``: the values at 0 V and at 10 V."""

    lo_val: float = 0.0
    hi_val: float = 10.0


@dataclass(frozen=True, slots=True)
class PortConfig:
    """Serial port COM1, COM2, which the file keeps in ``[AIN0]``, ``[AIN1]``."""

    baud: int = 38400
    address: int = 1
    """Slave address, 1 to 247; read of COM1 only."""


@dataclass(frozen=True, slots=True)
class ProgramConfig:
    """``[WBC_PROGRAM]``: the program that starts at power-on."""

    activate: int = 0
    prog_bank: int = 0
    pos_bank: int = 0


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """The configuration of a controller. The defaults are those of a controller without configuration (MIC-27)."""

    axes: tuple[AxisConfig, ...] = (AxisConfig(),) * AXES
    inputs: tuple[InputConfig, ...] = (InputConfig(),) * INPUTS
    analog: tuple[AnalogConfig, ...] = (AnalogConfig(),) * ANALOG_INPUTS
    ports: tuple[PortConfig, ...] = (PortConfig(),) * PORTS
    program: ProgramConfig = ProgramConfig()
    # MIC-16: the vendor's tool has no key for it.
    trigger_keeps: int = 0
    """Whether values stored in TRIGGER mode are kept when they are triggered."""

    @property
    def address(self) -> int:
        """Slave address on both ports: that of COM1."""
        return self.ports[0].address


class ConfigError(SourceErrors):
    """A configuration file with errors; the text shows them all with file, line, key and permitted values."""

    def __init__(self, source: SourceText, findings: list[Diagnostic]) -> None:
        self.source = source
        self.findings = findings
        super().__init__(render(source, findings))


@dataclass(frozen=True, slots=True)
class ConfigKey:
    """A key of the file: the attribute it sets, its permitted values, and their description."""

    name: str
    attribute: str
    meaning: str
    """Quantity that it sets, with its unit."""
    permitted: ValueRange
    whole: bool = True
    choices: Mapping[int, str] = field(default_factory=dict)
    """The permitted numbers with their meaning, where they are few."""
    note: str = ""
    """The permitted values as text."""

    def permits(self, value: float) -> bool:
        return value in self.permitted and (not self.choices or value in self.choices)

    def nearest(self, value: float) -> str | None:
        """The permitted number nearest to one; None where numbers have meanings, or no number is the nearest."""
        if any(self.choices.values()):
            return None
        if self.choices:
            return f"{min(self.choices, key=lambda choice: abs(choice - value))}"
        low, high = self.permitted.low, self.permitted.high
        found = value if self.permits(value) else low if low is not None and value <= low else high
        return None if found is None or not self.permits(found) else f"{found:.10g}"

    @property
    def values(self) -> str:
        """The permitted values."""
        if self.note:
            return self.note
        if self.choices:
            return ", ".join(f"{v} = {text}" if text else str(v) for v, text in self.choices.items())
        return f"{'a whole number' if self.whole else 'a number'} {self.permitted}"

    @property
    def hint(self) -> str:
        return f"permitted: {self.values}"


def _choice(name: str, attribute: str, meaning: str, *texts: str) -> ConfigKey:
    choices = MappingProxyType(dict(enumerate(texts)))
    return ConfigKey(name, attribute, meaning, ValueRange(0, len(texts) - 1), choices=choices)


def _positive(name: str, attribute: str, meaning: str, unit: str) -> ConfigKey:
    permitted = ValueRange(0, REAL_MAX, above=True)
    return ConfigKey(name, attribute, meaning, permitted, whole=False, note=f"a number > 0 in {unit}")


def _number(name: str, attribute: str, meaning: str) -> ConfigKey:
    return ConfigKey(name, attribute, meaning, ValueRange(-REAL_MAX, REAL_MAX), whole=False, note="a number")


_SWITCHES = f"0…7 (IN1…IN8), 8…19 (channels C, B, A of encoders 1…4), {NO_INPUT} (none)"
_COUNT = ValueRange(1, DINT_MAX)
_DURATION_MS = ValueRange(1, 3_600_000)

AXIS_KEYS = (
    _choice("Unit", "unit", "the unit of positions, u", *UNITS),
    _positive("Gear", "gear", "pulses per u", "pulses per unit"),
    _positive("Acc", "acc", "acceleration, u/s²", "units/s²"),
    _positive("Dec", "dec", "deceleration, u/s²", "units/s²"),
    _positive("Vel", "vel", "velocity, u/s", "units/s"),
    ConfigKey(
        "MotResol", "mot_resol", "pulses per motor revolution", _COUNT, note="a whole number ≥ 1 in pulses per motor revolution"
    ),
    ConfigKey(
        "EncResol",
        "enc_resol",
        "encoder counts per drive revolution, after ×4 quadrature",
        _COUNT,
        note="a whole number ≥ 1 in encoder counts per drive revolution",
    ),
    ConfigKey("EncOffset", "enc_offset", "encoder counts after reset", ValueRange(DINT_MIN, DINT_MAX)),
    _choice("HomeMode", "home_mode", "how it is homed", "HOME0", "HOME1", "HOME2", "HOME3", "HOME4"),
    _choice("LimitMode", "limit_mode", "which limit switches stop it", "OFF", "KL", "KR", "KL+KR"),
    ConfigKey("InKL", "in_kl", "input of the left switch, for homing and as limit", ValueRange(0, NO_INPUT), note=_SWITCHES),
    ConfigKey("InKR", "in_kr", "input of the right switch, for homing and as limit", ValueRange(0, NO_INPUT), note=_SWITCHES),
    _choice("PosCtrlMode", "pos_ctrl_mode", "what it does with its encoder", "OFF", "ENCODER", "ENCFOLLOW"),
    _choice("ErrCtrlMode", "err_ctrl_mode", "what it does when it is blocked", "NONE", "ERRMODE0", "ERRMODE1", "ERRMODE2"),
    ConfigKey("Kp", "kp", "gain of the position correction", ValueRange(0, REAL_MAX), whole=False, note="a number ≥ 0"),
    ConfigKey(
        "EncTolerance",
        "enc_tolerance",
        "encoder counts by which a position may be missed",
        ValueRange(0, DINT_MAX),
        note="a whole number ≥ 0 in encoder counts",
    ),
    ConfigKey(
        "EncSettle",
        "enc_settle_ms",
        "ms from the end of a move to the correction",
        _DURATION_MS,
        note=f"a whole number {_DURATION_MS} in ms",
    ),
    ConfigKey(
        "ErrTime",
        "err_time_ms",
        "ms for which it may be blocked, or a correction make no progress",
        _DURATION_MS,
        note=f"a whole number {_DURATION_MS} in ms",
    ),
    _choice("EnWired", "en_wired", "whether EN controls the drive", "not wired", "wired"),
)
INPUT_KEYS = (
    _choice("Filter", "filter", "how long a level must last", "10 ms", "50 ms", "100 ms", "250 ms", "500 ms"),
    _choice("Level", "level", "which level is 1", "active high", "active low"),
    _choice("Int", "interrupt", "which edges call the interrupt at first", "off", "rising", "falling", "both edges"),
)
ANALOG_KEYS = (_number("LoVal", "lo_val", "the value at 0 V"), _number("HiVal", "hi_val", "the value at 10 V"))
BAUD_KEY = ConfigKey("Baud", "baud", "bit/s", ValueRange(BAUDS[0], BAUDS[-1]), choices=MappingProxyType(dict.fromkeys(BAUDS, "")))
ADDRESS_KEY = ConfigKey("ID", "address", "slave address on both ports", ValueRange(1, 247))


TRIGGER_KEYS = (
    _choice("Keep", "trigger_keeps", "what a trigger does with stored values", "a trigger uses values up", "values are kept"),
)


def program_keys(generation: Firmware) -> tuple[ConfigKey, ...]:
    banks = ValueRange(0, generation.banks - 1)
    return (
        _choice("Activate", "activate", "what runs at power-on", "no program", "run at power-on"),
        ConfigKey("ProgBankToRun", "prog_bank", "bank of the program", banks),
        ConfigKey("PosBankToRun", "pos_bank", "bank of its positions", banks),
    )


def sections_of() -> tuple[str, ...]:
    """The names of the sections, in the order of the vendor's tool."""
    numbered = (("Axis", AXES), ("IN", INPUTS), ("AIN", ANALOG_INPUTS))
    return (*(f"{name}{n}" for name, count in numbered for n in range(count)), "WBC_PROGRAM", "TRIGGER")


def keys_of(section: str, firmware_name: str = DEFAULT_FIRMWARE) -> tuple[ConfigKey, ...]:
    """The keys of a section. Raises `Misuse` for an unknown firmware."""
    if section == "WBC_PROGRAM":
        return program_keys(firmware(firmware_name))
    if section == "TRIGGER":
        return TRIGGER_KEYS
    return {"Axis": AXIS_KEYS, "IN": INPUT_KEYS, "AIN": (*ANALOG_KEYS, BAUD_KEY, ADDRESS_KEY)}[section.rstrip("0123456789")]


def examine_config(file: IniFile, firmware_name: str = DEFAULT_FIRMWARE) -> tuple[ControllerConfig, list[Diagnostic]]:
    """The configuration in a file for a firmware, and its diagnostics in the order of the text.

    A value with an error is replaced by its default. Raises `Misuse` for an unknown firmware.
    """
    reader = _ConfigReader(file)
    config = ControllerConfig(
        axes=tuple(AxisConfig(**reader.values(f"Axis{n}", AXIS_KEYS)) for n in range(AXES)),
        inputs=tuple(InputConfig(**reader.values(f"IN{n}", INPUT_KEYS)) for n in range(INPUTS)),
        analog=tuple(AnalogConfig(**reader.values(f"AIN{n}", ANALOG_KEYS)) for n in range(ANALOG_INPUTS)),
        ports=(
            PortConfig(**reader.values("AIN0", (BAUD_KEY, ADDRESS_KEY))),
            # The slave address is that of COM1; that of COM2 is not even checked.
            PortConfig(**reader.values("AIN1", (BAUD_KEY,))),
        ),
        program=ProgramConfig(**reader.values("WBC_PROGRAM", program_keys(firmware(firmware_name)))),
        **reader.values("TRIGGER", TRIGGER_KEYS),
    )
    reader.ignore("AIN1", ADDRESS_KEY)
    if not reader.has_known_section() and not any(finding.severity is Severity.ERROR for finding in file.findings):
        return config, [_no_configuration(file), *(finding for finding in reader.unknown() if finding.fix is not None)]
    findings = [*file.findings, *reader.findings, *_switch_conflicts(file, config), *reader.unknown()]
    return config, in_order(findings)


def read_config(file: IniFile, firmware_name: str = DEFAULT_FIRMWARE) -> ControllerConfig:
    """The configuration a file describes for a firmware. Raises `ConfigError` with all errors at once; warnings pass."""
    config, findings = examine_config(file, firmware_name)
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if errors:
        raise ConfigError(file.source, errors)
    return config


_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d{1,3})?\Z", re.ASCII)


class _ConfigReader:
    """Reads typed values from a file and collects their errors."""

    def __init__(self, file: IniFile) -> None:
        self._file = file
        self._known: dict[str, set[str]] = {}
        self.findings: list[Diagnostic] = []

    def values(self, section: str, keys: Iterable[ConfigKey]) -> dict[str, Any]:
        """Attribute -> value of the keys that are there and right."""
        found: dict[str, Any] = {}
        for key in keys:
            self._known.setdefault(section, set()).add(key.name)
            entry = self._file.find(section, key.name)
            value = None if entry is None else self._value(entry, key)
            if value is not None:
                found[key.attribute] = value
        return found

    def ignore(self, section: str, key: ConfigKey) -> None:
        """A key that is known and not read."""
        self._known[section].add(key.name)

    def _value(self, entry: IniEntry, key: ConfigKey) -> float | None:
        if not _NUMBER.match(entry.value):
            joined = "".join(entry.value.split())
            is_number = _NUMBER.match(joined) is not None and key.permits(float(joined.replace(",", ".")))
            why = "is not a number" if entry.value else "has no value"
            return self._refuse("C006", entry, key, why, joined if is_number else None)
        value = float(entry.value.replace(",", "."))
        if not isfinite(value):
            return self._refuse("C008", entry, key, "is not permitted", key.nearest(value))
        if key.whole and not value.is_integer():
            return self._refuse("C007", entry, key, "is not a whole number", key.nearest(round(value)))
        if not key.permits(value):
            return self._refuse("C008", entry, key, "is not permitted", key.nearest(value))
        return int(value) if key.whole else value

    def _refuse(self, code: str, entry: IniEntry, key: ConfigKey, why: str, meant: str | None) -> None:
        """``meant``: the value that takes its place."""
        message = f"[{entry.section}] {entry.key} = {entry.value} {why}"
        fix = None if meant is None else Fix(entry.value_span, meant)
        self.findings.append(Diagnostic(code, Severity.ERROR, entry.value_span, message, key.hint, fix))

    def has_known_section(self) -> bool:
        known = {section.lower() for section in self._known}
        return any(header.section.lower() in known for header in self._file.headers)

    def unknown(self) -> Iterator[Diagnostic]:
        """Unknown sections and keys; with a fix where one looks like one that is missing."""
        file, known = self._file, self._known
        by_lower = {section.lower(): section for section in known}
        present = {header.section.lower() for header in file.headers}
        missing = [section for section in known if section.lower() not in present]
        meant: set[str] = set()
        for header in file.headers:
            if header.section.lower() not in by_lower:
                near = NearMiss().of(header.section, missing)
                yield _unknown(header.span, f"the section [{header.section}]", None if near is None else f"[{near}]")
                meant |= set() if near is None else {header.section.lower()}
        for entry in file.entries:
            section = by_lower.get(entry.section.lower())
            names = known[section] if section is not None else set()
            if entry.section.lower() not in meant and entry.key.lower() not in {name.lower() for name in names}:
                near = NearMiss().of(entry.key, sorted(name for name in names if file.find(entry.section, name) is None))
                yield _unknown(entry.key_span, f"[{section or entry.section}] {entry.key}", near)


def _no_configuration(file: IniFile) -> Diagnostic:
    """For another kind of file: one error instead of a warning for each of its lines."""
    text = file.source.text
    first = len(text) - len(text.lstrip())
    line = text[first:].split("\n", 1)[0].rstrip()
    hint = f"expected: sections such as [Axis0]…[Axis{AXES - 1}], [IN0]…[IN{INPUTS - 1}], [AIN0], [AIN1], [WBC_PROGRAM]"
    return Diagnostic("C011", Severity.ERROR, Span(first, first + len(line)), "this is not a configuration of a MIC488", hint)


def _unknown(span: Span, what: str, near: str | None) -> Diagnostic:
    if near is None:
        return Diagnostic("C005", Severity.WARNING, span, f"{what} is not known and has no effect")
    fix = Fix(span, near, is_named=True)
    return Diagnostic("C005", Severity.WARNING, span, f"{what} is not known; did you mean {near}?", fix=fix)


def input_name(number: int) -> str:
    """The name of the input with a number of ``InKL``/``InKR``; empty for a number that is not permitted."""
    if 0 <= number < _FIRST_CHANNEL:
        return f"IN{number + 1}"
    channel = encoder_channel(number)
    if channel is not None:
        return f"channel {channel[1]} of encoder {channel[0] + 1}"
    return "none" if number == NO_INPUT else ""


def encoder_channel(number: int) -> tuple[int, str] | None:
    """Encoder (from 0) and channel letter behind an input number of ``InKL``/``InKR``; None for IN1–IN8 and none."""
    if not _FIRST_CHANNEL <= number < NO_INPUT:
        return None
    encoder, channel = divmod(number - _FIRST_CHANNEL, len(_CHANNELS))
    return encoder, _CHANNELS[channel]


def _switch_conflicts(file: IniFile, config: ControllerConfig) -> Iterator[Diagnostic]:
    """Encoder channels taken as switches while an encoder is used as such."""
    for n, axis in enumerate(config.axes):
        for name, number in (("InKL", axis.in_kl), ("InKR", axis.in_kr)):
            entry = file.find(f"Axis{n}", name)
            taken = encoder_channel(number)
            if entry is None or taken is None:
                continue
            encoder, channel = taken
            what = f"[{entry.section}] {entry.key} = {entry.value} is channel {channel} of encoder {encoder + 1}"
            if axis.uses_encoder:
                message = f"{what}, but the axis uses its encoder (PosCtrlMode {axis.pos_ctrl_mode}, HomeMode {axis.home_mode})"
                hint = f"permitted: 0…7 (IN1…IN8), {NO_INPUT} (none)"
                yield Diagnostic("C009", Severity.ERROR, entry.value_span, message, hint)
            elif config.axes[encoder].uses_encoder:
                message = f"{what}, which axis M{encoder + 1} uses"
                yield Diagnostic("C010", Severity.WARNING, entry.value_span, message)
