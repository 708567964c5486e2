"""Variables that were meant as registers: a name with a mistake in it is a new variable to WBC, and the mistake passes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from steptwin.diagnostics import Diagnostic, Fix, Span
from steptwin.messages import Message
from steptwin.wbc import findings as f
from steptwin.wbc import steps as s
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.registers import ROWS
from steptwin.wbc.scope import ProgramScope

NOTHING_CHANGES = Message("wbc.nothing-changes", "nothing changes {name} while the program waits here")
NOTHING_CHANGES_BOTH = Message("wbc.nothing-changes-both", "nothing changes {one} and {other} while the program waits here")
REMOVE_OR_DID_YOU_MEAN = Message("wbc.remove-or-did-you-mean", "remove it, or did you mean {meant}?")
WAIT_LOOKS_AT_REGISTERS = Message("wbc.wait-looks-at-registers", "a WAIT compares registers, or what an interrupt sets")
IS_A_VARIABLE = Message("wbc.is-a-variable", "{name} is a variable: it has nothing to do with {meant}")
IS_SET_BUT_NEVER_USED = Message("wbc.is-set-but-never-used", "{name} is set but never used")

_FAMILIES: Mapping[str, str] = {
    "OUTPUT": "OUT",
    "INPUT": "IN",
    "VMAX": "VMAXM",
    "ACC": "ACCM",
    "DEC": "DECM",
    "POS": "POSM",
    "I": "$I",
    "D": "$D",
    "R": "$R",
}
"""Names of the configuration and the Modbus map for registers of WBC, and user registers without their sign."""
_CERTAIN = frozenset({"OUTPUT", "INPUT"})
"""Names that never denote a variable intentionally. Others are reported only if the variable is not used."""
_MOTIONS = {"ABS": "PABS", "REL": "PREL"}
_MOTION = re.compile(r"(M[1-4])_POS_(ABS|REL)$")
"""Modbus registers that begin a motion; a program has statements for that."""
_NAME = re.compile(r"([A-Z_]+?)([0-9]{1,4})$")


def register_meant(key: str, dialect: Dialect, families: Iterable[str] = _FAMILIES) -> str | None:
    """The register that a name in upper case was probably meant for."""
    match = _NAME.match(key)
    if match is None or match[1] not in families or match[1] not in _FAMILIES:
        return None
    row = ROWS[_FAMILIES[match[1]]]
    return f"{row.name}{int(match[2])}" if int(match[2]) in row.numbers(dialect) else None


def unused_variables(executable: s.Executable, scope: ProgramScope, dialect: Dialect) -> list[Diagnostic]:
    """Variables that are set and never read, and those whose names leave no doubt that a register was meant."""
    read = {source.index for step in executable.steps for source in step.sources() if isinstance(source, s.Variable)}
    found: list[Diagnostic] = []
    for index, name in enumerate(scope.variables.values()):
        if index not in read:
            meant = register_meant(name.key, dialect) or scope.nearest_register(name.text)
            motion = _MOTION.match(name.key)
            moves = None if motion is None else f"{_MOTIONS[motion[2]]} {motion[1]}"
            hint = REMOVE_OR_DID_YOU_MEAN(meant=meant or moves or f.A_REGISTER())
            named = None if meant is None else Fix(Span(name.start, name.end), meant, is_named=True)
            fix = named or _removed(executable, index)
            found.append(f.NEVER_USED.at(name, IS_SET_BUT_NEVER_USED(name=name.text), hint, fix))
        elif (meant := register_meant(name.key, dialect, _CERTAIN)) is not None:
            message = IS_A_VARIABLE(name=name.text, meant=meant)
            found.append(f.LIKE_A_REGISTER.at(name, message, meant=meant))
    return found


def _removed(executable: s.Executable, index: int) -> Fix | None:
    """The removal of the statement that sets a variable, if it is the only one."""
    sets = [step for step in executable.steps if isinstance(step, s.SetStep) and _is_variable(step.target, index)]
    return Fix(Span(sets[0].start, sets[0].end), "") if len(sets) == 1 else None


def _is_variable(target: object, index: int) -> bool:
    return isinstance(target, s.Variable) and target.index == index


def waits_for_variables(executable: s.Executable, dialect: Dialect) -> list[Diagnostic]:
    """Each WAIT with a condition that cannot change: it has variables only, and no interrupt sets one."""
    if executable.entries:
        return []
    found: list[Diagnostic] = []
    for step in executable.steps:
        names = list(_variables(step)) if isinstance(step, s.WaitStep) else []
        if not names:
            continue
        meant = next((meant for name in names if (meant := register_meant(name.upper(), dialect))), None)
        hint = f.DID_YOU_MEAN(meant=meant) if meant else WAIT_LOOKS_AT_REGISTERS()
        message = NOTHING_CHANGES(name=names[0]) if len(names) == 1 else NOTHING_CHANGES_BOTH(one=names[0], other=names[1])
        found.append(f.WAITS_FOR_VARIABLE.at(step, message, hint))
    return found


def _variables(step: s.WaitStep) -> Iterator[str]:
    """The variables of a condition; none where it has a register too."""
    sides = step.condition.left, step.condition.right
    if not any(isinstance(side, s.RegisterOperand) for side in sides):
        yield from dict.fromkeys(side.name for side in sides if isinstance(side, s.Variable))
