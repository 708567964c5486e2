"""The ``.cfg`` as a form: every key with its meaning, unit, range and register (reference 6, manuals 4.1 to 4.9)."""

from __future__ import annotations

import pytest

from steptwin.configuration import ConfigurationKey, Section
from steptwin.datasheet import Limits
from steptwin.errors import Misuse
from steptwin.mic488.config import (
    AnalogConfig,
    AxisConfig,
    ControllerConfig,
    InputConfig,
    PortConfig,
    ProgramConfig,
    encoder_channel,
    input_name,
    keys_of,
    read_config,
)
from steptwin.mic488.configform import config_form, known_settings, with_values
from steptwin.mic488.configtext import config_text
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.registers import firmware

FILE = """[Axis1]
Unit=3
Gear=320,5
Acc = 100.25
Kp=no
[IN4]
Level=1
[AIN0]
LoVal=-5
Baud=9600
ID=7
[AIN1]
HiVal=20
Baud=57600
[WBC_PROGRAM]
Activate=1
PosBankToRun=2
[TRIGGER]
Keep=1
"""
AXIS_KEYS = (
    "Unit", "Gear", "Acc", "Dec", "Vel", "MotResol", "EncResol", "EncOffset", "HomeMode", "LimitMode", "InKL", "InKR",
    "PosCtrlMode", "ErrCtrlMode", "Kp", "EncTolerance", "EncSettle", "ErrTime", "EnWired",
)  # fmt: skip


def section(name: str, text: str = FILE, firmware: str = "1.70") -> Section:
    return next(section for section in config_form(text, "m.cfg", firmware).sections if section.name == name)


def setting(place: str, text: str = FILE, firmware: str = "1.70") -> ConfigurationKey:
    name, key = place.split(".")
    return next(setting for setting in section(name, text, firmware).settings if setting.name == key)


def test_sections_and_their_titles() -> None:
    """Those of the vendor's tool, in its order; COM1 and COM2 are in the sections of the analog inputs."""
    assert [(found.name, found.title) for found in config_form("", "m.cfg").sections] == [
        *((f"Axis{n}", f"M{n + 1}") for n in range(4)),
        *((f"IN{n}", f"IN{n + 1}") for n in range(20)),
        ("AIN0", "AIN1 · COM1"),
        ("AIN1", "AIN2 · COM2"),
        ("WBC_PROGRAM", "Program"),
        ("TRIGGER", "Trigger"),
    ]


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("Axis3", AXIS_KEYS),
        ("IN19", ("Filter", "Level", "Int")),
        ("AIN0", ("LoVal", "HiVal", "Baud", "ID")),
        ("AIN1", ("LoVal", "HiVal", "Baud")),  # the address of COM2 is not read
        ("WBC_PROGRAM", ("Activate", "ProgBankToRun", "PosBankToRun")),
        ("TRIGGER", ("Keep",)),
    ],
)
def test_keys_of_a_section(name: str, keys: tuple[str, ...]) -> None:
    assert tuple(found.name for found in section(name).settings) == keys


def test_values_of_the_file_beside_their_defaults() -> None:
    """MIC-27 has the defaults. What is wrong or not in the file is at its default; text is as it is written."""
    shown = {
        place: (setting(place).text, setting(place).value, setting(place).default)
        for place in (
            "Axis1.Unit", "Axis1.Gear", "Axis1.Acc", "Axis1.Dec", "Axis1.Kp", "Axis0.Gear", "IN4.Level", "IN3.Level",
            "AIN0.LoVal", "AIN0.Baud", "AIN0.ID", "AIN1.LoVal", "AIN1.HiVal", "AIN1.Baud", "WBC_PROGRAM.Activate",
            "WBC_PROGRAM.ProgBankToRun", "WBC_PROGRAM.PosBankToRun", "TRIGGER.Keep",
        )
    }  # fmt: skip
    assert shown == {
        "Axis1.Unit": ("3", 3, 0),
        "Axis1.Gear": ("320,5", 320.5, 1.0),
        "Axis1.Acc": ("100.25", 100.25, 1000.0),
        "Axis1.Dec": ("", 1000.0, 1000.0),
        "Axis1.Kp": ("no", 50.0, 50.0),
        "Axis0.Gear": ("", 1.0, 1.0),
        "IN4.Level": ("1", 1, 0),
        "IN3.Level": ("", 0, 0),
        "AIN0.LoVal": ("-5", -5.0, 0.0),
        "AIN0.Baud": ("9600", 9600, 38400),
        "AIN0.ID": ("7", 7, 1),
        "AIN1.LoVal": ("", 0.0, 0.0),
        "AIN1.HiVal": ("20", 20.0, 10.0),
        "AIN1.Baud": ("57600", 57600, 38400),
        "WBC_PROGRAM.Activate": ("1", 1, 0),
        "WBC_PROGRAM.ProgBankToRun": ("", 0, 0),
        "WBC_PROGRAM.PosBankToRun": ("2", 2, 0),
        "TRIGGER.Keep": ("1", 1, 0),
    }


def test_diagnostics_are_those_of_the_file() -> None:
    form = config_form(FILE, "m.cfg")
    assert (form.source.name, form.source.text) == ("m.cfg", FILE)
    assert [(found.code, form.source.text[found.span.start : found.span.end]) for found in form.diagnostics] == [("C006", "no")]


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("Gear", "imp/mm"), ("Acc", "mm/s²"), ("Dec", "mm/s²"), ("Vel", "mm/s"), ("MotResol", "imp/rev"),
        ("EncResol", "counts/rev"),
        ("EncOffset", "counts"), ("EncTolerance", "counts"), ("EncSettle", "ms"), ("ErrTime", "ms"), ("Unit", ""), ("Kp", ""),
    ],
)  # fmt: skip
def test_units_follow_the_unit_of_the_axis(key: str, unit: str) -> None:
    assert setting(f"Axis1.{key}").unit == unit


def test_an_axis_in_pulses_and_what_has_no_unit_of_an_axis() -> None:
    assert [setting(f"Axis0.{key}").unit for key in ("Gear", "Acc", "Vel")] == ["imp/imp", "imp/s²", "imp/s"]
    assert [setting(place).unit for place in ("AIN0.Baud", "AIN0.LoVal", "IN0.Filter")] == ["bit/s", "", ""]


@pytest.mark.parametrize(
    ("place", "limits", "is_whole"),
    [
        ("Axis0.Gear", Limits(0, None, is_low_excluded=True), False),
        ("Axis0.Acc", Limits(0, None, is_low_excluded=True), False),
        ("Axis0.Kp", Limits(0, None), False),
        ("AIN0.LoVal", Limits(None, None), False),
        ("Axis0.MotResol", Limits(1, 2**31 - 1), True),
        ("Axis0.EncOffset", Limits(-(2**31), 2**31 - 1), True),
        ("Axis0.ErrTime", Limits(1, 3_600_000), True),
        ("AIN0.ID", Limits(1, 247), True),
        ("WBC_PROGRAM.ProgBankToRun", Limits(0, 5), True),
        ("TRIGGER.Keep", Limits(0, 1), True),
    ],
)
def test_permitted_values(place: str, limits: Limits, is_whole: bool) -> None:
    """Open where nothing but the format of a REAL ends the range."""
    found = setting(place)
    assert (found.limits, found.is_whole) == (limits, is_whole)


def test_mic_28_banks_are_those_of_the_firmware() -> None:
    assert [setting("WBC_PROGRAM.ProgBankToRun", firmware=name).limits.high for name in ("1.23", "1.40", "1.70")] == [7, 7, 5]
    assert [keys_of("WBC_PROGRAM", name)[2].permitted.high for name in ("1.23", "1.70")] == [7, 5]


def test_choices_have_their_texts() -> None:
    assert setting("Axis0.HomeMode").choices == {n: f"HOME{n}" for n in range(5)}
    assert setting("Axis0.LimitMode").choices == {0: "OFF", 1: "KL", 2: "KR", 3: "KL+KR"}
    assert setting("IN0.Filter").choices == {0: "10 ms", 1: "50 ms", 2: "100 ms", 3: "250 ms", 4: "500 ms"}
    assert setting("AIN1.Baud").choices == {rate: str(rate) for rate in (9600, 19200, 38400, 57600, 115200)}
    assert setting("Axis0.Gear").choices == setting("Axis0.EncOffset").choices == {}


def test_inputs_of_the_limit_switches() -> None:
    """0–7 are IN1–IN8, 8–19 channels C, B, A of the encoders, 20 none."""
    names = [f"IN{n}" for n in range(1, 9)]
    names += [f"channel {channel} of encoder {encoder}" for encoder in range(1, 5) for channel in "CBA"]
    assert setting("Axis2.InKL").choices == setting("Axis2.InKR").choices == dict(enumerate([*names, "none"]))
    assert [input_name(number) for number in (-1, 21)] == ["", ""]
    assert [encoder_channel(number) for number in (7, 8, 19, 20)] == [None, (0, "C"), (3, "A"), None]


def test_registers_that_have_the_values_at_run_time() -> None:
    """Manual 4.3: ACC, DEC and VMAX of the axis; nothing else of a file is in a register."""
    form = config_form("", "m.cfg")
    points = {f"{one.name}.{key.name}": key.point for one in form.sections for key in one.settings if key.point}
    registers = {"Acc": "ACC", "Dec": "DEC", "Vel": "VMAX"}
    assert points == {f"Axis{n}.{key}": f"M{n + 1}_{register}" for n in range(4) for key, register in registers.items()}


def test_what_a_running_controller_would_be_given() -> None:
    """Its axes have other pulses per unit than the file: the same pulses/s² in its units. Keys that are not in the file give
    nothing, and neither does a file whose units cannot be converted."""
    text = "[Axis0]\nGear=100\nAcc=20\nDec=30\nVel=5\n[Axis1]\nAcc=7\n[Axis2]\nGear=10\n"
    assert config_form(text, "m.cfg", gears=(50.0, None, 1.0)).points == {
        "M1_ACC": 40.0, "M1_DEC": 60.0, "M1_VMAX": 10.0, "M2_ACC": 7.0,
    }  # fmt: skip
    assert config_form(text, "m.cfg", gears=(None, None, None)).points == {"M2_ACC": 7.0}
    assert config_form(text, "m.cfg").points == {}


def test_what_a_running_controller_shows_as_settings() -> None:
    """Nothing else is in the text, and nothing is wrong with it. With DINT and unknown pulses per unit, registers are in pulses,
    which no setting has."""
    values = {
        "M1_ACC": (0.10000000149011612, "mm/s²"),
        "M2_ACC": (500.0, "imp/s²"),
        "M3_VMAX": (8.0, "u/s"),
        "M3_DEC": (None, ""),
    }
    known = known_settings(values, [("mm", 640.0), ("u", None), ("u", None), ("u", None)])
    assert known == {"Axis0.Unit": "3", "Axis0.Gear": "640", "Axis0.Acc": "0.1", "Axis2.Vel": "8"}
    form = config_form(with_values("", "m.cfg", known), "m.cfg", gears=(640.0, None, None, None))
    assert (form.points, list(form.diagnostics)) == ({"M1_ACC": 0.1, "M3_VMAX": 8.0}, [])
    assert [found.text for found in form.sections[1].settings if found.text] == []
    assert {found.unit for found in form.sections[1].settings if found.name in ("Gear", "Acc")} == {"imp/u", "u/s²"}
    assert list(config_form("", "m.cfg").diagnostics) == []


def test_sources_are_sections_of_the_manuals() -> None:
    """4.3 parameters of motion, 4.4 homing, 4.9 GEAR; the user manual 1.74 has the rest."""
    sources = {place: setting(place).source for place in ("Axis0.Gear", "Axis0.Acc", "Axis0.HomeMode", "Axis0.Kp", "IN0.Filter")}
    assert sources == {
        "Axis0.Gear": "4.9", "Axis0.Acc": "4.3", "Axis0.HomeMode": "4.4", "Axis0.Kp": "1.74", "IN0.Filter": "1.74",
    }  # fmt: skip


# ---------------------------------------------------------------------- changes


def test_a_changed_value_leaves_the_rest_of_the_text() -> None:
    changed = with_values(FILE, "m.cfg", {"Axis1.Acc": "70,5", "AIN0.ID": "12", "IN4.Filter": "2"})
    assert changed == (
        FILE.replace("Acc = 100.25", "Acc = 70,5").replace("ID=7", "ID=12").replace("Level=1\n", "Level=1\nFilter=2\n")
    )
    assert with_values(FILE, "m.cfg", {}) == FILE


def test_a_setting_that_is_not_there() -> None:
    with pytest.raises(Misuse, match=r"no setting 'Axis0\.Gaer' \(did you mean 'Axis0\.Gear'\?\): settings are SECTION\.KEY"):
        with_values(FILE, "m.cfg", {"Axis0.Gaer": "1"})


def test_a_value_that_a_file_cannot_hold() -> None:
    with pytest.raises(Misuse, match=r"\[Axis0\] Gear = '1\\n2' cannot be written to m\.cfg"):
        with_values(FILE, "m.cfg", {"Axis0.Gear": "1\n2"})


# ---------------------------------------------------------------------- the text of a configuration


def test_a_configuration_written_as_text_reads_back() -> None:
    """Each value differs from its default, and from its neighbours, so that none can be lost or exchanged."""
    axes = tuple(
        AxisConfig(
            unit=n, gear=1.5 + n, acc=10.0 + n, dec=20.0 + n, vel=30.0 + n, mot_resol=200 + n, enc_resol=500 + n,
            enc_offset=-7 - n, home_mode=n % 3, limit_mode=n % 3 + 1, in_kl=n, in_kr=n + 3, pos_ctrl_mode=n % 2 + 1,
            err_ctrl_mode=n % 3 + 1, kp=60.5 + n, enc_tolerance=5 + n, enc_settle_ms=200 + n, err_time_ms=3000 + n, en_wired=0,
        )
        for n in range(1, 5)
    )  # fmt: skip
    config = ControllerConfig(
        axes=axes,
        inputs=tuple(InputConfig(filter=n % 4 + 1, level=1, interrupt=n % 3 + 1) for n in range(20)),
        analog=(AnalogConfig(-1.5, 20.0), AnalogConfig(-2.5, 30.0)),
        ports=(PortConfig(9600, 17), PortConfig(115200, 1)),
        program=ProgramConfig(1, 2, 3),
        trigger_keeps=1,
    )
    text = config_text(config, firmware("1.70"))
    assert read_config(IniFile.of_text(text)) == config
    headers = [line for line in text.splitlines() if line.startswith("[")]
    assert headers == [f"[{found.name}]" for found in config_form("", "m.cfg").sections]
    assert text.count("ID=") == 1  # that of COM2 is not read
