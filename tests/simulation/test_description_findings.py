"""Descriptions of worlds: what they may say, and what is told where they are wrong."""

from __future__ import annotations

import pytest

from steptwin.diagnostics import Span
from steptwin.files.world import World
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.toml.reader import WorldError

TABLE = '[[mic488]]\nname = "table"\n'
AXIS = TABLE + '[[axis]]\nname = "x"\ndrive = "table.M1"\n'

CHIP = '[[m1486]]\nname = "chip"\n'
BUS = TABLE + 'line = "bus"\n[[line]]\nname = "bus"\n'


MOTOR = "[axis.motor]\ntorque = [[0, 1.0]]\n"


def wrong(text: str) -> str:
    with pytest.raises(WorldError) as caught:
        World.from_toml(text, name="w.toml")
    return str(caught.value)


def places(text: str) -> list[str]:
    return [line.split(": ")[0] for line in wrong(text).splitlines() if ": error " in line]


STEPS = """
[[script]]
name = "s"
steps = [
  { note = "a { in a text" }, # and [ here
  { press = "nothing" },
  { repeat = 2, steps = [{ wait = "1 s" }, { write = { "table.M1_EN" = 1 } }] },
  { write = { "table.M1_ENN" = 1 } },
  { until = "table.M1.stat == 4" }, { set = { "table.OUT1" = 1 } },
]

[[event]]
name = "e"
when = "table.IN99 == 1"
steps = [{ turn = "table.M5", counts = 1 }, { fault = { kind = "stall", axis = 9 } }]
"""


MANY = """
[[mic488]]
name = "table"
line = "bus"
firmware = "9"
unit = 300

[[mic488]]
name = "good"
line = "buss"

[[line]]
name = "bus"

[[axis]]
name = "x"
drive = "table.M1"
start = "left"
travel = [0, 5]
switch = [{ to = "good.IN1", below = "low" }]

[[axis]]
name = "y"
drive = "nobody.M1"

[[button]]
name = "go"
to = "good.IN99"

[[button]]
name = "stop"
to = "table.IN3"
bounce = "soon"

[[wire]]
from = "good.OUT1"
to = "table.IN1"

[[source]]
to = "good.AIN1"
kind = "sinus"
amplitude = 1

[[fault]]
kind = "crc"
nth = 0

[[fault]]
kind = "stall"
machine = "other"
axis = 9

[[fault]]
kind = "stall"
machine = "table"
axis = 1

[[event]]
when = 5
steps = [
  { wait = "soon" },
  { press = "go" },
  { press = "stop" },
  { write = { "table.M1_EN" = 1, "good.M1_ENN" = 1, "good.M2_ENN" = 1 } },
  { until = "x.position > 1" },
  { until = "good.M1.stat == 1" },
  { clear_fault = "whatever" },
]

[[mic488]]
name = "other"
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[world\n", "w.toml:1:7: error D001: this is not TOML"),
        ("[world]\nseed = 1\nname = = 2\n", "w.toml:3:8: error D001: this is not TOML"),
        (AXIS + "travel = [0, 1]\nstart = 5\n", "w.toml:7:1: error D007: start = 5 is outside travel = [0.0, 1.0]"),
        ("[worlds]\n", "w.toml:1:1: error D004: the file has no [worlds] (did you mean 'world'?)"),
        (TABLE + "[[axs]]\n", "w.toml:3:1: error D004: the file has no [axs]"),
        (TABLE + '[[fault]]\nkind = "crc"\nprobability = 2\n', "w.toml:5:1: error D003: [[fault]] (crc): probability = 2"),
        (TABLE + '[[fault]]\nkind = "stall"\naxis = 9\n', "w.toml:3:1: error D009: fault stall: axis = 9: permitted are 1 to 4"),
        (f"[world]\nseed = {'9' * 400}\n", "w.toml:2:8: error D001: a value of 400 characters that is not text"),
        (f"[world]\nseed = {'9' * 40}\n", "w.toml:2:1: error D001: a whole number of more than 64 bits"),
        (f"[world]\nseed = 0x{'f' * 60}\n", "w.toml:2:1: error D001: a whole number of more than 64 bits"),
        (AXIS + f"travel = [0, {'9' * 40}]\n", "error D001: a whole number of more than 64 bits"),
        ("[world]\nseed = 1e400\n", "w.toml:2:1: error D003: [world]: seed: inf: permitted are whole numbers"),
        (".".join("a" * 20_000) + " = 1\n", "w.toml:1:65: error D001: a key of more than 32 parts"),
        (TABLE + "[mic488.M1]\nin_kl = 'IN21'\n", "in_kl: 'IN21': permitted: IN1 to IN20 or 'none'"),
        (TABLE + "[mic488.M1]\nin_kl = 'IN33'\n", "in_kl: 'IN33': permitted: IN1 to IN20 or 'none'"),
        (TABLE + "[mic488.M1]\nin_kl = 3.5\n", "in_kl: 3.5: permitted: IN1 to IN20"),
        (TABLE + "[mic488.M1]\nenc_tolerance = 0.5\n", "enc_tolerance: 0.5: permitted: a whole number ≥ 0"),
        (TABLE + "[mic488.M1]\nenc_settle_ms = 0\n", "enc_settle_ms: 0: permitted: a whole number 1…3600000 in ms"),
        (TABLE + "[mic488.M1]\nkp = true\n", "kp: True: permitted: a number ≥ 0"),
        (TABLE + "[mic488.M1]\nkp = 'much'\n", "kp: 'much': permitted: a number ≥ 0"),
        (TABLE + "[mic488.M1]\nunit = 'mile'\n", "unit: 'mile': permitted: imp (0), rev (1), degree (2)"),
        (TABLE + "[mic488.M1]\nunit = 6\n", "unit: 6: permitted: imp (0), rev (1), degree (2)"),
        (TABLE + "[mic488.M1]\nin_kr = 'IN٣'\n", "in_kr: 'IN٣': permitted: IN1 to IN20 or 'none'"),
        (
            TABLE + "[mic488.M1]\nin_kr = 21\n",
            "in_kr: 21: permitted: IN1 to IN20 or 'none', or the number of the vendor",
        ),
        (TABLE + "[[event]]\nat = 1\ndo = [{ wait = 1 }]\n", "w.toml:5:1: error D004: [event] has no 'do'"),
        (TABLE + '[[axis]]\nname = "x"\ndrive = "table.Q1"\n', "table has M1, M2, M3, M4"),
        (TABLE + '[[axis]]\nname = "x"\ndrive = "table.M"\n', "table has M1, M2, M3, M4"),
        (TABLE + '[[axis]]\nname = "x"\ndrive = "table.M0"\n', "table has M1, M2, M3, M4"),
        (TABLE + '[[axis]]\nname = "x"\ndrive = "table.M5"\n', "table has M1, M2, M3, M4"),
        (AXIS + MOTOR + "mass = 1.0\n", "motor: mass and forces need a unit of "),
        (AXIS + MOTOR + "force = 1.0\n", "motor: mass and forces need a unit of "),
        (AXIS + MOTOR + "friction_force = 1.0\n", "motor: mass and forces need a unit of "),
        (BUS + '[[line]]\nname = "bus"\n', "w.toml:7:1: error D006: there is a [[line]] named 'bus' already"),
        (TABLE + "[[script]]\nname = 's'\n", "w.toml:3:1: error D005: [script]: steps is missing"),
        (
            '[world]\nname = """\n[[button]]\nname = 5\n"""\n' + TABLE + '[[button]]\nname = "b"\nto = "none.IN1"\n',
            "w.toml:10:1: error D009: nothing is called 'none'",
        ),
        ("world = 3\n", "w.toml:1:1: error D002: [world] is 3"),
        ("[mic488]\nname = 't'\n", "w.toml:1:1: error D002: [mic488] is a single table"),
        ("[[mic488]]\nname = 'ось'\n", "'ось' is not a name: expected a letter from A to Z, then letters, digits, '-' and '_'"),
        ("[[mic488]]\nname = 'tür'\n", "'tür' is not a name: expected a letter from A to Z"),
        (TABLE + "[[event]]\nat = 1\nsteps = [{ send = 'bus', text = '→' }]\n", "text: '→': '→' is not an 8-bit character"),
        ("[[mic488]]\nunit = 3\n", "w.toml:1:1: error D005: [mic488]: name is missing"),
        (TABLE + "unti = 3\n", "w.toml:3:1: error D004: [mic488] has no 'unti' (did you mean 'unit'?)"),
        (TABLE + "unit = 300\n", "w.toml:3:1: error D003: [mic488]: unit: 300: permitted are whole numbers from 1 to 247"),
        (TABLE + 'firmware = "1.8"\n', "firmware: '1.8': permitted are 1.23, 1.40, 1.70"),
        (TABLE + "firmware = 1.8\n", "firmware: '1.8': permitted are 1.23, 1.40, 1.70"),
        (TABLE + "firmware = true\n", "firmware: True: permitted are 1.23, 1.40, 1.70"),
        (BUS + 'tcp = "foo"\n', "w.toml:6:1: error D003: [line]: tcp: 'foo' is not an address: expected HOST:PORT"),
        (BUS + 'tcp = "127.0.0.1:99999"\n', "w.toml:6:1: error D003: [line]: tcp: '127.0.0.1:99999' is not an address"),
        (BUS + 'rtu_tcp = "here"\n', "w.toml:6:1: error D003: [line]: rtu_tcp: 'here' is not an address"),
        (
            CHIP + 'line = "bus"\n[[line]]\nname = "bus"\nkind = "m1486"\nrtu_tcp = "127.0.0.1:0"\n',
            "w.toml:7:1: error D007: rtu_tcp means nothing for kind = 'm1486'",
        ),
        (TABLE + TABLE, "w.toml:4:1: error D006: there is a [[mic488]] named 'table' already"),
        (TABLE + "[mic488.M1]\nacc = -1\n", "w.toml:4:1: error D003: [mic488.M1]: acc: -1: permitted: a number > 0 in units/s²"),
        (TABLE + '[mic488.M1]\nhome_mode = "HOME9"\n', "permitted: HOME0 (0), HOME1 (1), HOME2 (2), HOME3 (3), HOME4 (4)"),
        (
            TABLE + '[[wire]]\nfrom = "table"\nto = "table.IN1"\n',
            "w.toml:4:1: error D003: [wire]: from: 'table': expected CONTROLLER.PIN",
        ),
        (
            TABLE + '[[wire]]\nfrom = "tabel.OUT1"\nto = "table.IN1"\n',
            "w.toml:3:1: error D009: nothing is called 'tabel' (did you mean 'table'?)",
        ),
        (
            TABLE + '[[wire]]\nfrom = "table.OUT9"\nto = "table.IN1"\n',
            "table.OUT9 is not an output: outputs of 'table' are OUT1, ",
        ),
        (AXIS + "travel = [3, 1]\n", "w.toml:6:1: error D003: [axis]: travel: [3, 1]: the first must be below the second"),
        (AXIS + "travel = [1, 3]\n", "start = 0 is outside travel = [1.0, 3.0]"),
        (AXIS.replace("M1", "M5"), "drive = 'table.M5': table has M1, M2, M3, M4"),
        (AXIS + AXIS.removeprefix(TABLE).replace('"x"', '"y"'), "moves 'x' already"),
        (AXIS + '[[axis.switch]]\nto = "table.IN1"\n', "w.toml:6:1: error D007: a switch needs one of below, above and position"),
        (
            AXIS + '[[axis.switch]]\nto = "table.IN1"\nbelow = 0\n[[button]]\nname = "b"\nto = "table.IN1"\n',
            "table.IN1 is driven already, from line 7",
        ),
        (
            AXIS + '[[axis.switch]]\nto = "table.IN1"\nbelow = 0\n[[axis.switch]]\nto = "table.IN1"\nabove = 9\n',
            "w.toml:9:1: error D009: table.IN1 is driven already, from line 7",
        ),
        (AXIS + "[axis.motor]\ntorque = [[1, 1]]\n", "w.toml:7:1: error D003: a torque curve begins at 0 rev/min"),
        (
            AXIS + 'unit = "degree"\npitch = 1\n[axis.motor]\nmass = 1\ntorque = [[0, 1]]\n',
            "mass and forces need a unit of mm, cm, m",
        ),
        (TABLE + "[[event]]\nsteps = []\n", "an event needs one of at, every and when"),
        (TABLE + '[[event]]\nat = "5 sec"\nsteps = []\n', "w.toml:4:1: error D003: [event]: at: '5 sec' is not a time"),
        (TABLE + "[[event]]\nat = 1\nsteps = [{ wiat = 1 }]\n", "step 1 has 'wiat' (did you mean 'wait'?)"),
        (TABLE + "[[event]]\nat = 1\nsteps = [{ until = 'a >' }]\n", "condition 'a >' ends too early"),
        (TABLE + '[[line]]\nname = "bus"\n', "w.toml:3:1: error D009: nothing is on this line"),
        (TABLE + 'line = "bus"\n[[line]]\nname = "bus"\nbaud = 38401\n', "baud = 38401: a MIC488 has 9600, 19200, 38400,"),
        (TABLE + 'line = "bus"\n[[line]]\nname = "bus"\nkind = "m1486"\n', "'table' cannot be on a line of kind m1486"),
        (
            "x = " + "[" * 3000 + "]" * 3000,
            "w.toml:1:38: error D001: values are nested more than 32 deep",
        ),
        (TABLE + '[fault]\nkind = "crc"\n', "w.toml:3:1: error D002: [fault] is a single table"),
        ('fault = ["crc"]\n' + TABLE, "w.toml:1:10: error D002: [[fault]] is 'crc'"),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nkind = "ramp"\nover = 1\nrepeat = 0\n',
            "w.toml:7:1: error D003: [source]: repeat: 0",
        ),
        (TABLE + '[[source]]\nto = "table.AIN1"\nkind = "table"\n', "w.toml:3:1: error D009: a table needs points"),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nperiod = "0 s"\n',
            "w.toml:5:1: error D003: [source]: period: '0 s': must be more than",
        ),
        (TABLE + "[[event]]\nevery = 0\nsteps = []\n", "w.toml:4:1: error D003: [event]: every: 0: must be more than 0"),
        (TABLE + 'config = "no.cfg"\n', "w.toml:1:1: error D009: the content of the file 'no.cfg' is not given"),
        (TABLE + 'program = "no.prg"\n', "w.toml:1:1: error D009: the content of the file 'no.prg' is not given"),
        (TABLE + TABLE.replace("table", "Table"), "w.toml:4:1: error D006: 'Table' is taken by [[mic488]] 'table'"),
        (AXIS.replace('"x"', '"table"'), "w.toml:4:1: error D006: 'table' is taken by [[mic488]] 'table'"),
        (
            TABLE + '[[button]]\nname = "Idle"\nto = "table.IN1"\n',
            "w.toml:4:1: error D006: 'Idle' is a signal: choose another name",
        ),
        (TABLE.replace("table", "world"), "w.toml:2:1: error D006: 'world' is what events of the whole world are recorded under"),
        (
            TABLE + '[[wire]]\nfrom = "table.IN1"\nto = "table.IN2"\n',
            "w.toml:4:1: error D009: table.IN1 is not an output: outputs of 'table'",
        ),
        (
            TABLE + '[[wire]]\nfrom = "table.OUT1"\nto = "table.AIN1"\n',
            "table.AIN1 is not a digital input: digital inputs of 'table' are IN1",
        ),
        (TABLE + '[[button]]\nname = "b"\nto = "table.AIN2"\n', "w.toml:5:1: error D009: table.AIN2 is not a digital input"),
        (AXIS + '[[axis.switch]]\nto = "table.AIN1"\nbelow = 0\n', "w.toml:7:1: error D009: table.AIN1 is not a digital input"),
        (TABLE + '[[source]]\nto = "table.IN3"\n', "table.IN3 is not an analog input: analog inputs of 'table' are AIN1, AIN2"),
        (CHIP + '[[source]]\nto = "chip.B1"\n', "chip.B1 is not an analog input: analog inputs of 'chip' are none"),
        (CHIP + '[[wire]]\nfrom = "chip.JOG"\nto = "chip.B2"\n', "chip.JOG is not an output: outputs of 'chip' are B1, B2"),
        (
            BUS + '[[wire]]\nfrom = "bus.OUT1"\nto = "table.IN1"\n',
            "w.toml:6:1: error D009: 'bus' is a line; controllers are table",
        ),
        (BUS + '[[axis]]\nname = "x"\ndrive = "bus.M1"\n', "w.toml:6:1: error D009: 'bus' is a line; controllers are table"),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nvalue = 12\n',
            "w.toml:3:1: error D009: source of table.AIN1: 12 V: an analog input",
        ),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nkind = "ramp"\nover = 1\nbegin = -3\nend = 5\n',
            "source of table.AIN1: -3 to 5 V: an analog input takes 0 to 10 V",
        ),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nkind = "table"\npoints = [[0, 9], [1, 11]]\n',
            "table.AIN1: 9 to 11 V: an analog",
        ),
        (TABLE + '[[source]]\nto = "table.AIN1"\nkind = "sine"\nvalue = 3\namplitude = -5\n', "table.AIN1: -2 to 8 V: an analog"),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nphase = 1\n',
            "w.toml:5:1: error D007: phase means nothing for kind = 'constant'",
        ),
        (
            TABLE + '[[source]]\nto = "table.AIN1"\nkind = "sine"\nover = 1\n',
            "w.toml:6:1: error D007: over means nothing for kind = 'sine'",
        ),
        (
            AXIS + '[[axis.switch]]\nto = "table.IN1"\nbelow = 0\nwidth = 1\n',
            "w.toml:9:1: error D007: width means nothing without position",
        ),
        (
            AXIS + "[axis.encoder]\ncounts_per_rev = 1\ncounts_per_unit = 1\n",
            "w.toml:8:1: error D007: counts_per_rev and counts_per_unit excl",
        ),
        (BUS + "gap = '0 ms'\n", "'0 ms': permitted are more than 0 and at most 10000 ms"),
        (TABLE + "[[event]]\nat = 1\nsteps = 3\n", "w.toml:5:1: error D002: steps is 3"),
        (AXIS + "encoder = 3\n", "w.toml:6:1: error D002: [axis.encoder] is 3"),
        (AXIS + "[[axis.encoder]]\noffset = 1\n", "error D002: [axis.encoder] is [{'offset': 1}]"),
        (AXIS + "[axis.encoder]\noffset = 1\n", "w.toml:7:1: error D007: offset means nothing without index"),
        (AXIS + "pitch = 1\npulses_per_unit = 1\n", "w.toml:6:1: error D007: pulses_per_unit and pitch exclude each other"),
        (
            AXIS + 'kind = "rotary"\n[axis.motor]\nmass = 1\ntorque = [[0, 1]]\n',
            "w.toml:8:1: error D007: mass means nothing for kind =",
        ),
        (TABLE + "[[event]]\nat = 1\nonce = true\nsteps = []\n", "w.toml:5:1: error D007: once means nothing without when"),
        ("[[fault]]\nkind = 'crcc'\n", "kind = 'crcc' (did you mean 'crc'?): permitted are"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(text: str, message: str) -> None:
    assert message in wrong(text)


@pytest.mark.parametrize(
    ("text", "start", "end"),
    [
        ("[world]\nname = = 2\n", 15, 16),
        ("[world", 6, 6),
        ("[world]\nseed = " + "9" * 5000 + "\n", 15, 79),
        (f"[world]\nseed = {1 << 63}\n", 8, 34),
        ("x = " + "[" * 40, 37, 38),
        (".".join("a" * 3000) + " = 1\n", 64, 65),
    ],
)
def test_what_is_no_toml_has_one_finding_with_its_characters(text: str, start: int, end: int) -> None:
    with pytest.raises(WorldError) as raised:
        read_world("w", text)
    (found,) = raised.value.findings
    assert (found.code, found.span) == ("D001", Span(start, end))


def test_only_what_is_wrong_is_reported_not_what_follows_from_it() -> None:
    """The controller is wrong; the axis has no drive because of that, and the event no axis."""
    event = '[[event]]\nwhen = "x.position > 1"\nsteps = []\n'
    assert places(AXIS.replace("[[axis]]", "unit = 300\n[[axis]]") + event) == ["w.toml:3:1"]


def test_what_is_in_a_misspelt_table_is_not_unknown_elsewhere() -> None:
    """The axis is in no table that there is; the event names it and another one, which is unknown."""
    event = '[[event]]\nwhen = "{}.position > 1"\nsteps = []\n'
    misspelt = AXIS.replace("[[axis]]", "[[axiss]]")
    assert places(misspelt + event.format("x")) == ["w.toml:3:1"]
    assert len(places(misspelt + event.format("y"))) == 2


def test_a_fault_that_is_no_table_leaves_the_others_their_places() -> None:
    assert places('fault = [\n3,\n{ kind = "stall", machine = "b" },\n]\n' + TABLE) == ["w.toml:2:1", "w.toml:3:1"]


def test_a_description_that_is_wrong_is_not_read() -> None:
    with pytest.raises(WorldError, match="unit: 300"):
        read_world("w", TABLE + "unit = 300\n")


def test_all_problems_are_told_at_once_in_order() -> None:
    told = wrong(TABLE + "unit = 0\nlenient = 1\n[[wire]]\n")
    assert [line.split(": ")[0] for line in told.splitlines() if "error" in line] == [
        "w.toml:3:1", "w.toml:4:1", "w.toml:5:1", "w.toml:5:1"
    ]  # fmt: skip


def test_steps_that_speak_of_what_is_not_there_are_told_before_anything_runs() -> None:
    lines = [line for line in wrong(TABLE + STEPS).splitlines() if line.startswith("w.toml")]
    assert [line.partition(" ")[0] for line in lines] == [
        "w.toml:8:5:",
        "w.toml:10:3:",
        "w.toml:11:5:",
        "w.toml:11:37:",
        "w.toml:16:1:",
        "w.toml:17:10:",
        "w.toml:17:45:",
    ]
    assert "step 2: no button is called 'nothing'" in lines[0]
    assert "step 4: firmware 1.70 has no register named 'M1_ENN'" in lines[1]
    assert "step 5: no signal 'table.M1.stat' (did you mean 'M1.status'?); there are M1.status, M1.enabled" in lines[2]
    assert "step 6: no input pin 'OUT1'" in lines[3]
    assert "step 1: no axis M5: axes are M1 to M4" in lines[5]
    assert "step 2: fault stall: axis = 9: permitted are 1 to 4" in lines[6]


def test_more_than_anybody_reads_is_not_told() -> None:
    text = "".join(f"unknown{n} = 1\n" for n in range(100_000))
    assert wrong(text).count("error D004") == 100


def test_everything_is_told_in_one_round_and_nothing_that_only_follows() -> None:
    lines = [line.removeprefix("w.toml:") for line in wrong(MANY).splitlines() if line.startswith("w.toml")]
    assert [(line.split(":")[0], line.partition(": error ")[2][:60]) for line in lines] == [
        ("5", "D003: [mic488]: firmware: '9': permitted are 1.23, 1.40, 1.7"),
        ("6", "D003: [mic488]: unit: 300: permitted are whole numbers from "),
        ("10", "D009: nothing is called 'buss' (did you mean 'bus'?)"),
        ("18", "D003: [axis]: start: 'left': expected a number"),
        ("20", "D003: [axis.switch]: below: 'low': expected a number"),
        ("24", "D009: nothing is called 'nobody'"),
        ("28", "D009: good.IN99 is not a digital input: digital inputs of 'g"),
        ("33", "D003: [button]: bounce: 'soon' is not a time: expected a num"),
        ("41", "D003: [source]: kind: 'sinus': permitted are constant, ramp,"),
        ("46", "D003: [[fault]] (crc): nth = 0: permitted are whole numbers "),
        ("48", "D009: fault stall: axis = 9: permitted are 1 to 4"),
        ("59", "D003: [event]: when: 5: expected a text"),
        ("61", "D003: [event.steps]: wait: 'soon' is not a time: expected a "),
        ("64", "D009: step 4: firmware 1.70 has no register named 'M1_ENN'; "),
        ("64", "D009: step 4: firmware 1.70 has no register named 'M2_ENN'; "),
        ("66", "D009: step 6: no signal 'good.M1.stat' (did you mean 'M1.sta"),
    ]


@pytest.mark.parametrize(
    ("wrong", "right"),
    [
        ('kind = "on-dely"', 'kind = "on-delay"'),
        ('tiem = "1 s"', 'time = "1 s"'),
        ('inputt = "a.OUT1"', 'input = "a.OUT1"'),
    ],
)
def test_near_words_and_keys_have_a_fix_that_mends_the_text(wrong: str, right: str) -> None:
    """The fix replaces the word alone, at its place in the text: the same word stands elsewhere too."""
    keys = ('kind = "on-delay"', 'time = "1 s"', 'input = "a.OUT1"')
    good = '[[mic488]]\nname = "a"\n[[timer]]\nname = "on-dely"\n' + "\n".join(keys) + "\n"
    World.from_toml(good)
    text = good.replace(right, wrong)
    with pytest.raises(WorldError) as caught:
        World.from_toml(text)
    (fix,) = (finding.fix for finding in caught.value.findings if finding.fix is not None)
    assert text[: fix.span.start] + fix.text + text[fix.span.end :] == good


@pytest.mark.parametrize("wrong", ['kind = "sometimes"', "kind = 5"])
def test_words_that_are_near_nothing_have_no_fix(wrong: str) -> None:
    with pytest.raises(WorldError) as caught:
        World.from_toml(f'[[timer]]\nname = "t"\ntime = "1 s"\n{wrong}\n')
    assert [(finding.code, finding.fix) for finding in caught.value.findings] == [("D003", None)]


@pytest.mark.parametrize(
    ("top", "message"),
    [
        ("[campaign]\n", "w.toml:1:1: error D004: this is a campaign, not a world"),
        ("[parameters]\n", "w.toml:1:1: error D004: a file with [parameters] is for [[use]] of a description"),
    ],
)
def test_of_a_file_that_is_something_else_nothing_more_is_told(top: str, message: str) -> None:
    found = wrong(f"{top}[[mic488]]\nnme = 1\n")
    assert found.count("error") == 1
    assert message in found


@pytest.mark.parametrize(
    ("followed", "wrongly"), [("belt", "follows = 'belt' needs counts_per_unit"), ("q", "follows = 'q': permitted are x")]
)
def test_what_an_encoder_follows_is_reported_where_it_is_written(followed: str, wrongly: str) -> None:
    """A belt without counts, and a name that nothing has; the belt is joined by it, and no mistake of its own."""
    belt = '[[conveyor]]\nname = "belt"\nlength = 200\nspeed = 100\n'
    told = wrong(f'{AXIS}pitch = 4.0\n[axis.encoder]\nfollows = "{followed}"\n{belt if followed == "belt" else ""}')
    assert told.startswith(f"w.toml:8:1: error D009: encoder: {wrongly}")
    assert "\n  8 | follows" in told
    assert told.count(": error ") == 1
