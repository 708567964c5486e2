"""A fault matrix as one HTML file: faults by phases, then every cell in which something happened."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path

from steptwin.campaign.effects import FaultEffect
from steptwin.campaign.faultmatrix import NOMINAL, FaultMatrix, MatrixCell
from steptwin.campaign.report.html import link, page, table
from steptwin.controller import SECOND
from steptwin.coverage.table import percent_text
from steptwin.files.textfiles import write_bytes
from steptwin.simulation.faults.active import FaultActs

QUIET = (FaultEffect.NEVER_ACTED, FaultEffect.UNAFFECTED)
"""Effects that need no line of their own."""

_STYLE = """
.matrix td.e { padding: 0; } .matrix td.e a { display: block; padding: .2rem .5rem; text-decoration: none; color: inherit; }
.never-acted, .unaffected { color: var(--weak); } .safe-stop { background: color-mix(in srgb, var(--good) 22%, transparent); }
.hangs { background: color-mix(in srgb, var(--note) 22%, transparent); }
.wrong-part { background: color-mix(in srgb, var(--doubt) 28%, transparent); }
.unsafe { background: color-mix(in srgb, var(--bad) 35%, transparent); font-weight: 600; }
span.e { padding: .1rem .5rem; margin-right: .7rem; }
"""
_MEANINGS = {
    FaultEffect.NEVER_ACTED: "it made no difference to anything, so that this says nothing of the machine",
    FaultEffect.UNAFFECTED: "it acted, so often, and the same parts were made",
    FaultEffect.SAFE_STOP: "it stands, and an alarm or a script noticed",
    FaultEffect.HANGS: "it did not go on, and nothing noticed, or it still moves",
    FaultEffect.WRONG_PART: "it went on to its end with another result",
    FaultEffect.UNSAFE: "a property failed",
}


def write_matrix(matrix: FaultMatrix, folder: Path) -> list[Path]:
    """Write ``faults.html``, ``faults.csv`` and ``faults.json``."""
    texts = {
        "faults.html": matrix_page(matrix),
        "faults.csv": matrix.csv(),
        "faults.json": json.dumps(matrix.to_json(), ensure_ascii=False, indent=1) + "\n",
    }
    for name, text in texts.items():
        write_bytes(folder / name, text.encode())
    return [folder / name for name in texts]


def matrix_page(matrix: FaultMatrix) -> str:
    title = f"{matrix.name}: faults by phase"
    if matrix.wrong:
        return page(title, _without_a_fault(matrix), _STYLE)
    counts = matrix.counts
    legend = table(
        ("effect", "cells", "meaning"),
        [(_mark(effect), str(counts[effect]), escape(_MEANINGS[effect])) for effect in FaultEffect],
        (1,),
    )
    ended = f", ended by {matrix.nominal.ended!r}" if matrix.nominal.ended else ""
    covered = matrix.coverage.summary
    body = (
        f"<p>{len(matrix.rows)} faults at {len(matrix.phases)} phases. The run without a fault takes "
        f"{matrix.nominal.result.end_ns / SECOND:.9g} s{escape(ended)}. {percent_text(covered)} % of the statements and "
        f"branches of the programs were executed.</p>\n{legend}<h2>Phases</h2>\n{_phases(matrix)}"
        f"<h2>Matrix</h2>\n<p>Each cell is a recording: <code>steptwin replay cells/…</code>, "
        f"<code>steptwin studio --view cells/…</code>.</p>\n{_matrix(matrix)}"
        f"<h2>Effects</h2>\n{_effects(matrix)}"
    )
    if matrix.left_out:
        left = ", ".join(f"<code>{escape(one.text)}</code>" for one in matrix.left_out)
        body += f"<h2>Not tried</h2>\n<p>In the run without a fault it never comes to: {left}</p>\n"
    return page(title, body, _STYLE)


def _without_a_fault(matrix: FaultMatrix) -> str:
    return (
        f'<p class="bad">The run without a fault does not hold: {escape(matrix.wrong)}</p>\n<p>No fault was tried: what is wrong '
        f"without any is wrong in every cell. Mend it first. {link(NOMINAL, 'Recording of the run')}.</p>\n"
    )


def _mark(effect: FaultEffect) -> str:
    return f'<span class="e {effect.replace(" ", "-")}">{effect}</span>'


def _phases(matrix: FaultMatrix) -> str:
    rows = [
        (
            str(phase.number),
            escape(phase.name),
            f"{phase.begin / SECOND:.6g}",
            f"{phase.end / SECOND:.6g}",
            f"{phase.middle / SECOND:.6g}",
        )
        for phase in matrix.phases
    ]
    return table(("phase", "begins with", "from s", "to s", "fault at s"), rows, (2, 3, 4))


def _matrix(matrix: FaultMatrix) -> str:
    head = "".join(f'<th title="{escape(phase.name, quote=True)}">{phase.number}</th>' for phase in matrix.phases)
    rows = "".join(
        f"<tr><td>{escape(row.function)}</td><td>{escape(row.possible.part)}</td><td>{escape(row.possible.mode)}</td>"
        f"{''.join(_cell(cell) for cell in row.cells)}</tr>\n"
        for row in matrix.rows
    )
    return (
        '<div class="wide"><table class="matrix">\n'
        f"<tr><th>function</th><th>part</th><th>failure mode</th>{head}</tr>\n{rows}</table></div>\n"
    )


def _cell(cell: MatrixCell) -> str:
    judged = cell.judgement
    title = escape(". ".join(filter(None, (cell.fault, _acted(cell.acts), judged.why))), quote=True)
    quiet = "–" if cell.acts is None else f"{cell.acts.count}×"
    text = escape(quiet if judged.effect in QUIET else judged.effect)
    inner = f'<a href="{escape(cell.session, quote=True)}">{text}</a>' if cell.session else text
    return f'<td class="e {judged.effect.replace(" ", "-")}" title="{title}">{inner}</td>'


def _acted(acts: FaultActs | None) -> str:
    if acts is None:
        return FaultEffect.NEVER_ACTED
    return (
        f"acted {acts.count} times, first at {acts.first / SECOND:.9g} s"
        if acts.count > 1
        else f"acted at {acts.first / SECOND:.9g} s"
    )


def _effects(matrix: FaultMatrix) -> str:
    worst = {effect: n for n, effect in enumerate(reversed(FaultEffect))}
    found = [
        (worst[cell.judgement.effect], row, cell)
        for row in matrix.rows
        for cell in row.cells
        if cell.judgement.effect not in QUIET
    ]
    rows = [
        (
            _mark(cell.judgement.effect),
            escape(row.function),
            escape(row.possible.mode),
            str(matrix.phases[cell.phase].number),
            escape(cell.judgement.why),
            escape(cell.judgement.detection),
            "" if cell.judgement.after_ns is None else f"{cell.judgement.after_ns / SECOND:.4g}",
            link(cell.session, "recording") if cell.session else "",
        )
        for _, row, cell in sorted(found, key=lambda one: one[0])
    ]
    return table(("effect", "function", "failure mode", "phase", "why", "detection", "after s", ""), rows, (3, 6))
