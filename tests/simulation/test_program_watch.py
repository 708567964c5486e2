"""What a program of a MIC488 does, statement by statement; a statement takes 1 ms."""

from __future__ import annotations

from textwrap import dedent

from steptwin.files.world import World
from steptwin.simulation.kinds.mic488.program_watch import ProgramWatch
from steptwin.simulation.script.steps import Turn

WORLD = """
    [[mic488]]
    name = "t"
    programs = ["first.prg"]
    start = true
    [mic488.M1]
    gear = 1.0
    acc = 1000.0
    dec = 1000.0
    vel = 500.0
"""


def reports(program: str, seconds: float) -> list[tuple[int, str, str, str]]:
    """Microseconds, kind, text and statement of what happened in the first ``seconds``."""
    world = World.from_toml(dedent(WORLD), {"first.prg": dedent(program).encode()}, name="w.toml")
    watch = ProgramWatch(world.mic488["t"].device, world.objects.scheduler_of["t"], "t")
    world.run(for_=seconds)
    return [(event.time // 1000, event.code, event.text, event.place.strip()) for event in watch.happened]


def test_delays_registers_outputs_and_the_end() -> None:
    """What changes nothing is no news: the second assignment, the WAIT that is met at once."""
    program = """\
        M1 = ON
        VABS M1 500
        DELAY 0.6
        $D2 = 7
        $D2 = 7
        VABS M1 0
        WAIT IN1 = OFF
        OUT3 = ON
        END
        """
    assert reports(program, 1.0) == [
        (1_000, "axis", "M1 on", "1  M1 = ON"),
        (2_000, "axis", "M1 runs at 500 imp/s", "2  VABS M1 500"),
        (3_000, "delay", "waits 0.6 s", "3  DELAY 0.6"),
        (603_000, "register", "$D2 = 7", "4  $D2 = 7"),
        (605_000, "axis", "M1 slows down from 500 imp/s", "6  VABS M1 0"),
        (607_000, "output", "OUT3 on", "8  OUT3 = ON"),
        (608_000, "end", "the program ends", "9  END"),
        (608_000, "axis", "M1 off", "9  END"),
        (608_000, "output", "OUT3 off", "9  END"),
    ]


def test_what_a_statement_waits_for() -> None:
    """Axes that are named, the input, and of WAITPOS those that move. That something looks on is no part of a state."""
    world = World.from_toml(dedent(WORLD), {"first.prg": b"WAIT PosM2 = 9\n"}, name="w.toml")
    watch = ProgramWatch(world.mic488["t"].device, world.objects.scheduler_of["t"], "t")
    assert watch.copy_state() == ()
    taken = world.snapshot()
    world.run(for_=0.1)
    assert [event.text for event in watch.happened] == ["waits for M2"]
    world.restore(taken)
    assert [text for _, code, text, _ in reports("M1 = ON\nPABS M1 20\nWAITPOS\nWAIT IN3 = ON\n", 1.0) if code == "wait"] == [
        "waits for M1",
        "waits for IN3",
    ]


def test_motions_and_a_reset() -> None:
    """At 1000 imp/s²: 20 imp in 2·√0.02 s, 52 imp/s after 52 ms. What an axis does by itself is no statement's."""
    program = """\
        M1 = ON
        PABS M1 20
        WAITPOS
        VABS M1 100
        DELAY 0.05
        VABS M1 200
        BRAKE M1
        WAITPOS
        PREL M1 50
        STOP M1
        HOME M1 -10
        DELAY 0.01
        PROGRESET
        """
    first = [
        (1_000, "axis", "M1 on", "1  M1 = ON"),
        (2_000, "axis", "M1 moves to 20 imp", "2  PABS M1 20"),
        (3_000, "wait", "waits for M1", "3  WAITPOS"),
        (284_842, "axis", "M1 at 20 imp, position reached", ""),
        (286_000, "axis", "M1 runs at 100 imp/s", "4  VABS M1 100"),
        (287_000, "delay", "waits 0.05 s", "5  DELAY 0.05"),
        (337_000, "axis", "M1 runs at 200 imp/s", "6  VABS M1 200"),
        (338_000, "axis", "M1 slows down from 52 imp/s", "7  BRAKE M1"),
        (339_000, "wait", "waits for M1", "8  WAITPOS"),
        (390_000, "axis", "M1 at rest at 22 imp", ""),
        (391_000, "axis", "M1 moves to 72 imp", "9  PREL M1 50"),
        (392_000, "axis", "M1 at rest at 22 imp", "10  STOP M1"),
        (393_000, "axis", "M1 homes", "11  HOME M1 -10"),
        (394_000, "delay", "waits 0.01 s", "12  DELAY 0.01"),
    ]
    assert reports(program, 0.4035) == first
    assert reports(program, 0.4055) == [
        *first,
        (404_000, "reset", "drives off, the program begins again", "13  PROGRESET"),
        (404_000, "axis", "M1 off", "13  PROGRESET"),
        (405_000, "axis", "M1 on", "1  M1 = ON"),
    ]


def test_an_axis_that_follows_its_encoder_is_told_once() -> None:
    """ENCFOLLOW comes to where the shaft was and goes on with each count: two lines for each of them."""
    text = (
        WORLD
        + """[mic488.M2]
    gear = 1.0
    acc = 1000.0
    dec = 1000.0
    vel = 500.0
    pos_ctrl_mode = "ENCFOLLOW"
    """
    )
    world = World.from_toml(dedent(text), {"first.prg": b"M2 = ON\nDELAY 2\nM2 = OFF\n"}, name="w.toml")
    watch = ProgramWatch(world.mic488["t"].device, world.objects.scheduler_of["t"], "t")
    for _ in range(10):
        world.run(for_=0.1)
        world.apply_input(Turn("t", 2, 4))
    world.run(for_=2.0)
    told = [event.text for event in watch.happened if event.text.startswith("M2 ")]
    assert told == ["M2 on", "M2 follows its encoder", "M2 off"]


def test_a_loop_whose_passes_are_no_longer_executed_goes_on_like_this() -> None:
    world = World.from_toml(dedent(WORLD), {"first.prg": b"MAIN:\nDELAY 1\nJUMP MAIN\n"}, name="w.toml")
    watch = ProgramWatch(world.mic488["t"].device, world.objects.scheduler_of["t"], "t")
    world.run(for_=100.0)
    *passes, last = [event.text for event in watch.happened]
    assert {*passes} == {"waits 1 s"}
    assert last == "the loop goes on like this"
