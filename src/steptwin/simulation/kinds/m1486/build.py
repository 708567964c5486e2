"""Builds an M1486 from its description."""

from __future__ import annotations

from functools import lru_cache

from steptwin.diagnostics import Severity, SourceText, render
from steptwin.errors import SourceErrors
from steptwin.m1486.check import CheckedChipProgram, check
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import Interface, interface
from steptwin.m1486.variants import Variant
from steptwin.simulation.kinds.kind import BuildContext, text_of
from steptwin.simulation.kinds.m1486.table import M1486Spec


def image(spec: M1486Spec, kind: Variant, context: BuildContext) -> bytes | None:
    """The image of its program; None without one."""
    if spec.program is None:
        return None
    source = SourceText(spec.program, text_of(context, spec.program))
    checked = _checked(source.text, kind, interface(spec.interface))
    context.accept(source, checked.diagnostics)
    return image_of(checked.program, kind)


_checked = lru_cache(maxsize=16)(check)
"""For the next world with the same program."""


def sound(source: SourceText, kind: Variant, drive: Interface) -> CheckedChipProgram:
    """A program that was checked. Raises `SourceErrors`."""
    checked = check(source.text, kind, drive)
    if not checked.is_sound:
        errors = [finding for finding in checked.diagnostics if finding.severity is Severity.ERROR]
        raise SourceErrors(render(source, errors))
    return checked
