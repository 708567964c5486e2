"""An explanation as plain values, for JSON. Blocks are numbered from 0; lines from 1, durations in nanoseconds."""

from __future__ import annotations

from typing import Any

from steptwin.explain.model import Explanation, FlowBlock, StraightPiece


def to_json(explained: Explanation) -> dict[str, Any]:
    return {
        "language": explained.language,
        "title": explained.title,
        "statement_time_ns": explained.statement_time,
        "statements": [one._asdict() for one in explained.statements],
        "blocks": [_block(explained, block) for block in explained.blocks],
        "memory": [part._asdict() for part in explained.memory],
        "sections": [
            {"name": o.name, "line": o.line, "statements": o.statements, explained.section_unit: o.size}
            for o in explained.sections
        ],
        "usage": {group: [usage._asdict() for usage in usages] for group, usages in explained.usage.items()},
        "can_wait_for_ever": [wait._asdict() for wait in explained.waits],
        "never_left": [
            {"lines": explained.lines(loop.statements), "reads": loop.reads, "left_by": loop.left_by} for loop in explained.loops
        ],
        "interrupts_lost": [one._asdict() for one in explained.lost],
        "unreachable_lines": explained.lines(explained.unreachable),
        "notes": list(explained.notes),
    }


def _block(explained: Explanation, block: FlowBlock) -> dict[str, Any]:
    first, last = (explained.statements[number].line for number in (block.first, block.last))
    return {
        "names": block.names,
        "first_line": first,
        "last_line": last,
        "is_entry": block.is_entry,
        "ways": [way._asdict() for way in block.ways],
        "pieces": [_piece(explained, piece) for piece in block.pieces],
    }


def _piece(explained: Explanation, piece: StraightPiece) -> dict[str, Any]:
    first, last = (explained.statements[number].line for number in (piece.first, piece.last))
    return {"first_line": first, "last_line": last, "duration_ns": piece.duration, "then_waits_for": piece.wait}
