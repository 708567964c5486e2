"""An explanation as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from steptwin.columns import aligned
from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.explain.model import Explanation, FlowBlock, FlowWay, Usage


def text(explained: Explanation) -> str:
    return "\n".join(_parts(explained)) + "\n"


def _parts(explained: Explanation) -> Iterator[str]:
    yield f"{explained.source.name}: {explained.title}"
    yield f"{_count(len(explained.statements), 'statement')}, {duration_text(explained.statement_time)} each unless they wait"
    yield from explained.notes
    yield from _titled("Flow", _table(["lines", "begins with", "goes on"], _flow_rows(explained)))
    yield from _titled("Durations", _table(["lines", "time", "then waits for"], _piece_rows(explained)))
    memory = [f"  {part.what}: {_memory_text(part.used, part.most, part.unit)}" for part in explained.memory]
    rows = [(str(one.line), one.name, str(one.statements), str(one.size)) for one in explained.sections]
    yield from _titled("Memory", [*memory, *_table(["line", "from", "statements", explained.section_unit], rows)])
    for group, usages in explained.usage.items():
        yield from _titled(group.capitalize(), _usage_table(usages))
    waits = [
        _sentence(one.line, one.text, one.reason, f"; way out: {one.way_out}" if one.way_out else "") for one in explained.waits
    ]
    yield from _titled("Can wait for ever", waits)
    yield from _titled("Never left", [_loop_text(explained, one.statements, one.reads, one.left_by) for one in explained.loops])
    lost = [f"  line {one.line}: {one.name}: {one.reason}" for one in explained.lost]
    yield from _titled("Interrupts that can be lost", lost)
    unreachable = [f"  line {explained.statements[n].line}: {explained.statements[n].text}" for n in explained.unreachable]
    yield from _titled("Never reached", unreachable)


def _usage_table(usages: Sequence[Usage]) -> list[str]:
    if not any(usage.written for usage in usages):
        return _table(["", "in lines"], [(usage.name, _numbers(usage.read)) for usage in usages])
    rows = [(usage.name, _numbers(usage.read), _numbers(usage.written)) for usage in usages]
    return _table(["", "read in lines", "written in lines"], rows)


def _titled(title: str, lines: Sequence[str]) -> Iterator[str]:
    if lines:
        yield ""
        yield title
        yield from lines


def _sentence(line: int, what: str, reason: str, end: str) -> str:
    return f"  line {line}: {what}: {reason}{end}"


def _loop_text(explained: Explanation, statements: Sequence[int], reads: Sequence[str], left_by: Sequence[str]) -> str:
    what = f"reads {', '.join(reads)}" if reads else "reads nothing: no input changes what it does"
    end = f"; an interrupt can lead elsewhere: {', '.join(left_by)}" if left_by else ""
    return f"  lines {ranges_text(explained.lines(statements))}: {what}{end}"


def _flow_rows(explained: Explanation) -> Iterator[tuple[str, str, str]]:
    for block in explained.blocks:
        begin = ", ".join(block.names) or explained.statements[block.first].text
        yield (
            lines_text(explained, block.first, block.last),
            begin,
            ", ".join(_way(explained, way) for way in block.ways) or "ends here",
        )


def _way(explained: Explanation, way: FlowWay) -> str:
    target = "the end" if way.target is None else str(_line(explained, explained.blocks[way.target]))
    if way.is_call:
        return f"calls {target}"
    if way.is_back:
        return f"then {target}"
    return f"{way.when}: {target}" if way.when else target


def _line(explained: Explanation, block: FlowBlock) -> int:
    return explained.statements[block.first].line


def _piece_rows(explained: Explanation) -> Iterator[tuple[str, str, str]]:
    for block in explained.blocks:
        for piece in block.pieces:
            if piece.duration or piece.wait:
                yield lines_text(explained, piece.first, piece.last), duration_text(piece.duration), piece.wait


def lines_text(explained: Explanation, first: int, last: int) -> str:
    begin, end = explained.statements[first].line, explained.statements[last].line
    return str(begin) if begin == end else f"{begin}–{end}"


def duration_text(duration: Nanos) -> str:
    return f"{duration / MILLISECOND:.6g} ms" if duration < SECOND else f"{duration / SECOND:.6g} s"


def _memory_text(used: int, most: int | None, unit: str) -> str:
    return f"{used} {unit}" if most is None else f"{used} of {most} {unit}, {most - used} left"


def ranges_text(lines: Iterable[int]) -> str:
    """Numbers in order, those that follow each other as a range: ``3–7, 9``."""
    runs: list[tuple[int, int]] = []
    for line in lines:
        if runs and runs[-1][1] == line - 1:
            runs[-1] = runs[-1][0], line
        else:
            runs.append((line, line))
    return ", ".join(str(first) if first == last else f"{first}–{last}" for first, last in runs)


def _numbers(lines: Iterable[int]) -> str:
    return ", ".join(map(str, lines))


def _table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    shown = list(rows)
    if not shown:
        return []
    return [f"  {line}" for line in aligned([heading, *shown])]


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
