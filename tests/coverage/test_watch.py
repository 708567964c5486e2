"""Programs of both languages, whose statements and branches were counted by hand."""

from __future__ import annotations

from steptwin.controller import MILLISECOND, SECOND
from steptwin.coverage.counts import Coverage, Summary, TextCoverage
from steptwin.coverage.watch import WorldCoverage
from steptwin.diagnostics import SourceText
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.simulation.script import steps as do
from steptwin.simulation.world.inputs import Download

WBC = """\
n = 0
WHILE n < 3
    n = n + 1
    IF n = 2
        JUMP SUB
    ELSE
        OUT1 = ON
    ENDIF
ENDWHILE
IF IN1 = 1
    OUT2 = ON
ENDIF
END
SUB:
    OUT3 = ON
    RETURN
"""
CHIP = """\
[
:5
L2
+1
E
I1H2        ; an open line is high
W5
@2
'3
I1L4
J9
@4
W1
@9
W100000
J9
@3
+2
.
]
"""


def mic488(name: str) -> str:
    return f'[[mic488]]\nname = "{name}"\nprogram = "m.prg"\nstart = true\n'


def wbc_world(program: str, tables: str = mic488("m")) -> World:
    return World.from_toml(f'[world]\nname = "test"\n{tables}', {"m.prg": program.encode()})


def chip_world(program: str | None, addresses: tuple[int, ...] = (0,)) -> World:
    given = "" if program is None else 'program = "c.m1486"\n'
    chips = "".join(f'[[m1486]]\nname = "c{at}"\nline = "chips"\naddress = {at}\n{given}' for at in addresses)
    text = f'[world]\nname = "test"\n[[line]]\nname = "chips"\nkind = "m1486"\n{chips}'
    return World.from_toml(text, {"c.m1486": (program or "").encode()})


def covered(there: World, seconds: float = 1.0) -> Coverage:
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.run_to(there.now + round(seconds * SECOND))
    watch.close()
    return coverage


def only(coverage: Coverage) -> TextCoverage:
    (text,) = coverage
    return text


def by_line(text: TextCoverage) -> dict[int, int]:
    return {line: text.hits[start] for line, start in text.lines.items()}


def ways(text: TextCoverage) -> dict[tuple[int | None, int | None], int]:
    return {(text.line_of(way.origin), text.line_of(way.target)): text.taken[way] for way in text.ways}


def test_statements_and_branches_of_a_wbc_program() -> None:
    text = only(covered(wbc_world(WBC)))
    assert by_line(text) == {1: 1, 2: 4, 3: 3, 4: 3, 5: 1, 7: 2, 10: 1, 11: 0, 13: 1, 15: 1, 16: 1}
    assert ways(text) == {(2, 3): 3, (2, 10): 1, (4, 5): 1, (4, 7): 2, (10, 11): 0, (10, 13): 1}
    assert text.summary == Summary(statements=11, missed=1, branches=6, missed_branches=1)


def test_statements_and_branches_of_an_m1486_program() -> None:
    """The first command is executed at power-on, before anything can be observed."""
    text = only(covered(chip_world(CHIP)))
    assert by_line(text) == {2: 1, 3: 1, 4: 2, 5: 2, 6: 1, 7: 0, 9: 1, 10: 1, 11: 1, 13: 0, 15: 1, 16: 0, 18: 1, 19: 1}
    assert ways(text) == {(5, 4): 1, (5, 6): 1, (6, 9): 1, (6, 7): 0, (10, 13): 0, (10, 11): 1}


def test_a_first_command_that_branches_counts_with_its_way() -> None:
    text = only(covered(chip_world("[\nI1H1\n+1\n@1\n+2\n]\n")))
    assert ways(text) == {(2, 5): 1, (2, 3): 0}


def test_a_loop_at_the_end_of_an_m1486_program_comes_to_the_end() -> None:
    text = only(covered(chip_world("[\n:0\nL3\n+1\nE\n]\n")))
    assert ways(text) == {(5, 4): 2, (5, None): 1}


def test_a_loop_that_is_done_once_is_no_branch() -> None:
    text = only(covered(chip_world("[\n:0\nL1\n+1\nE\n]\n")))
    assert ways(text) == {}


def test_a_computed_jump_is_a_branch_to_what_its_variable_can_name() -> None:
    """Line group 12 is lines 1 and 2: 0 to 3. Open lines are high, so it is 3, and the jump goes to label 4."""
    text = only(covered(chip_world("[\n?12\n+1\nJ\n@1\nW1\n@2\nW2\n@3\nW3\n@4\nW4\n]\n")))
    assert ways(text) == {(4, 6): 0, (4, 8): 0, (4, 10): 0, (4, 12): 1}


def test_conditions_without_variables_are_no_branches() -> None:
    assert ways(only(covered(wbc_world("WHILE 1 = 1\nDELAY 0.1\nENDWHILE\n")))) == {}


def test_an_interrupt_between_a_branch_and_what_comes_next() -> None:
    """Statements are executed at 1 ms, 2 ms, … : WHILE at 3 ms, 6 ms, … An input is seen after 10 ms, here at 15.5 ms."""
    there = wbc_world("CFGINT_IN3 = RIS\nn = 0\nWHILE n < 20\nn = n + 1\nENDWHILE\nEND\nINT_IN3:\nOUT2 = ON\nRETURN\n")
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.run_to(5 * MILLISECOND + MILLISECOND // 2)
    there.apply_input(do.Set((("m", "IN3", 1.0),)))
    there.run_to(15 * MILLISECOND + MILLISECOND // 2)
    assert (there.programs["m"].variables(there.now)["n"], there.programs["m"].depth()) == (4, 1)
    there.run_to(SECOND)
    watch.close()
    text = only(coverage)
    assert by_line(text) == {1: 1, 2: 1, 3: 21, 4: 20, 6: 1, 7: 1, 8: 1, 9: 1}
    assert ways(text) == {(3, 4): 20, (3, 6): 1}


def test_a_branch_whose_next_statement_is_not_executed_any_more_has_gone_its_way() -> None:
    there = wbc_world("n = 1\nIF n = 1\nOUT1 = ON\nENDIF\nDELAY 9\n")
    text = only(covered(there, 0.0025))
    assert by_line(text) == {1: 1, 2: 1, 3: 0, 5: 0}
    assert ways(text) == {(2, 3): 1, (2, 5): 0}


def test_controllers_with_the_same_file_add_up() -> None:
    two = wbc_world(WBC, mic488("a") + mic488("b"))
    two.apply_input(do.Set((("b", "IN1", 1.0),)))
    text = only(covered(two))
    assert by_line(text) == {1: 2, 2: 8, 3: 6, 4: 6, 5: 2, 7: 4, 10: 2, 11: 1, 13: 2, 15: 2, 16: 2}
    assert ways(text)[10, 11] == ways(text)[10, 13] == 1


def test_worlds_add_up() -> None:
    coverage = Coverage()
    for _ in range(3):
        watch = WorldCoverage(there := wbc_world(WBC), coverage)
        there.run_to(SECOND)
        watch.close()
    assert by_line(only(coverage))[3] == 9


def test_a_program_that_is_downloaded_counts_by_its_text() -> None:
    there = wbc_world(WBC)
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.run_to(SECOND)
    there.apply_input(Download("m", "program 0", "OUT4 = ON\nEND\n"))
    there.run_to(2 * SECOND)
    watch.close()
    first, second = sorted(coverage, key=lambda text: -len(text.source.text))
    assert first.source.text == WBC
    assert by_line(first)[3] == 3
    assert by_line(second) == {1: 0, 2: 0}  # it was not started


def test_a_program_that_never_ran_counts_as_missed() -> None:
    text = only(covered(wbc_world(WBC, '[[mic488]]\nname = "m"\nprogram = "m.prg"\n')))
    assert text.summary == Summary(11, 11, 6, 6)


def test_a_world_that_goes_back_counts_what_it_executes_besides_what_it_had_executed() -> None:
    """WHILE is executed at 1 ms and 4 ms. What is executed at 2 ms for the second time does not come after that at 4 ms."""
    there = wbc_world("WHILE IN1 = 0\nOUT1 = ON\nENDWHILE\n")
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.run_to(MILLISECOND + MILLISECOND // 2)
    state = there.snapshot()
    there.run_to(4 * MILLISECOND)
    there.restore(state)
    there.run_to(2 * MILLISECOND)
    watch.close()
    text = only(coverage)
    assert by_line(text) == {1: 2, 2: 2}
    assert ways(text) == {(1, 2): 1, (1, None): 0}


def test_what_is_replayed_to_continue_a_session_does_not_count() -> None:
    there = wbc_world("n = 1\nDELAY 0.5\nOUT1 = ON\nEND\n")
    there.run_to(SECOND // 10)
    text = only(covered(recording_of(there).replay()))
    assert by_line(text) == {1: 0, 2: 0, 3: 1, 4: 1}


def test_a_branched_world_is_not_observed() -> None:
    there = wbc_world(WBC)
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.branch().run_to(SECOND)
    watch.close()
    assert only(coverage).summary.missed == 11


def test_chips_of_a_chain_execute_their_own_commands_of_one_text() -> None:
    """A host has typed all but the last two lines."""
    typed = "X0\n+1\n+2\nX7\n+3\n"
    source = SourceText("chain.m1486", f"{typed}X0\n+4\n")
    there = chip_world(None, (0, 7))
    there.downloaded |= {("c0", "program"): source, ("c7", "program"): source}
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    there.apply_input(do.Send("chips", typed.replace("\n", "\r").encode()))
    there.run_to(SECOND)
    watch.close()
    assert by_line(only(coverage)) == {2: 1, 3: 1, 5: 1, 7: 0}


def test_a_reset_in_a_typed_text_empties_the_memory() -> None:
    typed = "X0\n+1\n+2\n\\\n+3\nX0\n"
    there = chip_world(None)
    there.downloaded["c0", "program"] = SourceText("typed.m1486", typed)
    coverage = Coverage()
    watch = WorldCoverage(there, coverage)
    for line in typed.splitlines():
        there.apply_input(do.Send("chips", f"{line}\r".encode()))
        there.run_to(there.now + SECOND)
    watch.close()
    assert by_line(only(coverage)) == {2: 1, 3: 1, 5: 1}


def test_observing_does_not_change_the_run() -> None:
    plain, observed = wbc_world(WBC), wbc_world(WBC)
    plain.run_to(SECOND)
    covered(observed)
    assert plain.trace.digest() == observed.trace.digest()


def test_after_the_end_nothing_is_counted() -> None:
    there = wbc_world("n = 0\nWHILE n < 1000\nn = n + 1\nENDWHILE\n")
    text = only(covered(there, 0.1))
    before = dict(text.hits)
    there.run_to(2 * SECOND)
    assert dict(text.hits) == before
