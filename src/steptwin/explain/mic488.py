"""Explanation of a WBC program, the program of a MIC488."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from steptwin.controlflow import ControlFlow
from steptwin.controller import MILLISECOND, Nanos
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse
from steptwin.explain import mic488_interrupts as interrupts
from steptwin.explain import mic488_waits as waits
from steptwin.explain.blocks import Timing, blocks_of
from steptwin.explain.durations import Durations
from steptwin.explain.model import EndlessLoop, ExplainedStatement, Explanation, MemorySection, MemoryUse, Usage
from steptwin.mic488.config import ControllerConfig
from steptwin.wbc import steps as s
from steptwin.wbc.check import CheckedProgram
from steptwin.wbc.dialect import DEFAULT, Dialect
from steptwin.wbc.events import HARD_PREFIX, PREFIX
from steptwin.wbc.flow import flow_of, reached
from steptwin.wbc.positions import PositionTable

STATEMENT_BYTES = 16
POSITION_BYTES = 18
"""Size of a statement and of a position in a compiled image."""
_INPUTS = frozenset({"IN", "INPUTS", "AIN"})
_OUTPUTS = frozenset({"OUT", "OUTPUTS"})
_USER = frozenset({"$I", "$D", "$R"})


def explain(
    source: SourceText,
    checked: CheckedProgram,
    config: ControllerConfig | None = None,
    dialect: Dialect = DEFAULT,
    statement_time: Nanos = MILLISECOND,
) -> Explanation:
    """Explain a program that was checked. Raises `Misuse` for one that cannot be executed."""
    executable = checked.executable
    if executable is None:
        raise Misuse(f"{source.name} has errors, or positions without a table: steptwin check shows them")
    flow = flow_of(executable.steps)
    there = reached(flow, executable)
    statements = _statements(source, executable.steps)
    names = _names(executable)
    entries = [*((0,) if executable.steps else ()), *executable.entries.values()]

    def when(number: int, target: int) -> str:
        step = executable.steps[number]
        if not isinstance(step, s.IfStep | s.WhileStep) or len(flow.after[number]) < 2:
            return ""
        return condition_text(source, step) if target == number + 1 else "else"

    rough = blocks_of(flow, there, names, entries, when, [Timing(statement_time)] * len(statements))
    durations = Durations(executable, flow, config, checked.positions, statement_time)
    blocks = blocks_of(flow, there, names, entries, when, durations.timings(flow, rough))
    usage = _usage(executable.steps, statements, there)
    shown = f"MIC488 firmware {dialect.firmware}"
    notes = [] if config is not None else ["without a configuration (.cfg) the times of moves are not known"]
    return Explanation(
        source=source,
        language="wbc",
        title=shown,
        statement_time=statement_time,
        statements=statements,
        blocks=blocks,
        memory=memory_of(executable, checked.positions, dialect),
        sections=_sections(names, statements),
        section_unit="bytes",
        usage={**usage, "positions": _positions(executable, checked.positions, statements, there)},
        waits=waits.long_waits(source, executable, flow, there),
        loops=_loops(executable, flow, there),
        lost=interrupts.lost(source, executable, flow, there, statement_time),
        unreachable=[n for n in range(len(statements)) if n not in there and not isinstance(executable.steps[n], s.BLOCK_MARKS)],
        notes=notes,
        interrupts_at="at any statement",
    )


def condition_text(source: SourceText, step: s.IfStep | s.WhileStep | s.WaitStep) -> str:
    """As written."""
    return text_of(source, step).split(" ", 1)[-1]


def text_of(source: SourceText, step: s.ProgramStep) -> str:
    return " ".join(source.text[step.start : step.end].split())


def _statements(source: SourceText, steps: Sequence[s.ProgramStep]) -> list[ExplainedStatement]:
    return [ExplainedStatement(source.position(step.start)[0], text_of(source, step)) for step in steps]


def _names(executable: s.Executable) -> dict[int, list[str]]:
    """Labels by the step after them. An interrupt label is a step of its own."""
    found: dict[int, list[str]] = {}
    for name, number in executable.labels.items():
        if number < len(executable.steps):
            found.setdefault(number, []).append(name)
    for event, number in executable.entries.items():
        step = executable.steps[number]
        hard = isinstance(step, s.InterruptStep) and step.hard
        names = found.setdefault(number, [])
        name = (HARD_PREFIX if hard else PREFIX) + event.name
        if name not in names:
            names.append(name)
    return found


# ---------------------------------------------------------------------- memory


def memory_of(executable: s.Executable, positions: PositionTable | None, dialect: Dialect) -> list[MemoryUse]:
    """Use of the memories of a controller by a program."""
    bank, image = position_memory(0 if positions is None else len(positions.rows), dialect)
    registers = {word for step in executable.steps for source in _operands(step) for word in _words(source)}
    return [
        MemoryUse("program bank", len(executable.steps), dialect.max_steps, "statements"),
        bank,
        MemoryUse("variables", len(executable.variables), dialect.max_variables, "variables"),
        MemoryUse("user registers used", len(registers), dialect.user_registers, "registers"),
        MemoryUse("statements in an image", STATEMENT_BYTES * len(executable.steps), None, "bytes"),
        image,
    ]


def position_memory(rows: int, dialect: Dialect) -> tuple[MemoryUse, MemoryUse]:
    """Use of memory by a table of positions: of its bank, and in an image."""
    bank = MemoryUse("position bank", rows, dialect.max_positions, "positions")
    return bank, MemoryUse("positions in an image", POSITION_BYTES * rows, None, "bytes")


def _words(source: s.ValueSource) -> Iterable[int]:
    if isinstance(source, s.RegisterOperand) and source.row.key in _USER:
        return range(source.number, source.number + source.row.words)
    return ()


def _sections(names: Mapping[int, Sequence[str]], statements: Sequence[ExplainedStatement]) -> list[MemorySection]:
    begins = sorted({0, *names, len(statements)})
    found: list[MemorySection] = []
    for begin, end in pairwise(begins):
        name = ", ".join(names.get(begin, ("program",)))
        found.append(MemorySection(name, statements[begin].line, end - begin, STATEMENT_BYTES * (end - begin)))
    return found


# ---------------------------------------------------------------------- what it uses


def _operands(step: s.ProgramStep) -> list[s.ValueSource]:
    return [*step.sources(), *([step.target] if isinstance(step, s.SetStep) else [])]


def _usage(steps: Sequence[s.ProgramStep], statements: Sequence[ExplainedStatement], there: set[int]) -> dict[str, list[Usage]]:
    read: dict[str, dict[s.RegisterOperand, set[int]]] = {"inputs": {}, "outputs": {}, "user registers": {}, "registers": {}}
    written: dict[str, dict[s.RegisterOperand, set[int]]] = {group: {} for group in read}
    drives: dict[int, set[int]] = {}
    pulses: dict[str, set[int]] = {}
    for number, step in enumerate(steps):
        if number not in there:
            continue
        line = statements[number].line
        for source in step.sources():
            if isinstance(source, s.RegisterOperand):
                read[_group(source)].setdefault(source, set()).add(line)
        if isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand):
            written[_group(step.target)].setdefault(step.target, set()).add(line)
        output, drive = step.effect()[:2]
        if output is not None:
            pulses.setdefault(f"OUT{output}", set()).add(line)
        if drive is not None:
            drives.setdefault(drive, set()).add(line)
    found: dict[str, list[Usage]] = {}
    for group, lines_read in read.items():
        registers = sorted({*lines_read, *written[group]}, key=lambda register: (register.row.key, register.number))
        found[group] = [_used(register.name, lines_read.get(register), written[group].get(register)) for register in registers]
    known = {usage.name: usage for usage in found["outputs"]}
    for name, lines in pulses.items():
        before = known.get(name, Usage(name, (), ()))
        known[name] = before._replace(written=tuple(sorted({*before.written, *lines})))
    found["outputs"] = [known[name] for name in sorted(known)]
    found["drives moved"] = [Usage(f"M{axis}", tuple(sorted(drives[axis])), ()) for axis in sorted(drives)]
    return found


def _used(name: str, read: set[int] | None, written: set[int] | None) -> Usage:
    return Usage(name, tuple(sorted(read or ())), tuple(sorted(written or ())))


def _group(register: s.RegisterOperand) -> str:
    key = register.row.key
    if key in _INPUTS:
        return "inputs"
    if key in _OUTPUTS:
        return "outputs"
    return "user registers" if key in _USER else "registers"


def _positions(
    executable: s.Executable, positions: PositionTable | None, statements: Sequence[ExplainedStatement], there: set[int]
) -> list[Usage]:
    """Rows by index; a row whose index is computed can be any."""
    used: dict[str, list[int]] = {}
    rows = () if positions is None else positions.rows
    for number, step in enumerate(executable.steps):
        if isinstance(step, s.RowMotionStep) and number in there:
            name = "any row"
            if isinstance(step.row, s.Literal):
                index = int(step.row.value)
                name = f"{index} @{rows[index].name}" if index < len(rows) and rows[index].name else str(index)
            used.setdefault(name, []).append(statements[number].line)
    return [Usage(name, tuple(lines), ()) for name, lines in used.items()]


# ---------------------------------------------------------------------- loops


def _loops(executable: s.Executable, flow: ControlFlow, there: set[int]) -> list[EndlessLoop]:
    starts = [0, *executable.entries.values()]
    found: list[EndlessLoop] = []
    for loop in flow.without_way_out(starts):
        read = {source.name for n in loop for source in executable.steps[n].sources() if isinstance(source, s.RegisterOperand)}
        motion = ["motion"] if any(isinstance(executable.steps[n], s.WaitPosStep) for n in loop) else []
        leaving = interrupts.leaving(executable, flow, set(loop))
        found.append(EndlessLoop(tuple(loop), (*sorted(read), *motion), tuple(leaving)))
    return found
