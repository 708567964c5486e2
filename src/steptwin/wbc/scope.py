"""Meanings of the names of one program: constants, variables, registers, predefined names, positions."""

from __future__ import annotations

from collections.abc import Iterator

from steptwin.diagnostics import Diagnostic
from steptwin.messages import Message, MessageText
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

CONSTANT_IS_NUMBER_OR_REGISTER = Message(
    "wbc.constant-is-number-or-register", "the value of a constant is a number or a register, like #speed 60 or #pump OUT3"
)
PREDEFINED_AS = Message("wbc.predefined-as", "predefined as {value:g}")
AN_INTERRUPT_LABEL = Message("wbc.an-interrupt-label", "an interrupt label")
A_POSITION = Message("wbc.a-position", "a position")
GIVES_M_STATUS = Message("wbc.gives-m-status", "it gives M_STATUS from firmware {since} on")
WRITE_POSITION = Message("wbc.write-position", "write @{name} after a motion statement")
VARIABLE_COMES_INTO_BEING = Message("wbc.variable-comes-into-being", "a variable comes into being when it is first set")
COMPARED_WITH = Message("wbc.compared-with", "with {name} go {names}")
WHOLE_NUMBERS_OF_REAL = Message("wbc.whole-numbers-of-real", "REAL holds whole numbers up to {most}")
BEGINS_AT_AN_EVEN_REGISTER = Message("wbc.begins-at-an-even-register", "{name} takes two registers and begins at an even one")
UNKNOWN_VARIABLE = Message("wbc.unknown-variable", "unknown variable {name}")
CANNOT_BE_A_CONSTANT = Message("wbc.cannot-be-a-constant", "{name} cannot be a constant: it is {reason}")
CONSTANT_IS_DEFINED_TWICE = Message("wbc.constant-is-defined-twice", "the constant {name} is defined twice")
REMOVE_ONE_DEFINITION = Message("wbc.remove-one-definition", "remove one definition")
IS_NEITHER_A_NUMBER_NOR_A_REGISTER = Message(
    "wbc.is-neither-a-number-nor-a-register", "{text} is neither a number nor a register"
)
CANNOT_BE_A_VARIABLE = Message("wbc.cannot-be-a-variable", "{name} cannot be a variable: it is {reason}")
TOO_MANY_VARIABLES = Message("wbc.too-many-variables", "there are too many variables: {name}")
PROGRAM_HAS_AT_MOST = Message("wbc.program-has-at-most", "a program has at most {limit}")
IS_A_CONSTANT = Message("wbc.is-a-constant", "{name} is a constant and cannot be set")
IS_PREDEFINED = Message("wbc.is-predefined", "{name} is predefined and cannot be set")
SET_A_VARIABLE_OR_A_REGISTER = Message("wbc.set-a-variable-or-a-register", "set a variable or a register")
READ_ONLY_REGISTER = Message("wbc.read-only-register", "{name}: {meaning}")
IS_READ_ONLY = Message("wbc.is-read-only", "{name}{alias} is read-only")
NEEDS_FIRMWARE = Message("wbc.needs-firmware", "{name} needs firmware {since}")
IN_FIRMWARE = Message("wbc.in-firmware", "{names} in firmware {firmware}")
STATUS_IS_0 = Message("wbc.status-is-0", "STATUS is always 0 in firmware {firmware}")
IS_A_POSITION = Message("wbc.is-a-position", "{name} is a position, not a value")
IS_NOT_A_VALUE = Message("wbc.is-not-a-value", "{name} is {reason}, not a value")
IS_OUT_OF_REAL = Message("wbc.is-out-of-real", "{text} is out of range")
REAL_REACHES = Message("wbc.real-reaches", "REAL reaches ±{most:.3g}")
BECOMES = Message("wbc.becomes", "{text} becomes {held}")
HAS_AN_ODD_ADDRESS = Message("wbc.has-an-odd-address", "{name} has an odd address")
THERE_IS_NO_USER_REGISTER = Message("wbc.there-is-no-user-register", "there is no user register {name}")

_STATUS_SINCE = "1.70"

COARSE = 0.5
"""A number that REAL changes by this much or more is no longer the one that was meant."""
EXACT_REAL = 2**24
"""All whole numbers up to it are REAL."""

_MEANINGS = {
    row.key: Message(f"wbc.register.{row.key.lower().replace('_', '-')}", row.meaning)()
    for row in REGISTERS
    if row.writes is None
}


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
            self._report(f.RESERVED.at(name, CANNOT_BE_A_CONSTANT(name=name.text, reason=reason), f.TAKE_ANOTHER_NAME()))
            return
        if key in self.constants:
            self._report(f.DUPLICATE_CONSTANT.at(name, CONSTANT_IS_DEFINED_TWICE(name=name.text), REMOVE_ONE_DEFINITION()))
            return
        self.constants[key] = name
        value = constant.value
        if isinstance(value, Identifier) and parts(value.key) is None and value.key not in PREDEFINED:
            hint = CONSTANT_IS_NUMBER_OR_REGISTER()
            self._report(f.BAD_CONSTANT.at(value, IS_NEITHER_A_NUMBER_NOR_A_REGISTER(text=value.text), hint))
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
            self._report(f.RESERVED.at(name, CANNOT_BE_A_VARIABLE(name=name.text, reason=reason), f.TAKE_ANOTHER_NAME()))
            return
        index = len(self.variables)
        if index == self._dialect.max_variables:
            limit = self._dialect.max_variables
            self._report(f.TOO_MANY_VARIABLES.at(name, TOO_MANY_VARIABLES(name=name.text), PROGRAM_HAS_AT_MOST(limit=limit)))
        self.variables[key] = name
        self.known[key] = Variable(index, name.text)

    def reserved(self, key: str) -> str | None:
        """The reason for which a constant or variable cannot have this name; None if it can."""
        if parts(key) is not None:
            return f.A_REGISTER()
        if key in KEYWORDS or key in NOT_SUPPORTED:
            return f.A_STATEMENT()
        if key in PREDEFINED:
            return PREDEFINED_AS(value=PREDEFINED[key])
        if key in FUNCTIONS:
            return f.A_FUNCTION()
        if key in BY_LABEL:
            return AN_INTERRUPT_LABEL()
        if self._positions is not None and self._positions.index(key) is not None:
            return A_POSITION()
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
                self._report(f.OUT_OF_RANGE.at(node, IS_OUT_OF_REAL(text=node.text), REAL_REACHES(most=REAL_MAX)))
                return None
            held = real(node.value)
            if min(abs(held - node.value), abs(whole(held) - node.value)) >= COARSE:  # the largest DINT is right in a DINT
                hint = WHOLE_NUMBERS_OF_REAL(most=EXACT_REAL)
                self._report(f.NOT_IN_REAL.at(node, BECOMES(text=node.text, held=real_text(held)), hint))
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
            message = IS_A_CONSTANT if name.key in self.constants else IS_PREDEFINED
            self._report(f.NOT_ASSIGNABLE.at(name, message(name=name.text), SET_A_VARIABLE_OR_A_REGISTER()))
            return None
        if isinstance(found, RegisterOperand) and found.row.writes is None:
            alias = "" if name.text.upper() == found.name.upper() else f" ({found.name})"
            self._report(
                f.READ_ONLY.at(
                    name,
                    IS_READ_ONLY(name=name.text, alias=alias),
                    READ_ONLY_REGISTER(name=found.row.name, meaning=_MEANINGS[found.row.key]),
                )
            )
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
            self._report(
                f.NOT_IN_FIRMWARE.at(
                    name, NEEDS_FIRMWARE(name=name.text, since=row.since), f.CHECKED_FOR(firmware=dialect.firmware)
                )
            )
            return None
        numbers = row.numbers(dialect)
        if numbers and number not in numbers:
            if row.words and number <= numbers[-1]:
                hint = BEGINS_AT_AN_EVEN_REGISTER(name=row.name)
                self._report(f.ODD_ADDRESS.at(name, HAS_AN_ODD_ADDRESS(name=name.text), hint))
            elif row.words:
                hint = IN_FIRMWARE(names=row.spelling(dialect), firmware=dialect.firmware)
                self._report(f.USER_ADDRESS.at(name, THERE_IS_NO_USER_REGISTER(name=name.text), hint))
            else:
                self._report(f.NO_SUCH_REGISTER.at(name, f.THERE_IS_NO(name=name.text), MessageText(row.spelling(dialect))))
            return None
        if row.key == "STATUS" and not dialect.has(_STATUS_SINCE):
            hint = GIVES_M_STATUS(since=_STATUS_SINCE)
            self.remarked.add(name.key)
            self._report(f.STATUS_IS_ZERO.at(name, STATUS_IS_0(firmware=dialect.firmware), hint))
        return RegisterOperand(row, number)

    def _unknown(self, name: Identifier, other: ValueNode | None, *, is_row: bool) -> None:
        key = name.key
        if self._positions is not None and self._positions.index(key) is not None:
            hint = WRITE_POSITION(name=name.text)
            self._report(f.RESERVED.at(name, IS_A_POSITION(name=name.text), hint, fix=f"@{name.text}" if is_row else None))
            return
        reason = self.reserved(key)
        if reason is not None:
            self._report(f.RESERVED.at(name, IS_NOT_A_VALUE(name=name.text, reason=reason)))
            return
        meant = VALUES.get(key) or self.nearest(name.text)
        hint = self._names_for(other) or VARIABLE_COMES_INTO_BEING()
        self._report(f.UNKNOWN_VARIABLE.at(name, UNKNOWN_VARIABLE(name=name.text), hint, meant=meant))

    def _names_for(self, other: ValueNode | None) -> MessageText | None:
        """The predefined names that make sense with a register."""
        family = self.family(other) if isinstance(other, Identifier) else None
        row = None if family is None else ROWS[family]
        names = () if row is None else VALUE_NAMES.get(row.writes or row.reads) or VALUE_NAMES.get(row.reads) or ()
        return COMPARED_WITH(name=row.name, names=", ".join(names)) if row is not None and names else None

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
