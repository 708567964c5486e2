"""``steptwin campaign faults``: the fault matrix of a campaign's world."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from steptwin.campaign.effects import FaultEffect
from steptwin.campaign.faultmatrix import FaultMatrix, fault_matrix
from steptwin.campaign.reading import MOST_PHASES, load_campaign
from steptwin.campaign.report.matrixpage import write_matrix
from steptwin.errors import Misuse
from steptwin.system import reason

Print = Callable[[str], object]
MOST_LINES = 20
"""Unsafe cells that are printed."""


def faults(file: Path, out: Path | None, write: Print, *, jobs: int | None, phases: int | None, as_json: bool) -> bool:
    """Make the matrix. Returns whether nothing was unsafe. Raises `Misuse`."""
    description = load_campaign(file)
    if phases is not None:
        if not 1 <= phases <= MOST_PHASES:
            raise Misuse(f"--phases {phases}: permitted are 1 to {MOST_PHASES}")
        description = replace(description, matrix=replace(description.matrix, phases=phases))
    folder = out or file.with_suffix(".faults")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Misuse(f"--out {folder}: {reason(error)}") from None
    began = time.monotonic()
    matrix = fault_matrix(description, folder, jobs=jobs, progress=_progress)
    written = write_matrix(matrix, folder)
    if as_json:
        write(json.dumps(matrix.plain(), ensure_ascii=False, indent=2))
    else:
        _print(matrix, write)
        write(f"{time.monotonic() - began:.1f} s; {', '.join(str(path) for path in written)}")
    return not matrix.counts[FaultEffect.UNSAFE]


def _progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        end = "\n" if done == total else ""
        sys.stderr.write(f"\r{done} of {total} faults{end}")
        sys.stderr.flush()


def _print(matrix: FaultMatrix, write: Print) -> None:
    counts = ", ".join(f"{effect} {count}" for effect, count in matrix.counts.items())
    write(f"{matrix.name}: {len(matrix.rows)} faults at {len(matrix.phases)} phases: {counts}")
    unsafe = [(row, cell) for row in matrix.rows for cell in row.cells if cell.judgement.effect is FaultEffect.UNSAFE]
    for row, cell in unsafe[:MOST_LINES]:
        write(f"unsafe: {row.function}, {row.possible.mode}, phase {matrix.phases[cell.phase].number}: {cell.judgement.why}")
    if len(unsafe) > MOST_LINES:
        write(f"... and {len(unsafe) - MOST_LINES} more unsafe ones")
