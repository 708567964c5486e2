"""The programs of controllers while they are executed: statements, labels, where they stand, what is reported of them."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.files.world import World
from steptwin.simulation.kinds.programs import Programs, StatementLocation, StatementSubscription
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.subject.subscriptions import filter_of
from steptwin.subject.world import WorldSubject

WBC = """\
n = 0
MAIN:
    n = n + 1
    IF IN1 = 1
        JUMP COUNT
    ENDIF
    WAIT IN2 = 1
JUMP MAIN
COUNT:
    OUT1 = ON
    RETURN
INT_IN3:
    OUT2 = ON
    RETURN
"""
CHIP = "[\n:5\n@1\nL2\n+1\nE\n'2\nW5\nJ1\n@2\n+2\n.\n]\n"
WORLD = """
[world]
name = "two"
[[line]]
name = "chips"
kind = "m1486"
[[mic488]]
name = "m"
program = "m.prg"
start = true
[[m1486]]
name = "c"
line = "chips"
program = "c.m1486"
"""


def two() -> World:
    return World.from_toml(WORLD, {"m.prg": WBC.encode(), "c.m1486": CHIP.encode()})


def executed(world: World, seconds: float) -> list[tuple[int, str, str, object]]:
    found: list[TraceRecord] = []
    subscriber = StatementSubscription(world.programs, found.append)
    world.run_to(world.now + round(seconds * SECOND))
    subscriber.close()
    count = len(found)
    world.run_to(world.now + SECOND)
    assert len(found) == count  # nobody is called after `close`
    return [(record.time, record.controller, record.subject, record.value) for record in found]


def test_statements_of_wbc_are_reported_with_their_lines_and_a_wait_once() -> None:
    world = two()
    rows = [(time, line) for time, controller, text, line in executed(world, 0.02) if (controller, text) == ("m", "program 0")]
    assert rows == [(1_000_000, 1), (2_000_000, 3), (3_000_000, 4), (4_000_000, 7)]


def test_commands_of_an_m1486_are_reported_with_their_lines() -> None:
    world = two()
    rows = [(time, line) for time, controller, _, line in executed(world, 0.012) if controller == "c"]
    lines = [2, 4, 5, 6, 5, 6, 7, 11, 12, 8]
    assert rows == [(n * MILLISECOND, line) for n, line in enumerate(lines)]


def test_the_programs_of_a_world() -> None:
    world = two()
    assert list(world.programs) == ["m", "c"]
    mic, chip = world.programs["m"], world.programs["c"]
    assert mic.texts["program 0"].name == "m.prg"
    assert [statement.line for statement in mic.statements("program 0")] == [1, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 14, 15]
    assert mic.labels("program 0") == {"MAIN": 1, "COUNT": 7, "INT_IN3": 9}
    assert chip.labels("program") == {"label 1": 1, "label 2": 7}
    text = chip.texts["program"].text
    first = [text[one.start : one.end] for one in chip.statements("program")][:3]
    assert first == [":5", "L2", "+1"]


def test_what_comes_next_in_the_text() -> None:
    """A branch has both ways; a JUMP goes on behind its call, RETURN and the dot nowhere; ENDIF only closes a block."""
    programs = two().programs
    assert programs["m"].after("program 0") == {
        0: (1,), 1: (2,), 2: (3, 5), 3: (4,), 5: (6,), 6: (7,), 7: (8,), 8: (), 9: (10,), 10: (11,), 11: (),
    }  # fmt: skip
    chip = programs["c"].after("program")
    assert {number: chip[number] for number in (0, 1, 2, 3, 5, 6, 7, 8)} == {
        0: (1,), 1: (2,), 2: (3,), 3: (2, 4), 5: (6,), 6: (1,), 7: (8,), 8: (),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "text", "starts", "reached"),
    [
        ("m", "program 0", [0], range(12)),
        ("m", "program 0", [1], range(1, 12)),
        ("m", "program 0", [7], range(1, 12)),  # COUNT, what is behind its calls, and the interrupt at any time
        ("m", "program 0", [], range(9, 12)),
        ("c", "program", [0], range(9)),
        ("c", "program", [3], range(1, 9)),  # the end of the loop, and J1 behind it
        ("c", "program", [7], range(1, 9)),
        ("c", "program", [8], range(1, 9)),
        ("c", "program", [], []),
        ("c", "program", [8, 9], range(1, 9)),  # 9 is not a command
    ],
)
def test_what_is_reached(name: str, text: str, starts: list[int], reached: Iterable[int]) -> None:
    assert sorted(two().programs[name].reached(text, starts)) == list(reached)


def test_what_has_begun_before_anybody_could_look() -> None:
    world = two()
    mic, chip = world.programs["m"], world.programs["c"]
    world.sync_all()
    assert (mic.begun(0), chip.begun(0)) == ((), (0,))
    assert (mic.statement_time, chip.statement_time) == (MILLISECOND, MILLISECOND)
    assert chip.begun(1) == ()
    world.run_to(3 * MILLISECOND)
    assert (mic.begun(world.now), chip.begun(world.now)) == ((), ())


def test_pins_have_their_levels_before_the_first_statement() -> None:
    """A line of a chip is high by itself; a button that nobody presses holds it low."""
    buttons = '[[button]]\nname = "go"\nto = "c.B3"\n[[button]]\nname = "on"\nto = "m.IN1"\n'
    texts = {"m.prg": b"WAIT IN1 = ON\nOUT1 = ON\n", "c.m1486": b"[\nO3\nT5\nC5\n]\n"}
    world = World.from_toml(WORLD + buttons, texts)
    world.run_to(SECOND)
    stands = [programs.stand(world.now) for programs in world.programs.values()]
    assert [stand and stand.location for stand in stands] == [("program 0", 0), ("program", 0)]


def test_calls_come_back_and_loops_do_not() -> None:
    mic = two().programs["m"]
    assert mic.comes_back(StatementLocation("program 0", 3))  # JUMP COUNT
    assert not mic.comes_back(StatementLocation("program 0", 6))  # JUMP MAIN
    assert mic.comes_back(StatementLocation("program 0", 0))


def stack(programs: Programs, now: int) -> list[tuple[str, int]]:
    return [(frame.name, programs.statements(frame.location.text)[frame.location.number].line) for frame in programs.stack(now)]


def test_the_stack_has_what_is_executed_and_where_it_returns_to() -> None:
    world = two()
    mic, chip = world.programs["m"], world.programs["c"]
    world.run_to(0)
    assert stack(mic, 0) == [("program", 1)]
    world.run_to(6 * MILLISECOND)
    assert stack(chip, world.now) == [("label 2", 11), ("label 1", 8)]
    world.run_to(11 * MILLISECOND)
    assert stack(chip, world.now) == [("label 1", 8)]  # W5 goes on
    assert stack(mic, world.now) == [("MAIN", 7)]
    world.controllers["m"].set_pin("IN1", 1.0, world.now)
    world.controllers["m"].set_pin("IN2", 1.0, world.now)
    while mic.depth() < 2:  # JUMP MAIN, JUMP COUNT
        world.run_to(world.now + MILLISECOND)
    assert stack(mic, world.now) == [("COUNT", 10), ("MAIN", 6)]  # JUMP MAIN is no call


def test_what_is_interrupted_is_on_the_stack_wherever_it_was() -> None:
    """Also behind a JUMP that never comes back."""
    program = b"CFGINT_IN1 = RIS\nJUMP MAIN\nWORK:\nWAIT IN5 = ON\nMAIN:\nJUMP WORK\nINT_IN1:\nDELAY 1\nRETURN\n"
    world = World.from_toml('[[mic488]]\nname = "m"\nprogram = "m.prg"\nstart = true\n', {"m.prg": program})
    world.run_to(100 * MILLISECOND)
    assert stack(world.programs["m"], world.now) == [("WORK", 4)]
    world.controllers["m"].set_pin("IN1", 1.0, world.now)
    world.run_to(300 * MILLISECOND)
    assert stack(world.programs["m"], world.now) == [("INT_IN1", 8), ("WORK", 4)]


def test_variables_are_read_and_set() -> None:
    world = two()
    mic, chip = world.programs["m"], world.programs["c"]
    world.run_to(100 * MILLISECOND)
    assert mic.variables(world.now) == {"n": 1.0}
    mic.set_variable("n", 7.5, world.now)
    chip.set_variable("variable", 1000, world.now)
    chip.set_variable("register3", 77, world.now)
    assert mic.variables(world.now) == {"n": 7.5}
    assert chip.variables(world.now)["register3"] == 77.0
    world.controllers["m"].set_pin("IN2", 1.0, world.now)
    world.run_to(200 * MILLISECOND)
    assert mic.variables(world.now)["n"] > 8.0
    with pytest.raises(Misuse, match="no variable 'x': there are n"):
        mic.set_variable("x", 1, world.now)
    with pytest.raises(Misuse, match=r"n = 1e\+39: permitted are -3.40282e\+38…3.40282e\+38"):
        mic.set_variable("n", 1e39, world.now)
    with pytest.raises(Misuse, match="register3 = 65536: permitted are whole numbers from 0 to 65535"):
        chip.set_variable("register3", 65536, world.now)
    for value in (0, 65535):
        chip.set_variable("register8", value, world.now)
        assert chip.variables(world.now)["register8"] == value
    for value in (-1, 0.5):
        with pytest.raises(Misuse, match=f"register3 = {value}: permitted are whole numbers from 0 to 65535"):
            chip.set_variable("register3", value, world.now)
    assert chip.variables(world.now)["register3"] == 77.0
    with pytest.raises(Misuse, match="no variable 'n': there are variable, register1"):
        chip.set_variable("n", 1, world.now)


def test_a_command_that_was_overwritten_comes_from_no_text() -> None:
    world = two()
    chip = world.programs["c"]
    assert chip.location(0) == StatementLocation("program", 0)
    assert chip.location(1) is None  # inside a command
    controller = world.m1486["c"].chip
    controller.memory.reset()
    assert chip.location(0) is None


def test_following_statements_does_not_change_what_happens() -> None:
    plain, followed = two(), two()
    subject = WorldSubject(followed)
    subscription = subject.subscribe(filter_of(["statement"]), 10_000)
    for world in (plain, followed):
        world.run_to(2 * SECOND)
    assert followed.trace.digest() == plain.trace.digest()
    _, events = subscription.take()
    assert {("c", "program: line 4"), ("m", "program 0: line 1")} <= {(event.controller, event.payload.text) for event in events}
    subscription.close()
    assert not followed.m1486["c"].chip.program._hooks
    assert not followed.mic488["m"].device.program.interpreter._hooks


def test_statements_are_not_among_what_is_usually_followed() -> None:
    world = two()
    subscription = WorldSubject(world).subscribe(filter_of(), 1000)
    world.run_to(SECOND)
    assert "statement" not in {event.kind for event in subscription.take().events}
    assert not world.mic488["m"].device.program.interpreter._hooks


def test_every_statement_of_a_loop_is_executed_where_that_is_asked_for() -> None:
    text = "n = 0\nMAIN:\nIF IN1 = 1\nn = n + 1\nENDIF\nJUMP MAIN\n"
    world = World.from_toml('[world]\nname = "w"\n[[mic488]]\nname = "m"\nprogram = "p"\nstart = true\n', {"p": text.encode()})
    world.run_to(SECOND)
    assert len(executed(world, 0.1)) == 0  # it rests
    world.programs["m"].execute_all(True, world.now)
    lines = [line for *_, line in executed(world, 0.006)]
    assert lines in ([3, 6] * 3, [6, 3] * 3)


# ---------------------------------------------------------------------- names


NAMED = "#go IN6\n#speed 60\nx = 2.5\n$D4 = 70000\nWAIT IN7 = ON\n"


def test_names_of_a_wbc_program_mean_what_they_mean_to_its_statements() -> None:
    """Constants, aliases, variables, registers and predefined names, without regard to case (reference WBC 2 to 4)."""
    text = '[[mic488]]\nname = "m"\nprogram = "p"\nstart = true\n'
    world = World.from_toml(text, {"p": NAMED.encode()})
    programs = world.programs["m"]
    assert programs.read("speed", 0) == 60.0
    world.run_to(100 * MILLISECOND)
    names = {name: programs.read(name, world.now) for name in ("X", "x", "Speed", "GO", "$D4", "OUT1", "RISFALL", "y", "@HOME")}
    assert names == {
        "X": 2.5, "x": 2.5, "Speed": 60.0, "GO": 0.0, "$D4": 70000.0, "OUT1": 0.0, "RISFALL": 3.0, "y": None, "@HOME": None,
    }  # fmt: skip
    world.controllers["m"].set_pin("IN6", 1.0, world.now)
    world.run_to(120 * MILLISECOND)
    assert programs.read("go", world.now) == 1.0  # after the 10 ms of its filter
    world.controllers["m"].set_pin("IN7", 1.0, world.now)
    world.run_to(200 * MILLISECOND)
    assert programs.stack(world.now) == ()  # the program has ended
    assert programs.read("speed", world.now) is None
    assert programs.location(0) is None


def test_names_of_an_m1486_are_its_pins_and_points() -> None:
    world = two()
    chip = world.programs["c"]
    world.run_to(100 * MILLISECOND)
    world.controllers["c"].set_pin("B3", 0.0, world.now)
    names = {name: chip.read(name, world.now) for name in ("b3", "B4", "Variable", "register1", "U20", "lamp")}
    variable = chip.variables(world.now)["variable"]
    assert names == {"b3": 0.0, "B4": 1.0, "Variable": variable, "register1": 0.0, "U20": float(ord("B")), "lamp": None}
    assert {name: chip.has_name(name) for name in names} == {name: name != "lamp" for name in names}


def test_what_a_statement_takes() -> None:
    """WBC-6 and M-19: 1 ms, half of it for a chip with 24 MHz."""
    text = '[[line]]\nname = "l"\nkind = "m1486"\n[[mic488]]\nname = "m"\n[[m1486]]\nname = "c"\nline = "l"\nvariant = "B2x"\n'
    programs = World.from_toml(text).programs
    assert {name: one.statement_time for name, one in programs.items()} == {"m": MILLISECOND, "c": MILLISECOND // 2}


def test_depth_and_returns_of_a_chip() -> None:
    """One level of subroutines (manual: '). Each command of its comes back."""
    world = two()
    chip = world.programs["c"]
    depths = set()
    for _ in range(12):
        world.run_to(world.now + MILLISECOND)
        depths.add((chip.depth(), len(chip.stack(world.now))))
    assert depths == {(0, 1), (1, 2)}
    assert all(chip.comes_back(StatementLocation("program", number)) for number in range(len(chip.statements("program"))))
    assert chip.texts["program"].name == "c.m1486"


@pytest.mark.parametrize("text", [None, "x3\n@1\nf640\nr\n"])
def test_a_chip_without_a_text_of_its_own(text: str | None) -> None:
    """The text of a host may be for other chips of the chain."""
    world = World.from_toml('[[line]]\nname = "l"\nkind = "m1486"\n[[m1486]]\nname = "c"\nline = "l"\naddress = 7\n')
    if text is not None:
        world.downloaded["c", "program"] = SourceText("typed", text)
    chip = world.programs["c"]
    assert [source.text for source in chip.texts.values()] == ([] if text is None else [text])
    assert (list(chip.statements("program")), chip.labels("program"), chip.after("program")) == ([], {}, {})
    assert (list(chip.reached("program", [0])), chip.stack(0), chip.depth()) == ([], [], 0)


@pytest.mark.parametrize("controller", ["m", "c"])
def test_a_hook_at_places_is_called_there_as_one_at_all_statements(controller: str) -> None:
    found: dict[bool, list[tuple[int, StatementLocation | None]]] = {True: [], False: []}
    for at_all, mine in found.items():
        world = two()
        programs = world.programs[controller]
        (text,) = programs.texts
        location = StatementLocation(text, list(programs.labels(text).values())[-1])
        wanted = {StatementLocation(text, number) for number in range(3)} | {location}

        def note(
            now: int, number: int, mine: list[tuple[int, StatementLocation | None]] = mine, programs: Programs = programs
        ) -> None:
            mine.append((now, programs.location(number)))

        programs.add_hook(note, None if at_all else wanted)
        world.run_to(SECOND)
        count = len(mine)
        programs.remove_hook(note)
        world.run_to(2 * SECOND)
        assert len(mine) == count
        if at_all:
            mine[:] = [one for one in mine if one[1] in wanted]
    assert len(found[True]) >= 3
    assert found[True] == found[False]
