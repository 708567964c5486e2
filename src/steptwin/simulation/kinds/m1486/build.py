"""Builds an M1486 from its description."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from steptwin.diagnostics import Severity, SourceText, render
from steptwin.errors import SourceErrors
from steptwin.m1486.check import CheckedChipProgram, check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import Interface, interface
from steptwin.m1486.variants import Store, Variant, variant
from steptwin.simulation.kinds.kind import BuildContext, text_of
from steptwin.simulation.kinds.m1486.table import M1486Spec


def build(spec: M1486Spec, context: BuildContext) -> Callable[[bytes | None], M1486Chip]:
    """As `steptwin.simulation.kinds.kind.ControllerKind.build`."""
    kind = variant(spec.variant)
    program = _program(spec, kind, context)
    timed = any(line.name == spec.line and line.timing != "off" for line in context.lines)
    baud = spec.baud
    if baud is None:
        baud = next((line.baud for line in context.lines if line.name == spec.line), None)

    def make(memory: bytes | None) -> M1486Chip:
        kept = memory if memory is not None and kind.store is Store.EEPROM else b""
        return M1486Chip(
            kind,
            address=spec.address,
            interface=interface(spec.interface),
            baud=baud,
            statement_ns=spec.statement_time,
            is_timed=timed,
            image=kept if program is None else program,
        )

    return make


def _program(spec: M1486Spec, kind: Variant, context: BuildContext) -> bytes | None:
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


def keep_memory(chip: M1486Chip, memory: bytes | None, keep: Callable[[bytes], None]) -> None:
    """Types with EEPROM keep the program they are switched on with, too."""
    chip.store = keep
    if chip.variant.store is Store.EEPROM and chip.image != (memory or b""):
        keep(chip.image)
