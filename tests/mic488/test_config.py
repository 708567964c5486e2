"""The vendor's configuration file: nothing is lost, everything is checked."""

from __future__ import annotations

import pytest
from vendor_config import VENDOR

from steptwin.diagnostics import Severity, diagnostics_to_json
from steptwin.errors import Misuse
from steptwin.mic488.config import (
    AxisConfig,
    ConfigError,
    ControllerConfig,
    InputConfig,
    ProgramConfig,
    encoder_channel,
    examine_config,
    read_config,
)
from steptwin.mic488.inifile import IniFile


def parse(text: str) -> IniFile:
    return IniFile.parse(text.encode(), "m.cfg")


def findings(text: str, firmware: str = "1.70") -> list[tuple[str, str]]:
    return [(found.code, found.message) for found in examine_config(parse(text), firmware)[1]]


# ---------------------------------------------------------------------- the typed view


def test_the_vendor_s_file() -> None:
    config = read_config(IniFile.parse(VENDOR))
    assert config.axes[0] == AxisConfig(
        unit=3,
        gear=320.5,
        acc=100.25,
        dec=200.0,
        vel=50.0,
        mot_resol=6400,
        enc_resol=2000,
        enc_offset=-17,
        home_mode=1,
        limit_mode=3,
        in_kl=0,
        in_kr=7,
        pos_ctrl_mode=1,
        err_ctrl_mode=2,
        kp=12.5,
    )
    assert config.axes[0].unit_name == "mm"
    assert config.axes[1] == AxisConfig(gear=12800.0)
    assert config.inputs[0] == InputConfig(filter=4, level=1, interrupt=3)
    assert (config.analog[0].lo_val, config.analog[0].hi_val) == (-10.0, 10.0)
    assert [port.baud for port in config.ports] == [115200, 9600]
    assert config.program == ProgramConfig(activate=1, prog_bank=5, pos_bank=2)


def test_the_slave_address_is_that_of_com1_and_com2_s_is_ignored() -> None:
    assert read_config(IniFile.parse(VENDOR)).address == 17
    assert read_config(parse("[AIN1]\nID=5")).address == 1


def test_mic_27_without_a_file_the_controller_is_as_delivered() -> None:
    config = read_config(parse("[Axis0]"))
    assert config == ControllerConfig()
    assert config == ControllerConfig()
    assert len(config.axes) == 4
    assert len(config.inputs) == 20
    axis = config.axes[3]
    assert (axis.unit_name, axis.gear, axis.acc, axis.dec, axis.vel) == ("imp", 1.0, 1000.0, 1000.0, 1000.0)
    assert (axis.mot_resol, axis.enc_resol, axis.kp) == (3200, 400, 50.0)
    assert (axis.in_kl, axis.in_kr, axis.limit_mode, axis.home_mode, axis.pos_ctrl_mode) == (20, 20, 0, 0, 0)
    assert (config.address, config.ports[0].baud, config.program.activate) == (1, 38400, 0)


@pytest.mark.parametrize("written", ["0,5", "0.5", ".5", ",5", "+0,50", "5e-1", "5E-01"])
def test_decimal_point_and_comma(written: str) -> None:
    assert read_config(parse(f"[Axis0]\nGear={written}")).axes[0].gear == 0.5


def test_mic_19_encoder_tolerance_and_times_have_keys_of_our_own() -> None:
    axis = read_config(parse("[Axis1]\nEncTolerance=0\nEncSettle=250\nErrTime=500")).axes[1]
    assert (axis.enc_tolerance, axis.enc_settle_ms, axis.err_time_ms) == (0, 250, 500)
    _, findings = examine_config(parse("[Axis0]\nEncTolerance=-1\nEncSettle=0\nErrTime=0.5"))
    assert [finding.code for finding in findings] == ["C008", "C008", "C007"]


def test_mic_8_and_mic_16_have_keys_of_our_own() -> None:
    config = read_config(parse("[Axis2]\nEnWired=0\n[TRIGGER]\nKeep=1"))
    assert [axis.en_wired for axis in config.axes] == [1, 1, 0, 1]
    assert config.trigger_keeps == 1
    assert read_config(parse("[TRIGGER]\nKeep=0")).trigger_keeps == 0
    _, findings = examine_config(parse("[Axis0]\nEnWired=2\n[TRIGGER]\nKeep=yes"))
    assert [finding.code for finding in findings] == ["C008", "C006"]


def test_input_numbers_of_encoder_channels() -> None:
    shown = [encoder_channel(number) for number in (0, 7, 8, 9, 10, 11, 19, 20)]
    assert shown == [None, None, (0, "C"), (0, "B"), (0, "A"), (1, "C"), (3, "A"), None]


# ---------------------------------------------------------------------- what is wrong with a file


@pytest.mark.parametrize(
    ("text", "code", "message", "hint"),
    [
        ("[Axis0]\nGear=0", "C008", "[Axis0] Gear = 0 is not permitted", "permitted: a number > 0 in pulses per unit"),
        ("[Axis1]\nAcc=-1", "C008", "[Axis1] Acc = -1 is not permitted", "permitted: a number > 0 in units/s²"),
        ("[Axis1]\nDec=0,0", "C008", "[Axis1] Dec = 0,0 is not permitted", "permitted: a number > 0 in units/s²"),
        ("[Axis1]\nVel=1e39", "C008", "[Axis1] Vel = 1e39 is not permitted", "permitted: a number > 0 in units/s"),
        ("[Axis1]\nVel=fast", "C006", "[Axis1] Vel = fast is not a number", "permitted: a number > 0 in units/s"),
        ("[Axis1]\nVel=nan", "C006", "[Axis1] Vel = nan is not a number", "permitted: a number > 0 in units/s"),
        ("[Axis1]\nVel=1 000", "C006", "[Axis1] Vel = 1 000 is not a number", "permitted: a number > 0 in units/s"),
        ("[Axis1]\nVel=", "C006", "[Axis1] Vel =  has no value", "permitted: a number > 0 in units/s"),
        (
            "[Axis2]\nUnit=6",
            "C008",
            "[Axis2] Unit = 6 is not permitted",
            "permitted: 0 = imp, 1 = rev, 2 = degree, 3 = mm, 4 = cm, 5 = m",
        ),
        (
            "[Axis2]\nHomeMode=1,5",
            "C007",
            "[Axis2] HomeMode = 1,5 is not a whole number",
            "permitted: 0 = HOME0, 1 = HOME1, 2 = HOME2, 3 = HOME3, 4 = HOME4",
        ),
        (
            "[Axis3]\nInKL=21",
            "C008",
            "[Axis3] InKL = 21 is not permitted",
            "permitted: 0…7 (IN1…IN8), 8…19 (channels C, B, A of encoders 1…4), 20 (none)",
        ),
        (
            "[Axis3]\nEncOffset=2147483648",
            "C008",
            "[Axis3] EncOffset = 2147483648 is not permitted",
            "permitted: a whole number -2147483648…2147483647",
        ),
        (
            "[IN19]\nFilter=5",
            "C008",
            "[IN19] Filter = 5 is not permitted",
            "permitted: 0 = 10 ms, 1 = 50 ms, 2 = 100 ms, 3 = 250 ms, 4 = 500 ms",
        ),
        (
            "[AIN0]\nBaud=4800",
            "C008",
            "[AIN0] Baud = 4800 is not permitted",
            "permitted: 9600, 19200, 38400, 57600, 115200",
        ),
        ("[AIN0]\nID=0", "C008", "[AIN0] ID = 0 is not permitted", "permitted: a whole number 1…247"),
        (
            "[Axis0]\nInKR=11\nPosCtrlMode=2",
            "C009",
            "[Axis0] InKR = 11 is channel C of encoder 2, but the axis uses its encoder (PosCtrlMode 2, HomeMode 0)",
            "permitted: 0…7 (IN1…IN8), 20 (none)",
        ),
        (
            "[Axis0]\nHomeMode=4\nInKL=8",
            "C009",
            "[Axis0] InKL = 8 is channel C of encoder 1, but the axis uses its encoder (PosCtrlMode 0, HomeMode 4)",
            "permitted: 0…7 (IN1…IN8), 20 (none)",
        ),
        ("[Axis0\nGear=2", "C002", "the section header [Axis0 is not closed", "permitted: [name]"),
    ],
)
def test_one_error(text: str, code: str, message: str, hint: str) -> None:
    config, found = examine_config(parse(text))
    assert [(f.code, f.message, f.hint, f.severity) for f in found] == [(code, message, hint, Severity.ERROR)]
    with pytest.raises(ConfigError, match=r"m\.cfg:"):
        read_config(parse(text))
    assert isinstance(config, ControllerConfig)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("[Axis0]\nGaer=100", "C005", "[Axis0] Gaer is not known; did you mean Gear?"),
        ("[Axsi0]\nGear=100\n[Axis1]", "C005", "the section [Axsi0] is not known; did you mean [Axis0]?"),
        ("[Axis0]\nMotCurrent=x", "C005", "[Axis0] MotCurrent is not known and has no effect"),
        # Gear is there, so Gears is somebody else's key.
        ("[Axis0]\nGear=2\nGears=3", "C005", "[Axis0] Gears is not known and has no effect"),
        ("[Axis0]\n[Vision]", "C005", "the section [Vision] is not known and has no effect"),
        ("[IN0]\n[IN20]\nLevel=1", "C005", "the section [IN20] is not known; did you mean [IN2]?"),
        ("[Axis0]\nsomething", "C001", "'something' has no effect"),
        ("Gear=1\n[Axis0]", "C001", "'Gear=1' is before the first [section] and has no effect"),
        ("[Axis0]\nGear=1\ngear=2", "C003", "[Axis0] gear is repeated; the first one counts"),
        ("[Axis0]\n[AXIS0]", "C003", "the section [AXIS0] is repeated"),
        ("[Axis0]\nInKL=11\n[Axis1]\nPosCtrlMode=1", "C010", "[Axis0] InKL = 11 is channel C of encoder 2, which axis M2 uses"),
    ],
)
def test_one_warning(text: str, code: str, message: str) -> None:
    found = examine_config(parse(text))[1]
    assert [(f.code, f.message, f.severity) for f in found] == [(code, message, Severity.WARNING)]
    read_config(parse(text))


@pytest.mark.parametrize(
    "text",
    [
        "[Axis0]\nInKL=8",  # an encoder nobody uses as such
        "; comment\n# comment\n// comment\n\n  \n[Axis0] ; comment",
        "[AIN1]\nID=many",
    ],
)
def test_nothing_to_say(text: str) -> None:
    assert findings(text) == []


@pytest.mark.parametrize(("firmware", "last"), [("1.23", 7), ("1.40", 7), ("1.70", 5)])
def test_mic_28_banks_to_run_follow_the_firmware(firmware: str, last: int) -> None:
    for key in ("ProgBankToRun", "PosBankToRun"):
        assert findings(f"[WBC_PROGRAM]\n{key}={last}", firmware) == []
        assert findings(f"[WBC_PROGRAM]\n{key}={last + 1}", firmware) == [
            ("C008", f"[WBC_PROGRAM] {key} = {last + 1} is not permitted")
        ]


def test_unknown_firmware_is_the_caller_s_mistake() -> None:
    with pytest.raises(Misuse, match=r"permitted: 1\.23, 1\.40, 1\.70"):
        read_config(parse(""), "3")


def test_all_errors_at_once_with_file_line_and_key() -> None:
    text = "[Axis0]\r\nGear=0\r\nAcc=x\r\n\r\n[IN3]\r\nLevel=2\r\n"
    with pytest.raises(ConfigError) as caught:
        read_config(parse(text))
    assert str(caught.value) == (
        "m.cfg:2:6: error C008: [Axis0] Gear = 0 is not permitted\n"
        "  2 | Gear=0\n"
        "    |      ^\n"
        "    = permitted: a number > 0 in pulses per unit\n"
        "m.cfg:3:5: error C006: [Axis0] Acc = x is not a number\n"
        "  3 | Acc=x\n"
        "    |     ^\n"
        "    = permitted: a number > 0 in units/s²\n"
        "m.cfg:6:7: error C008: [IN3] Level = 2 is not permitted\n"
        "  6 | Level=2\n"
        "    |       ^\n"
        "    = permitted: 0 = active high, 1 = active low"
    )
    rows = diagnostics_to_json(caught.value.source, caught.value.findings)
    assert [(row["line"], row["code"]) for row in rows] == [(2, "C008"), (3, "C006"), (6, "C008")]


def test_a_wrong_value_leaves_its_default() -> None:
    config, _ = examine_config(parse("[Axis0]\nGear=0\nAcc=7"))
    assert (config.axes[0].gear, config.axes[0].acc) == (1.0, 7.0)


def test_a_misspelt_key_comes_with_the_repair() -> None:
    file = parse("[Axis0]\nGaer=100")
    (found,) = examine_config(file)[1]
    assert found.fix is not None
    span = found.fix.span
    repaired = file.source.text[: span.start] + found.fix.text + file.source.text[span.end :]
    assert repaired == "[Axis0]\nGear=100"


@pytest.mark.parametrize(
    "text", ["", " \n; only a comment\n", "PREL M1 10\nWAIT M1\n", "[tool]\nname=x\n[other]\n", "a=1\nb=2\n"]
)
def test_a_file_without_any_known_section_is_one_error(text: str) -> None:
    assert findings(text) == [("C011", "this is not a configuration of a MIC488")]
    with pytest.raises(ConfigError, match=r"(?s)m\.cfg:.*error C011.*expected: sections such as \[Axis0\]…\[Axis3\]"):
        read_config(parse(text))


def test_a_misspelt_section_comes_with_the_repair_where_it_is_the_only_one() -> None:
    assert findings("[Axsi0]\nGear=100") == [
        ("C011", "this is not a configuration of a MIC488"),
        ("C005", "the section [Axsi0] is not known; did you mean [Axis0]?"),
    ]


def test_every_unknown_name_is_told_with_its_line() -> None:
    file = IniFile.parse(VENDOR, "m.cfg")
    found = examine_config(file)[1]
    told = [(row["line"], row["code"], row["message"]) for row in diagnostics_to_json(file.source, found)]
    assert told == [
        (18, "C005", "[Axis0] MotCurrent is not known and has no effect"),
        (39, "C005", "the section [Vision] is not known and has no effect"),
        (40, "C005", "[Vision] Camera is not known and has no effect"),
        (41, "C001", "'last line without end' has no effect"),
    ]


@pytest.mark.parametrize(("mark", "encoding"), [(b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")])
def test_utf_16_is_read_and_written_back(mark: bytes, encoding: str) -> None:
    data = mark + "[Axis0]\r\nGear=1\r\n".encode(encoding)
    file = IniFile.parse(data)
    assert (file.findings, file.get("Axis0", "Gear")) == ((), "1")
    assert file.to_bytes() == data
    assert file.with_value("Axis0", "Gear", "25").to_bytes() == data.replace("1".encode(encoding), "25".encode(encoding))


def test_a_key_without_a_value_gets_one_where_it_belongs() -> None:
    for line in ("Gear=", "Gear =  ", "Gear= ; none yet"):
        file = parse(f"[Axis0]\n{line}\nAcc=1\n")
        entry = file.find("axis0", "gear")
        assert entry is not None
        assert (entry.value, file.source.text[entry.value_span.start - 1]) == ("", "=")
        assert file.with_value("Axis0", "Gear", "25").source.text == f"[Axis0]\n{line.replace('=', '=25', 1)}\nAcc=1\n"


@pytest.mark.parametrize(
    "data", [bytes(range(256)), b"[Axis0]\r\nGear=\0\r\n", b"\xff\xfe[\0\0\xd8"], ids=["all bytes", "NUL", "half a pair"]
)
def test_a_binary_file_is_named_once(data: bytes) -> None:
    file = IniFile.parse(data)
    assert [(f.code, f.severity, f.message, f.hint) for f in file.findings] == [
        ("C004", Severity.ERROR, "the file is not text", "save it as ANSI or UTF-8")
    ]
    (span,) = (f.span for f in file.findings)
    assert file.source.text[span.start : span.end] == "\0"
    assert file.to_bytes() == data


# ---------------------------------------------------------------------- what every key permits


KEYS = [
    # section, key, permitted ends, values just outside
    ("Axis0", "Unit", ("0", "5"), ("-1", "6")),
    ("Axis1", "Gear", ("1e-37", "3.4e38"), ("0", "-1e-37", "1e39")),
    ("Axis2", "Acc", ("1e-37", "3.4e38"), ("0", "1e39")),
    ("Axis3", "Dec", ("1e-37", "3.4e38"), ("0", "1e39")),
    ("Axis0", "Vel", ("1e-37", "3.4e38"), ("0", "1e39")),
    ("Axis1", "MotResol", ("1", "2147483647"), ("0", "2147483648")),
    ("Axis2", "EncResol", ("1", "2147483647"), ("0", "2147483648")),
    ("Axis3", "EncOffset", ("-2147483648", "2147483647"), ("-2147483649", "2147483648")),
    ("Axis0", "HomeMode", ("0", "4"), ("-1", "5")),
    ("Axis1", "LimitMode", ("0", "3"), ("-1", "4")),
    ("Axis2", "InKL", ("0", "20"), ("-1", "21")),
    ("Axis3", "InKR", ("0", "20"), ("-1", "21")),
    ("Axis0", "PosCtrlMode", ("0", "2"), ("-1", "3")),
    ("Axis1", "ErrCtrlMode", ("0", "3"), ("-1", "4")),
    ("Axis2", "Kp", ("0", "3.4e38"), ("-0.001", "1e39")),
    ("Axis3", "EncTolerance", ("0", "2147483647"), ("-1", "2147483648")),
    ("Axis0", "EncSettle", ("1", "3600000"), ("0", "3600001")),
    ("Axis1", "ErrTime", ("1", "3600000"), ("0", "3600001")),
    ("Axis2", "EnWired", ("0", "1"), ("-1", "2")),
    ("IN0", "Filter", ("0", "4"), ("-1", "5")),
    ("IN7", "Level", ("0", "1"), ("-1", "2")),
    ("IN19", "Int", ("0", "3"), ("-1", "4")),
    ("AIN0", "LoVal", ("-3.4e38", "3.4e38"), ("-1e39", "1e39")),
    ("AIN1", "HiVal", ("-3.4e38", "3.4e38"), ("-1e39", "1e39")),
    ("AIN0", "Baud", ("9600", "115200"), ("9599", "9601", "115201", "0")),
    ("AIN1", "Baud", ("9600", "115200"), ("9599", "9601", "115201", "0")),
    ("AIN0", "ID", ("1", "247"), ("0", "248")),
    ("WBC_PROGRAM", "Activate", ("0", "1"), ("-1", "2")),
    ("WBC_PROGRAM", "ProgBankToRun", ("0", "5"), ("-1", "6")),
    ("WBC_PROGRAM", "PosBankToRun", ("0", "5"), ("-1", "6")),
    ("TRIGGER", "Keep", ("0", "1"), ("-1", "2")),
]


@pytest.mark.parametrize(("section", "key", "ends", "beyond"), KEYS, ids=[f"{section} {key}" for section, key, *_ in KEYS])
def test_every_key_takes_its_range_and_nothing_beyond(section: str, key: str, ends: tuple[str, str], beyond: tuple[str]) -> None:
    low, high = (examine_config(parse(f"[{section}]\n{key}={end}")) for end in ends)
    assert (low[1], high[1]) == ([], [])
    assert low[0] != high[0]
    for value in beyond:
        config, found = examine_config(parse(f"[{section}]\n{key}={value}"))
        assert [finding.code for finding in found] == ["C008"], value
        assert config == ControllerConfig(), value


def test_the_sections_of_every_axis_and_input() -> None:
    text = "".join(f"[Axis{n}]\nEncOffset={n + 1}\n" for n in range(4)) + "".join(f"[IN{n}]\nFilter={n % 5}\n" for n in range(20))
    config = read_config(parse(text))
    assert [axis.enc_offset for axis in config.axes] == [1, 2, 3, 4]
    assert [one.filter for one in config.inputs] == [n % 5 for n in range(20)]
    assert (len(config.analog), len(config.ports)) == (2, 2)
