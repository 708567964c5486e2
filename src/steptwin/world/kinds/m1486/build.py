"""Builds an M1486 from its description."""

from __future__ import annotations

from collections.abc import Callable

from steptwin.diagnostics import Severity, SourceText, render
from steptwin.errors import SourceErrors
from steptwin.m1486.check import CheckedChipProgram, check
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import Interface, interface
from steptwin.m1486.variants import Store, Variant, variant
from steptwin.world.kind import BuildContext, text_of
from steptwin.world.kinds.m1486.table import M1486Spec


def build(spec: M1486Spec, memory: bytes | None, context: BuildContext) -> M1486Chip:
    kind = variant(spec.variant)
    image = _image(spec, kind, memory, context)
    timed = any(line.name == spec.line and line.timing != "off" for line in context.spec.lines)
    baud = spec.baud
    if baud is None:
        baud = next((line.baud for line in context.spec.lines if line.name == spec.line), None)
    return M1486Chip(
        kind,
        address=spec.address,
        interface=interface(spec.interface),
        baud=baud,
        statement_ns=spec.statement_time,
        is_timed=timed,
        image=image,
    )


def _image(spec: M1486Spec, kind: Variant, memory: bytes | None, context: BuildContext) -> bytes:
    """The stored file of a chip: its program, or else what its EEPROM has kept."""
    if spec.program is None:
        return memory if memory is not None and kind.store is Store.EEPROM else b""
    source = SourceText(spec.program, text_of(context, spec.program))
    checked = check(source.text, kind, interface(spec.interface))
    context.accept(source, checked.diagnostics)
    return image_of(checked.program, kind)


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
