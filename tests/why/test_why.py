"""The chain of causes for each kind of cause. Sentences and moments are those of the worlds in `why_worlds`, followed by hand."""

from __future__ import annotations

import pytest
from why_worlds import CHIP, CHIP_PROGRAM, LINE, PROGRAM, WAITS

from steptwin.controller import MILLISECOND
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.kinds.mic488.writes import REGISTERS
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Bytes, Download
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.why import pastquestions, programs
from steptwin.why.pastquestions import PastQuestions
from steptwin.why.question import finish
from steptwin.wire.rtu import encode_frame


def waits() -> World:
    world = World.from_toml(WAITS, {"p.prg": PROGRAM.encode()})
    world.run(5.0)
    return world


def line(timing: str = "off") -> World:
    return World.from_toml(LINE.replace("TIMING", f'timing = "{timing}"'))


def shown(world: World, question: str, at: float | None = None) -> list[str]:
    """The answer, each run of blanks as one."""
    return [" ".join(text.split()) for text in world.why(question, at).text().splitlines()]


def test_statement_wait_contact_and_script() -> None:
    assert shown(waits(), "cell.OUT1") == [
        "cell.OUT1 is 1, since 1.011000 s (at 5 s)",
        "1.011000 s cell cell.OUT1 became 1",
        "1.011000 s cell line 4 `lamp = ON` was executed",
        "1.011000 s cell line 3 `WAIT start = ON` ended",
        "1.000000 s cell cell.IN1 became 1, which the filter of the input lets in after 10 ms",
        "1.000000 s go go became 1, a contact of cell.IN1",
        "1.000000 s operator script operator: presses go",
    ]


def test_a_relay_follows_its_coil_after_its_time() -> None:
    assert shown(waits(), "guard.no")[:3] == [
        "guard.no is 1, since 1.021000 s (at 5 s)",
        "1.021000 s guard guard.no became 1",
        "1.011000 s cell cell.OUT1 became 1, guard follows after 10 ms",
    ]


@pytest.mark.parametrize(
    ("element", "output", "text"),
    [
        ("[[relay]]\ncoil = 'c.OUT1'\npull_in = '20 ms'\ndrop_out = '30 ms'", "no", "0, e follows after 30 ms"),
        ("[[timer]]\nkind = 'on-delay'\ntime = '40 ms'\ninput = 'c.OUT1'", "out", "0"),
        ("[[timer]]\nkind = 'off-delay'\ntime = '40 ms'\ninput = 'c.OUT1'", "out", "0, e follows after 40 ms"),
        ("[[timer]]\nkind = 'pulse'\ntime = '1100 ms'\ninput = 'c.OUT1'", "out", "1, e follows after 1100 ms"),
    ],
)
def test_what_an_element_delays(element: str, output: str, text: str) -> None:
    """OUT1 is on from 1 s to 2 s."""
    kind, _, keys = element.partition("\n")
    world = World.from_toml(f"[[mic488]]\nname = 'c'\n{kind}\nname = 'e'\n{keys}\n")
    for level in (1, 0):
        world.run(for_=1.0)
        world.mic488["c"].write("OUT1", level)
    world.run(for_=1.0)
    assert shown(world, f"e.{output}")[2].split(" s ")[1] == f"c c.OUT1 became {text}"


def test_a_wait_for_ever_shows_what_it_depends_on() -> None:
    assert shown(waits(), "cell")[:5] == [
        "cell waits at line 5 `WAIT IN2 = ON`, since 1.012000 s (at 5 s)",
        "5.000000 s cell cell.IN2 is 0 from the beginning, driven by both.out",
        "5.000000 s both both.out is 0 from the beginning, driven by guard.no and cell.OUT3",
        "5.000000 s cell cell.OUT3 is 0 from the beginning, which no statement of its program sets",
        "1.012000 s cell line 5 `WAIT IN2 = ON` was executed",
    ]


def test_names_of_registers_in_the_program() -> None:
    world = World.from_toml(
        '[[mic488]]\nname = "m"\nprogram = "p.prg"\nstart = true\n', {"p.prg": b"n = 1\nDELAY 0.5\n$R10 = 2,5\nWAIT IN1 = ON\n"}
    )
    world.run(1.0)
    assert shown(world, "$R10 > 1")[0].startswith("m.USER_REGISTER[10]:real > 1 is true, since 0.50")
    assert shown(world, "m.VmaxM1") == ["m.M1_VMAX is 1000, from the beginning (at 1 s)"]
    assert shown(world, "m.$R10 > 1")[0].startswith("m.USER_REGISTER[10]:real > 1 is true, since 0.50")
    with pytest.raises(Misuse, match="no signal '\\$R11'"):
        world.why("$R11")
    for name in ("n", "m.n"):
        with pytest.raises(Misuse, match=f"^{name} is a variable of the program of m: ask about it alone"):
            world.why(f"{name} > 1")


def test_the_moment_decides() -> None:
    world = waits()
    assert shown(world, "OUT1 = 0", 0.5)[:3] == [
        "cell.OUT1 = 0 is true, from the beginning (at 0.5 s)",
        "0.500000 s cell cell.OUT1 is 0 from the beginning",
        "0.500000 s cell cell waits at line 3 `WAIT start = ON`",
    ]
    assert shown(world, "why cell", 0.5)[0] == "cell waits at line 3 `WAIT start = ON`, since 0.001000 s (at 0.5 s)"


def test_a_gate_shows_which_input_and_the_end_of_a_pulse_what_began_it() -> None:
    world = waits()
    world.mic488["cell"].write("OUT3", 1)
    world.run(7.0)
    assert shown(world, "IN2") == [
        "cell.IN2 is 1, since 5.000000 s (at 7 s)",
        "5.000000 s cell cell.IN2 became 1",
        "5.000000 s both both.out became 1, which is wired to cell.IN2",
        "5.000000 s cell cell.OUT3 became 1",
        "5.000000 s outside from outside: writes cell.OUT3 = 1",
    ]
    assert shown(world, "OUT2")[1:4] == [
        "5.511000 s cell cell.OUT2 became 1",
        "5.011000 s cell line 6 `PULSE(OUT2, 0,5)` was executed",
        "5.011000 s cell line 5 `WAIT IN2 = ON` ended",
    ]


@pytest.mark.parametrize("timing", ["off", "strict"])
def test_a_write_of_a_client(timing: str) -> None:
    world = line(timing)
    world.run(1.0)
    (pdu,) = REGISTERS.requests(world.mic488["other"].device, (("OUT3", 1.0),), is_command=False)
    world.apply_input(Bytes("bus", "hmi", "rtu", encode_frame(2, pdu)))
    world.run(2.0)
    effect, cause = world.why("other.OUT3").links
    assert effect.text == "other.OUT3 became 1"
    assert (cause.subject, cause.text) == ("bus", "client hmi: unit 2: write OUT3 = ON")
    assert 1_000_000_000 <= cause.time <= effect.time


def test_a_read_or_a_write_to_another_controller_is_no_cause() -> None:
    world = line()
    world.run(1.0)
    (to_other,) = REGISTERS.requests(world.mic488["other"].device, (("OUT3", 1.0),), is_command=False)
    (to_table,) = REGISTERS.requests(world.mic488["table"].device, (("OUT3", 1.0),), is_command=False)
    read = bytes.fromhex("03 00 00 00 01")
    for unit, pdu in ((2, to_other), (1, to_table), (2, read)):
        world.apply_input(Bytes("bus", "hmi", "rtu", encode_frame(unit, pdu)))
    world.run(2.0)
    assert world.why("other.OUT3").links[1].text == "client hmi: unit 2: write OUT3 = ON"
    assert world.why("table.OUT3").links[1].text == "client hmi: unit 1: write OUT3 = ON"


def test_a_switch_at_a_place_of_an_axis_that_was_commanded_to_move() -> None:
    world = line()
    world.mic488["table"].write("M1_EN", 1)
    world.run(0.5)
    world.mic488["table"].write("M1_POS_ABS", 20_000.0)
    world.run(60.0)
    chain = shown(world, "other.IN3")
    assert chain[2:] == [
        f"{world.why('other.IN3').links[1].time / 1e9:.6f} s x x.switch1 became 1, a contact of other.IN3",
        "0.500000 s table x (table.M1) began to move",
        "0.500000 s bus request: unit 1: write M1_POS_ABS = 20000 imp",
        "0.500000 s outside from outside: writes table.M1_POS_ABS = 20000",
    ]
    reached = world.why("table.M1.status == 4")
    assert reached.links[0].text == "the motion of table.M1 ended, which began at 0.500000 s"
    assert reached.links[0].time == reached.since
    assert world.why("x.position", 1.0).links[0].text == "x (table.M1) began to move"
    assert world.why("table.hr:10020").since == reached.since


def test_a_wait_for_all_axes_is_for_the_one_that_ends_last() -> None:
    """Not for the one that was commanded last, which arrives long before."""
    program = "M1 = ON\nM2 = ON\nPABS M1 2000\nPABS M2 10\nWAITPOS\nOUT1 = ON\n"
    world = World.from_toml('[[mic488]]\nname = "table"\nprogram = "a.prg"\nstart = true\n', {"a.prg": program.encode()})
    world.run(3.0)
    waiting = shown(world, "table")
    assert waiting[0].startswith("table waits at line 5 `WAITPOS`")
    assert waiting[1].endswith("table table.M1 began to move")
    assert len(set(waiting)) == len(waiting)
    world.run(60.0)
    ended = shown(world, "OUT1")
    assert ended[3].endswith("table line 5 `WAITPOS` ended")
    assert "the motion of table.M1 ended, which began at" in ended[4]


def moves() -> World:
    """Motions from 0.001 s and from 3 s on: 500 pulses take less than 1 s."""
    program = "M1 = ON\nPABS M1 500\nWAITPOS\nDELAY 2\nPABS M1 0\nWAITPOS\nWAIT IN1 = ON\n"
    return World.from_toml('[[mic488]]\nname = "table"\nprogram = "a.prg"\nstart = true\n', {"a.prg": program.encode()})


@pytest.mark.parametrize("point", ["M1.moving", "M1.velocity", "M1.position", "M1_POS_ACT", "M1.status"])
def test_what_changes_by_the_end_of_a_motion_is_so_since_that_end(point: str) -> None:
    world = moves()
    world.run(20.0)
    end = world.why("M1.moving == 0").since
    assert end is not None
    began = world.why("M1.moving", at=end / 1e9 - 0.01)
    assert (began.state, began.links[0].text) == ("table.M1.moving is 1", "line 5 `PABS M1 0` was executed")
    assert began.since == began.links[0].time < end
    answer = world.why(point)
    assert answer.since == end
    assert [link.text for link in answer.links[:2]] == [
        f"the motion of table.M1 ended, which began at {began.links[0].time / 1e9:.6f} s",
        "line 5 `PABS M1 0` was executed",
    ]


def test_a_running_twin_knows_the_end_of_a_motion_that_is_long_past() -> None:
    world = moves()
    snapshots = SnapshotLog(world)
    for second in range(1, 21):
        world.run(float(second))
        snapshots.take()
    questions = PastQuestions(snapshots)
    for point in ("M1.moving", "M1.position"):
        answer = finish(questions.asking(point))
        assert answer.since == world.why(point).since
        assert answer.links[1].text == "line 5 `PABS M1 0` was executed"


@pytest.mark.parametrize(("point", "cause"), [("moving", "stands at 6400"), ("position", "the motion of chip.M1 ended")])
def test_the_end_of_a_motion_of_an_m1486(point: str, cause: str) -> None:
    """At the same moment the next command is executed, which has nothing to do with it."""
    world = World.from_toml(CHIP, {"p.m1486": CHIP_PROGRAM.replace("Z2\n", "").encode()})
    world.run(2.0)
    answer = world.why(point)
    assert answer.since == world.why("B1").since
    ended, *links = sorted(answer.links[:2], key=lambda link: "the program came to its end" in link.text)
    assert ended.text.startswith(cause)
    assert [link.text for link in (*links, answer.links[2])] == [
        "the program came to its end at line 6 `C1`",
        "line 5 `R` was executed",
    ]


def test_what_never_moved_and_what_was_set_since() -> None:
    world = moves()
    world.run(10.0)
    for point in ("M2.moving", "M2.position"):
        assert world.why(point).since is None
    world.mic488["table"].write("M1_POS_ACT", 77.0)
    world.run(11.0)
    answer = world.why("M1.position")
    assert (answer.since, answer.links[0].text) == (10_000_000_000, "from outside: writes table.M1_POS_ACT = 77")


def test_a_fault_is_a_cause_of_what_it_names_only() -> None:
    world = line()
    world.run(1.0)
    world.mic488["other"].write("OUT3", 1)
    world.fault("stuck machine=other pin=IN4 value=1")
    world.run(2.0)
    assert [link.text for link in world.why("other.IN4").links] == [
        "other.IN4 became 1",
        "fault stuck: IN4 is stuck at 1",
        "from outside: sets the fault stuck",
    ]
    assert world.why("other.OUT3").links[1].text == "request: unit 2: write OUT3 = ON"


def test_a_stuck_output_of_an_element() -> None:
    world = waits()
    world.fault("stuck-output element=both output=out level=1")
    world.run(6.0)
    assert [link.text for link in world.why("both.out").links] == [
        "both.out became 1",
        "fault stuck-output: both.out is stuck at 1",
        "from outside: sets the fault stuck-output",
    ]


def test_a_fault_that_holds_the_level_that_is_there() -> None:
    """There is no change that it causes, but it is why there is none."""
    world = waits()
    world.fault("stuck machine=cell pin=IN2 value=0 name=cut")
    world.run(6.0)
    by_fault = ["5.000000 s cell cell.IN2 is held at 0 by fault cut", "5.000000 s outside from outside: sets the fault cut"]
    assert shown(world, "cell.IN2 == 0") == ["cell.IN2 == 0 is true, from the beginning (at 6 s)", *by_fault]
    assert shown(world, "cell")[1:4] == ["6.000000 s cell cell.IN2 is held at 0 by fault cut since 5.000000 s", *by_fault]
    assert shown(world, "IN2", 4.0)[:2] == [
        "cell.IN2 is 0, from the beginning (at 4 s)",
        "4.000000 s cell cell.IN2 is 0 from the beginning, driven by both.out",
    ]
    world.clear_fault("cut")
    world.run(7.0)
    assert not any("cut" in line for line in shown(world, "IN2"))
    assert shown(world, "IN2", 5.5)[1:] == by_fault


def test_a_level_that_changed_before_a_fault_held_it() -> None:
    world = waits()
    world.fault("stuck machine=cell pin=IN1 value=1")
    world.run(6.0)
    assert [link.text for link in world.why("IN1").links[:3]] == [
        "cell.IN1 is held at 1 by fault stuck",
        "from outside: sets the fault stuck",
        "cell.IN1 became 1",
    ]


def test_terminals_that_are_held() -> None:
    world = waits()
    world.fault("stuck-input element=both input=in2 level=0 name=open")
    world.run(6.0)
    assert "6.000000 s both both.in2 is held at 0 by fault open since 5.000000 s" in shown(world, "cell")
    world.fault("stuck-output element=both output=out level=0")
    world.run(7.0)
    for question in ("both.out", "cell.IN2"):
        assert world.why(question).links[0].text == "both.out is held at 0 by fault stuck-output"


def test_a_running_twin_knows_a_fault_that_was_set_long_ago() -> None:
    world = waits()
    world.fault("stuck machine=cell pin=IN2 value=0")
    snapshots = SnapshotLog(world)
    for second in range(5, 20):
        world.run(float(second))
        snapshots.take()
    assert finish(PastQuestions(snapshots).asking("IN2")).links[0].text == "cell.IN2 is held at 0 by fault stuck"


def test_commands_of_an_m1486() -> None:
    world = World.from_toml(CHIP, {"p.m1486": CHIP_PROGRAM.encode()})
    world.run(1.0)
    assert shown(world, "chip")[:2] == [
        "chip waits at line 4 `Z2`, since 0.101000 s (at 1 s)",
        "1.000000 s chip chip.B2 is 1 from the beginning, to which nothing is wired",
    ]
    world.apply_input(do.Set((("chip", "B2", 0.0),)))
    world.run(20.0)
    chain = shown(world, "B1")
    assert chain[1:] == [
        f"{chain[1].partition(' ')[0]} s chip chip.B1 became 0",
        f"{chain[1].partition(' ')[0]} s chip line 7 `C1` was executed",
        f"{chain[3].partition(' ')[0]} s chip line 6 `R` ended",
        f"{chain[3].partition(' ')[0]} s chip the motion of chip.M1 ended, which began at 1.001000 s",
        "1.001000 s chip line 6 `R` was executed",
        "1.000000 s chip line 5 `F6400` was executed",
        "1.000000 s chip line 4 `Z2` ended",
        "1.000000 s chip chip.B2 became 0",
        "1.000000 s outside from outside: sets chip.B2 = 0",
    ]


@pytest.mark.parametrize(
    ("program", "signal", "causes"),
    [
        ("W10 N3", "N", ["line 3 `N3` was executed", "line 2 `W10` ended"]),
        ("W10 F64000 R", "BOOST", ["line 4 `R` was executed", "line 3 `F64000` was executed", "line 2 `W10` ended"]),
        ("T40 W10 F6400 V64 R", "B1", ["line 6 `R` was executed", "line 4 `F6400` was executed", "line 3 `W10` ended"]),
        ("W10 =640", "counter", ["line 3 `=640` was executed", "line 2 `W10` ended"]),
        ("W10 C100 :640 >9", "counter", ["line 5 `>9` was executed", "line 4 `:640` was executed", "line 2 `W10` ended"]),
        (
            "W5 T80 I80H1 W5 @1 C4",
            "B4",
            [
                "line 7 `C4` was executed",
                "line 4 `I80H1` decided: line 7 `C4` came next",
                "line 3 `T80` was executed",
                "line 2 `W5` ended",
            ],
        ),
        (
            "W5 :2 J @1 C3 @2 C4",
            "B4",
            [
                "line 8 `C4` was executed",
                "line 4 `J` decided: line 8 `C4` came next",
                "line 3 `:2` was executed",
                "line 2 `W5` ended",
            ],
        ),
    ],
)
def test_what_else_commands_of_an_m1486_change_and_read(program: str, signal: str, causes: list[str]) -> None:
    text = "\n".join(["[", *program.split(), "W5000", "]", ""])
    world = World.from_toml('[[m1486]]\nname = "chip"\nprogram = "p.m1486"\n', {"p.m1486": text.encode()})
    world.run(1.0)
    links = [link.text for link in world.why(signal).links if not link.text.startswith("chip.")]
    assert links == [*causes, "the program started"]


def test_a_condition_that_was_false_once_more() -> None:
    world = waits()
    world.release("go")
    world.run(6.0)
    world.press("go")
    world.run(7.0)
    assert world.why("cell.IN1 == 1 and cell.OUT1 == 1").since == 6_000_000_000
    assert world.why("cell.IN1 == 1 or cell.OUT1 == 1").since == 1_000_000_000


FLOW = """\
SET n = 0
CFGINT_IN2 = RIS
MAIN:
IF IN1 = ON
    JUMP PART
ELSE
    n = 2
ENDIF
OUT3 = ON
JUMP MAIN
PART:
n = 1
OUT1 = ON
WAIT IN4 = ON
RETURN
INT_IN2:
OUT2 = ON
RETURN
"""


def test_a_jump_and_an_interrupt_lead_to_what_they_depend_on() -> None:
    world = World.from_toml('[[mic488]]\nname = "cell"\nprogram = "p.prg"\nstart = true\n', {"p.prg": FLOW.encode()})
    for time, pin in ((1, "IN1"), (2, "IN2")):
        world.run(float(time))
        world.apply_input(do.Set((("cell", pin, 1.0),)))
    world.run(3.0)
    assert [link.text for link in world.why("OUT1").links[-4:]] == [
        "line 13 `OUT1 = ON` was executed",
        "line 4 `IF IN1 = ON` decided: line 5 `JUMP PART` came next",
        "cell.IN1 became 1, which the filter of the input lets in after 10 ms",
        "from outside: sets cell.IN1 = 1",
    ]
    assert [link.text for link in world.why("OUT2").links[1:]] == [
        "line 17 `OUT2 = ON` was executed",
        "line 16 `INT_IN2:` came",
        "cell.IN2 became 1, which the filter of the input lets in after 10 ms",
        "from outside: sets cell.IN2 = 1",
        "line 2 `CFGINT_IN2 = RIS` was executed",
        "the program started",
    ]
    assert [link.text for link in world.why("OUT3").links[-2:]] == ["line 9 `OUT3 = ON` was executed", "the program started"]


def test_a_program_that_was_replaced() -> None:
    world = waits()
    world.mic488["cell"].write("PROGRAM_CTRL", 0)
    world.apply_input(Download("cell", "program 0", "OUT4 = ON\n"))
    world.run(6.0)
    past = world.past
    assert past.ask("cell", 2_000_000_000).state.startswith("cell waits at line 5")
    past.ask("OUT4")  # it is known up to the end now
    assert past.ask("OUT1", 2_000_000_000).links[0].text == "cell.OUT1 became 1"
    assert past.ask("cell", 2_000_000_000).state.startswith("cell does not wait: a statement of a program that was replaced")


def test_a_past_of_many_statements_is_known_near_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """As far as the limit permits, also for a second question."""
    world = World.from_toml(
        '[[mic488]]\nname = "m"\nprogram = "p"\nstart = true\nstatement_time = "1 us"\n',
        {"p": b"n = 0\nMAIN:\n    n = n + 1\n    IF n = 12000\n        OUT3 = ON\n    ENDIF\nJUMP MAIN\n"},
        keep_trace=False,
    )
    monkeypatch.setattr(pastquestions, "MOST_NOTED", 20_000)
    monkeypatch.setattr(programs, "MOST_UNDECIDED", 20_000)
    snapshots = SnapshotLog(world)
    for moment in range(1, 11):
        world.run_to(moment * 5 * MILLISECOND)
        snapshots.take()
    questions = PastQuestions(snapshots)
    for _ in range(2):
        answer = finish(questions.asking("OUT3"))
        assert answer.links[1].text == "line 5 `OUT3 = ON` was executed"
        assert answer.is_cut
        assert answer.known_from == 25 * MILLISECOND
        assert finish(questions.asking("m")).state.startswith("m does not wait: line ")


def test_contacts_are_signals_too() -> None:
    assert waits().why("go").links[1].text == "script operator: presses go"
    assert waits().why("go == 1 and cell.OUT1").since == 1_011_000_000
    assert waits().why("go.pressed").links[0].text == "go became 1"


def test_levels_in_volts() -> None:
    world = line()
    world.run(1.0)
    world.apply_input(do.Set((("table", "AIN1", 5.0),)))
    world.run(2.0)
    assert world.why("table.AIN1 > 3 V").links[1].text == "from outside: sets table.AIN1 = 5"


def test_plain_answers() -> None:
    answer = waits().why("guard.no").to_json()
    assert answer["since_ns"] == "1021000000"
    assert answer["complete"] is True
    message = {"id": "why.became", "values": {"signal": "guard.no", "value": 1, "how": ""}}
    link = {"time_ns": "1021000000", "subject": "guard", "text": "guard.no became 1", "messages": {"text": message}}
    assert answer["links"][0] == link


def test_a_question_changes_nothing() -> None:
    asked, other = waits(), waits()
    asked.why("cell")
    asked.run(6.0)
    other.run(6.0)
    assert asked.trace.digest() == other.trace.digest()


@pytest.mark.parametrize(
    ("question", "at", "message"),
    [
        ("cell.OUT99", None, "no signal"),
        ("nothing.x == 1", None, "nothing is called 'nothing'"),
        ("cell", 6.0, "6 s: the past is kept from 0 s to 5 s"),
        ("cell.OUT1 ==", None, "ends too early"),
    ],
)
def test_what_is_no_question(question: str, at: float | None, message: str) -> None:
    with pytest.raises(Misuse, match=message):
        waits().why(question, at)


def test_a_name_that_several_controllers_have() -> None:
    with pytest.raises(Misuse, match=r"OUT3 is of table and other: ask with the controller, such as table\.OUT3"):
        line().why("OUT3")


def test_a_world_without_its_inputs() -> None:
    world = World.from_toml(WAITS, {"p.prg": PROGRAM.encode()}, keep_inputs=False)
    with pytest.raises(Misuse, match="does not keep its inputs"):
        world.why("cell")


TWO_AXES = """
[[line]]
name = "bus"
TIMING
[[mic488]]
name = "c"
line = "bus"
PROGRAM
"""
WITH_PROGRAM = 'program = "p.prg"\nstart = true'


def two_axes(program: str) -> World:
    world = World.from_toml(TWO_AXES.replace("TIMING", "").replace("PROGRAM", WITH_PROGRAM), {"p.prg": program.encode()})
    world.run(3.0)
    return world


def test_a_motion_that_ended_and_not_the_one_that_is_planned_behind_the_wait_for_it() -> None:
    """In one nanosecond the wait ends and the next statement plans a motion of another axis."""
    world = two_axes("M1 = ON\nM2 = ON\nPABS M1 200\nWAITPOS\nPABS M2 100\nWAITPOS\nOUT1 = ON\nWAIT IN8 = ON\n")
    chain = [link.text for link in world.why("OUT1").links[1:]]
    began = [link.time / 1e9 for link in world.why("OUT1").links if link.text.endswith("00` was executed")]
    assert chain == [
        "line 7 `OUT1 = ON` was executed",
        "line 6 `WAITPOS` ended",
        f"the motion of c.M2 ended, which began at {began[0]:.6f} s",
        "line 5 `PABS M2 100` was executed",
        "line 4 `WAITPOS` ended",
        f"the motion of c.M1 ended, which began at {began[1]:.6f} s",
        "line 3 `PABS M1 200` was executed",
        "the program started",
    ]


@pytest.mark.parametrize(("end", "text"), [("", "the end of the program"), ("END\n", "line 3 `END`")])
def test_what_the_end_of_a_program_switches_off(end: str, text: str) -> None:
    world = two_axes("OUT1 = ON\nDELAY 0.5\n" + end)
    assert [link.text for link in world.why("OUT1").links] == [
        "c.OUT1 became 0",
        f"{text} was executed",
        "line 2 `DELAY 0.5` ended",
        "the program started",
    ]


def test_a_wait_for_a_place_is_ended_by_the_motion() -> None:
    world = two_axes("M1 = ON\nPABS M1 2000\nWAIT PosM1 > 50\nOUT1 = ON\nWAITPOS\nWAIT IN8 = ON\n")
    assert [link.text for link in world.why("OUT1").links[2:5]] == [
        "line 3 `WAIT PosM1 > 50` ended",
        "c.M1 began to move",
        "line 2 `PABS M1 2000` was executed",
    ]


def test_a_terminal_follows_what_drives_it_and_an_output_that_was_before_is_no_cause() -> None:
    world = waits()
    for terminal in ("guard.coil", "both.in2"):
        world.mic488["cell"].write("OUT3", 1)
        driver = {"guard.coil": "cell.OUT1", "both.in2": "cell.OUT3"}[terminal]
        assert world.why(terminal).links[0].text == f"{driver} became 1"
        assert world.why(terminal).since == world.why(driver).since


def test_the_output_that_enables_a_drive() -> None:
    world = two_axes("M1 = ON\nDELAY 0.3\nM1 = OFF\nM2 = ON\nDELAY 5\n")
    assert world.why("M1_EN == 0").links[1].text == "line 3 `M1 = OFF` was executed"
    assert world.why("M1_EN == 1", 0.2).links[1].text == "line 1 `M1 = ON` was executed"
    assert world.why("M2_EN == 1").links[1].text == "line 4 `M2 = ON` was executed"
    (never,) = world.why("M3_EN").links
    assert never.text == "c.M3_EN is 0 from the beginning, which no statement of its program sets"


REQUESTS = """
[[script]]
name = "s"
steps = [{ wait = "0.1 s" }, { write = { "c.M1_EN" = 1 } }, { write = { "c.M1_POS_ABS" = 100 } }, { wait = "1 s" },
  { write = { "c.M1_ACC" = 5000 } }, { write = { "c.M1_POS_REL" = -50 } }]
"""


@pytest.mark.parametrize("timing", ["off", "real"])
@pytest.mark.parametrize("is_far", [False, True])
def test_the_request_that_wrote_a_register(timing: str, is_far: bool) -> None:
    """Others come in the same nanosecond; with timing nothing else happens at the moment at which it is written."""
    text = TWO_AXES.replace("TIMING", f'timing = "{timing}"').replace("PROGRAM", "") + REQUESTS
    world = World.from_toml(text)
    world.run(30.0 if is_far else 3.0)
    answer = world.why("c.M1_ACC")
    assert [link.text for link in answer.links] == [
        "request: write M1_ACC = 5000 imp/s²",
        "script s: writes c.M1_ACC = 5000",
    ]
    request, script = answer.links
    assert answer.since == request.time
    before, after = World.from_toml(text), World.from_toml(text)
    before.run_to(request.time - 1)
    after.run_to(request.time)
    assert (before.read("c.M1_ACC"), after.read("c.M1_ACC")) == (1000.0, 5000.0)
    assert 1_100_000_000 <= script.time <= request.time
    assert [link.text for link in world.why("M1_EN == 1").links[1:]] == [
        "request: write M1_EN = ON",
        "script s: writes c.M1_EN = 1",
    ]


COUNTS = """\
n = 0
CFGINT_IN1 = RIS
MAIN:
$R0 = n
IF $R4 > 0
    PABS M1 $R4
    WAITPOS
    OUT2 = ON
    WAIT IN8 = ON
ENDIF
DELAY 0.05
JUMP MAIN
INT_IN1:
n = n + 1
RETURN
"""
HANDS = """
[[button]]
name = "go"
to = "c.IN1"
[[script]]
name = "hand"
steps = [{ wait = "0.4 s" }, { press = "go" }, { wait = "0.4 s" }, { write = { "c.USER_REGISTER[4]:real" = 12 } }]
"""


@pytest.fixture(scope="module")
def counts() -> World:
    text = TWO_AXES.replace("TIMING", "").replace("PROGRAM", WITH_PROGRAM + "\n[mic488.M1]\nmot_resol = 200")
    world = World.from_toml(text + HANDS, {"p.prg": b"M1 = ON\n" + COUNTS.encode()})
    world.run(3.0)
    return world


def test_a_count_leads_to_the_interrupt_in_which_it_is_made(counts: World) -> None:
    assert [link.text for link in counts.why("$R0").links] == [
        "line 5 `$R0 = n` was executed",
        "line 15 `n = n + 1` was executed",
        "line 14 `INT_IN1:` came",
        "c.IN1 became 1, which the filter of the input lets in after 10 ms",
        "go became 1, a contact of c.IN1",
        "script hand: presses go",
        "line 3 `CFGINT_IN1 = RIS` was executed",
        "line 2 `n = 0` was executed, which gave n its value before",
        "the program started",
    ]


def test_a_position_and_a_register_lead_to_who_wrote_the_register(counts: World) -> None:
    written = ["request: write USER_REGISTER 4 … 5 = 0, 16704", "script hand: writes c.USER_REGISTER[4]:REAL = 12"]
    assert [link.text for link in counts.why("$R4").links] == written
    assert [link.text for link in counts.why("M1.position").links[1:]] == [
        "line 7 `PABS M1 $R4` was executed",
        "line 6 `IF $R4 > 0` decided: line 7 `PABS M1 $R4` came next",
        *written,
    ]


def test_an_interrupt_does_not_end_the_wait_that_it_comes_in() -> None:
    program = b"CFGINT_IN1 = RIS\nDELAY 1\nOUT1 = ON\nWAIT IN8 = ON\nINT_IN1:\nOUT2 = ON\nRETURN\n"
    text = TWO_AXES.replace("TIMING", "").replace("PROGRAM", WITH_PROGRAM)
    world = World.from_toml(text + HANDS.partition('{ wait = "0.4 s" }, { write')[0].rstrip(", ") + "]\n", {"p.prg": program})
    world.run(3.0)
    answer = world.why("OUT1")
    assert [link.text for link in answer.links[2:]] == ["line 2 `DELAY 1` ended", "the program started"]
    assert answer.links[2].time == answer.since


def test_a_workpiece_is_counted_because_it_came_and_not_because_of_an_output() -> None:
    world = World.from_toml(
        "[[mic488]]\nname = 'c'\n[[conveyor]]\nname = 'belt'\nlength = 200\nspeed = 150\nfeed = 'c.OUT1'\nrun = 'c.OUT2'\n"
        "[[conveyor.sensor]]\nat = 60\nto = 'c.IN4'\n"
    )
    for output in ("OUT2", "OUT1"):
        world.run(for_=0.5)
        world.mic488["c"].write(output, 1)
    world.run(for_=0.2)
    assert [link.text for link in world.why("belt.count").links] == [
        "belt.1 is on belt",
        "c.OUT1 became 1",
        "from outside: writes c.OUT1 = 1",
    ]


def test_a_supply_that_is_off_leads_to_its_fault_or_to_what_switches_it() -> None:
    world = World.from_toml(
        "[[mic488]]\nname = 'c'\n[[supply]]\nname = 'p'\nfeeds = 'c'\n"
        "[[fault]]\nkind = 'brown-out'\nelement = 'p'\nfrom_s = 0.9\nuntil_s = 1.0\n"
    )
    world.run(0.5)
    world.mic488["c"].write("OUT2", 1)
    world.run(1.5)
    links = [link.text for link in world.why("OUT2").links]
    assert links[0] == "power-on, and nothing has switched c.OUT2 on since"
    assert [links[-4], links[-2]] == ["c.OUT2 became 0", "p is off, with c"]
    assert links[-1].startswith("fault brown-out")


def test_an_element_that_acts_on_a_level_from_the_beginning() -> None:
    world = World.from_toml(
        "[[mic488]]\nname = 'c'\n[[gate]]\nname = 'n'\nkind = 'not'\ninputs = ['c.OUT1']\n"
        "[[cylinder]]\nname = 'z'\nextend = 'n.out'\nextend_time = '60 ms'\n"
    )
    world.run(1.0)
    answer = world.why("z.extended")
    assert [link.text for link in answer.links] == [
        "z.extended became 1",
        "n.out is 1 from the beginning, on which z has acted since",
        "c.OUT1 is 0 from the beginning, which nothing has set",
    ]
    assert answer.broken is None
