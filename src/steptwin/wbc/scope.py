"""What the names of one program mean: constants, variables, registers, predefined names, positions."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Diagnostic
from steptwin.nearmiss import NearMiss
from steptwin.wbc import findings as f
from steptwin.wbc.dialect import Dialect
from steptwin.wbc.events import BY_LABEL
from steptwin.wbc.foreign_words import VALUES
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.real import real, real_text, whole
from steptwin.wbc.registers import PREDEFINED, REAL_MAX, REGISTERS, ROWS, VALUE_NAMES, RegisterRow, parts
from steptwin.wbc.statements import FUNCTIONS, KEYWORDS, NOT_SUPPORTED
from steptwin.wbc.steps import AssignmentTarget, Literal, RegisterOperand, ValueSource, Variable
from steptwin.wbc.tree import Assign, Broken, ConstantDefinition, DecimalNumber, Identifier, ProgramTree, ValueNode

_STATUS_SINCE = "1.70"

COARSE = 0.5
"""A number that REAL changes by this much or more is no longer the one that was meant."""
EXACT_REAL = 2**24
"""All whole numbers up to it are REAL."""


class ProgramScope:
    """Names of a program. Built from the whole text first, so that a name may be used above the line that defines it."""

    def __init__(
        self, program: ProgramTree, positions: PositionTable | None, dialect: Dialect, diagnostics: list[Diagnostic]
    ) -> None:
        self._dialect = dialect
        self._positions = positions
        self._diagnostics = diagnostics
        self._near = NearMiss()
        self._near_registers = NearMiss()
        self._broken: set[str] = set()
        self.known: dict[str, ValueSource] = {}
        self.constants: dict[str, Identifier] = {}
        self.variables: dict[str, Identifier] = {}
        """First assignment of every variable, in order."""
        self.remarked: set[str] = set()
        """Names of wrong definitions, already reported at their first use."""
        # A text is checked many times while it is edited: only new names are examined.
        statements = program.naming
        for statement in statements:
            if isinstance(statement, ConstantDefinition):
                self._define(statement)
        assigned: dict[str, Identifier] = {}
        for statement in statements:
            if isinstance(statement, Assign):
                assigned.setdefault(statement.target.key, statement.target)
            elif isinstance(statement, Broken) and statement.target is not None:
                self._broken.add(statement.target.key)
        for key, name in assigned.items():
            if key not in self.known:
                self._assigned(name)
        refused = {key for key in assigned if key in self._broken and key not in self.known}
        for statement in statements if refused else ():
            if (
                isinstance(statement, Assign)
                and (key := statement.target.key) in refused
                and statement.target is not assigned[key]
            ):
                self._assigned(statement.target)

    # -- defining

    def _define(self, constant: ConstantDefinition) -> None:
        name, key = constant.name, constant.name.key
        reason = self.reserved(key)
        if reason is not None:
            self._report(f.RESERVED.at(name, f"{name.text} cannot be a constant: it is {reason}", "take another name"))
            return
        if key in self.constants:
            self._report(f.DUPLICATE_CONSTANT.at(name, f"the constant {name.text} is defined twice", "remove one definition"))
            return
        self.constants[key] = name
        value = constant.value
        if isinstance(value, Identifier) and parts(value.key) is None and value.key not in PREDEFINED:
            hint = "the value of a constant is a number or a register, like #speed 60 or #pump OUT3"
            self._report(f.BAD_CONSTANT.at(value, f"{value.text} is neither a number nor a register", hint))
            self._broken.add(key)
            return
        resolved = self.value(value)
        if resolved is None:
            self._broken.add(key)
        else:
            self.known[key] = resolved

    def _assigned(self, name: Identifier) -> None:
        key = name.key
        if key in self.constants or parts(key) is not None or key in PREDEFINED:
            return
        reason = self.reserved(key)
        if reason is not None:
            self._broken.add(key)
            self._report(f.RESERVED.at(name, f"{name.text} cannot be a variable: it is {reason}", "take another name"))
            return
        index = len(self.variables)
        if index == self._dialect.max_variables:
            limit = self._dialect.max_variables
            self._report(
                f.TOO_MANY_VARIABLES.at(name, f"there are too many variables: {name.text}", f"a program has at most {limit}")
            )
        self.variables[key] = name
        self.known[key] = Variable(index, name.text)

    def reserved(self, key: str) -> str | None:
        """The reason for which a constant or variable cannot have this name; None if it can."""
        if parts(key) is not None:
            return "a register"
        if key in KEYWORDS or key in NOT_SUPPORTED:
            return "a statement"
        if key in PREDEFINED:
            return f"predefined as {PREDEFINED[key]:g}"
        if key in FUNCTIONS:
            return "a function"
        if key in BY_LABEL:
            return "an interrupt label"
        if self._positions is not None and self._positions.index(key) is not None:
            return "a position"
        return None

    def meanings(self) -> dict[str, object]:
        """The definitions of names in the program, for comparison with earlier ones."""
        meanings: dict[str, object] = dict.fromkeys(self._broken, "broken")
        meanings.update((key, (source, key in self.constants)) for key, source in self.known.items())
        return meanings

    # -- using

    def value(self, node: ValueNode, other: ValueNode | None = None, *, is_row: bool = False) -> ValueSource | None:
        """The value of a number or name; None after reporting an error.

        ``other`` is what it is compared with or assigned to, which determines the possible names. ``is_row``: a row of the
        position table is wanted.
        """
        if isinstance(node, DecimalNumber):
            if not -REAL_MAX <= node.value <= REAL_MAX:
                self._report(f.OUT_OF_RANGE.at(node, f"{node.text} is out of range", f"REAL reaches ±{REAL_MAX:.3g}"))
                return None
            held = real(node.value)
            if min(abs(held - node.value), abs(whole(held) - node.value)) >= COARSE:  # the largest DINT is right in a DINT
                hint = f"REAL holds whole numbers up to {EXACT_REAL}"
                self._report(f.NOT_IN_REAL.at(node, f"{node.text} becomes {real_text(held)}", hint))
            return Literal(node.value)
        known = self.known.get(node.key)
        return known if known is not None else self._look_up(node, other, is_row=is_row)

    def target(self, name: Identifier) -> AssignmentTarget | None:
        """The variable or register of an assignment; None after reporting an error."""
        found = self.known.get(name.key)
        if found is None:
            if name.key in self._broken:
                return None
            found = self._look_up(name)
        if isinstance(found, Literal):
            kind = "a constant" if name.key in self.constants else "predefined"
            self._report(f.NOT_ASSIGNABLE.at(name, f"{name.text} is {kind} and cannot be set", "set a variable or a register"))
            return None
        if isinstance(found, RegisterOperand) and found.row.writes is None:
            alias = "" if name.text.upper() == found.name.upper() else f" ({found.name})"
            self._report(f.READ_ONLY.at(name, f"{name.text}{alias} is read-only", f"{found.row.name}: {found.row.meaning}"))
            return None
        return found

    def register(self, name: Identifier) -> RegisterOperand | None:
        """The register a name or alias means, None (silently) when it means something else."""
        found = self.known.get(name.key)
        if found is None and parts(name.key) is not None:
            found = self._look_up(name)
        return found if isinstance(found, RegisterOperand) else None

    def family(self, name: Identifier) -> str | None:
        """Key of the register family a name or alias belongs to, existing number or not; None when it belongs to none."""
        found = self.known.get(name.key)
        if isinstance(found, RegisterOperand):
            return found.row.key
        family = parts(name.key)
        return family[0].key if family is not None else None

    def _look_up(self, name: Identifier, other: ValueNode | None = None, *, is_row: bool = False) -> ValueSource | None:
        """Registers and predefined names enter ``known`` when they are first used; anything else is a mistake."""
        key = name.key
        found = parts(key)
        if found is not None:
            register = self._register(name, *found)
            if register is not None:
                self.known[key] = register
            return register
        if key in PREDEFINED:
            self.known[key] = Literal(float(PREDEFINED[key]))
            return self.known[key]
        if key not in self._broken:
            self._unknown(name, other, is_row=is_row)
        return None

    def _register(self, name: Identifier, row: RegisterRow, number: int) -> RegisterOperand | None:
        dialect = self._dialect
        if not dialect.has(row.since):
            self._report(f.NOT_IN_FIRMWARE.at(name, f"{name.text} needs firmware {row.since}", f"checked for {dialect.firmware}"))
            return None
        numbers = row.numbers(dialect)
        if numbers and number not in numbers:
            if row.words and number <= numbers[-1]:
                hint = f"{row.name} takes two registers and begins at an even one"
                self._report(f.ODD_ADDRESS.at(name, f"{name.text} has an odd address", hint))
            elif row.words:
                hint = f"{row.spelling(dialect)} in firmware {dialect.firmware}"
                self._report(f.USER_ADDRESS.at(name, f"there is no user register {name.text}", hint))
            else:
                self._report(f.NO_SUCH_REGISTER.at(name, f"there is no {name.text}", row.spelling(dialect)))
            return None
        if row.key == "STATUS" and not dialect.has(_STATUS_SINCE):
            hint = f"it gives M_STATUS from firmware {_STATUS_SINCE} on"
            self.remarked.add(name.key)
            self._report(f.STATUS_IS_ZERO.at(name, f"STATUS is always 0 in firmware {dialect.firmware}", hint))
        return RegisterOperand(row, number)

    def _unknown(self, name: Identifier, other: ValueNode | None, *, is_row: bool) -> None:
        key = name.key
        if self._positions is not None and self._positions.index(key) is not None:
            hint = f"write @{name.text} after a motion statement"
            self._report(
                f.RESERVED.at(name, f"{name.text} is a position, not a value", hint, fix=f"@{name.text}" if is_row else None)
            )
            return
        reason = self.reserved(key)
        if reason is not None:
            self._report(f.RESERVED.at(name, f"{name.text} is {reason}, not a value"))
            return
        meant = VALUES.get(key) or self.nearest(name.text)
        hint = self._names_for(other) or "a variable comes into being when it is first set"
        self._report(f.UNKNOWN_VARIABLE.at(name, f"unknown variable {name.text}", hint, meant=meant))

    def _names_for(self, other: ValueNode | None) -> str:
        """The predefined names that make sense with a register; nothing where there are none."""
        family = self.family(other) if isinstance(other, Identifier) else None
        row = None if family is None else ROWS[family]
        names = () if row is None else VALUE_NAMES.get(row.writes or row.reads) or VALUE_NAMES.get(row.reads) or ()
        return f"with {row.name} go {', '.join(names)}" if row is not None and names else ""

    def nearest_register(self, text: str) -> str | None:
        return self._near_registers.of(text, _register_spellings(self._dialect))

    def nearest(self, text: str) -> str | None:
        return self._near.of(text, self._spellings())

    def _spellings(self) -> Iterator[str]:
        for names in (self.variables, self.constants):
            for name in names.values():
                yield name.text
        yield from PREDEFINED
        yield from _register_spellings(self._dialect)

    def _report(self, diagnostic: Diagnostic) -> None:
        self._diagnostics.append(diagnostic)


def _register_spellings(dialect: Dialect) -> Iterator[str]:
    for row in REGISTERS:
        numbers = row.numbers(dialect)[:20]
        if numbers:
            for number in numbers:
                yield f"{row.name}{number}"
        else:
            yield row.name
