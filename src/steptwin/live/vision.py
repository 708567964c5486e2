"""Whether a served MIC488 takes records of a vision system."""

from __future__ import annotations

from steptwin.mic488.program import LoadedProgram
from steptwin.wbc import steps as s
from steptwin.wbc.usage import sources

VISION = "VISION"
"""How the registers of the vision system begin."""


def uses_vision(program: LoadedProgram) -> bool:
    """Whether a program reads or writes a register of the vision system."""
    used = [source for step in program.steps for source in sources(step)]
    used += [step.target for step in program.steps if isinstance(step, s.Set)]
    return any(isinstance(source, s.Register) and source.row.key.startswith(VISION) for source in used)
