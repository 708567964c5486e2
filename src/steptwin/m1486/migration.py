"""M1486 programs for another type: what differs between two types, and what has to change in a program.

Labels get other numbers where the checker offers them. Between 12 and 24 MHz times, speeds and accelerations are converted, so
that the motions stay the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from steptwin.diagnostics import Diagnostic, Fix
from steptwin.m1486.check import check
from steptwin.m1486.commands import PROFILE_RANGE, find, permitted_text
from steptwin.m1486.findings import ChipFinding
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.syntax import ChipCommand, parse
from steptwin.m1486.variants import Store, Variant
from steptwin.messages import MessageText

CONVERTED = ChipFinding("M223", "number for the other clock", "At 24 MHz speeds, accelerations and times have other numbers.")
NOT_CONVERTED = ChipFinding("M140", "no number for the other clock", "The chip does not take the number that it would need.")
_POWERS = {"W": -1, "S": 1, "V": 1, "P": 1, "A": 2}
"""By command the power of the clock that its number is multiplied by on the chip (chapter X)."""


def differences(old: Variant, new: Variant) -> Iterator[str]:
    """Differences that a program may notice, as sentences."""
    if old.labels != new.labels:
        yield f"labels 1 to {new.labels}, not to {old.labels}"
    if old.memory_bits != new.memory_bits:
        yield f"command memory of {new.memory_bits} bits, not {old.memory_bits}"
    if old.input_bits != new.input_bits:
        yield f"input buffer of {new.input_bits // 8} characters, not {old.input_bits // 8}"
    if old.clock != new.clock:
        faster = "twice" if new.clock > old.clock else "half"
        yield f"everything {faster} as fast, the serial line too: W, S, V, P and A are converted, defaults are not"
    if old.shared_bits != new.shared_bits:
        yield "registers 1 to 8 share the command memory" if new.shared_bits else "registers have a memory of their own"
    if old.store is not new.store:
        if new.store is Store.EEPROM:
            yield f"the file in [ ] is kept and runs at power-up; each command takes {new.write_ns / 1e9:g} s to receive"
        else:
            yield "the program is lost with the power, and a host must send it"
    if old.addresses != new.addresses:
        yield f"addresses {new.addresses[0]:X} to {new.addresses[-1]:X}, not {old.addresses[0]:X} to {old.addresses[-1]:X}"
    if old.has_shutdown and not new.has_shutdown:
        yield "no shutdown by the pin SD"
    if old.pwm_outputs and not new.pwm_outputs:
        yield "no PWM outputs"


def findings(text: str, old: Variant, new: Variant, interface: Interface = STEP_DIRECTION) -> list[Diagnostic]:
    """Findings of the checker for the new type only, and numbers that are converted for the other clock."""
    known = {(d.code, d.span) for d in check(text, old, interface).diagnostics}
    found = [d for d in check(text, new, interface).diagnostics if (d.code, d.span) not in known]
    if old.clock == new.clock:
        return found
    converted = [d for command in parse(text)[0].all_commands if (d := _converted(command, old, new)) is not None]
    return sorted([*found, *converted], key=lambda d: d.span)


def _converted(command: ChipCommand, old: Variant, new: Variant) -> Diagnostic | None:
    power = _POWERS.get(command.key)
    if power is None:
        return None
    if command.number is None:
        message = f"the internal variable means another {'time' if power < 0 else 'speed or acceleration'} here"
        return CONVERTED(command.span, MessageText(message), MessageText("its values must be converted"))
    if command.key == "P" and command.number not in PROFILE_RANGE:
        return None  # no parabolic acceleration, at any clock
    exact = command.number * Fraction(old.clock, new.clock) ** power
    number = round(exact)
    permitted = f"{PROFILE_RANGE[0]} to {PROFILE_RANGE[-1]}" if command.key == "P" else permitted_text(command.key, new)
    if find(command.key, number, new) is None or (command.key == "P" and number not in PROFILE_RANGE):
        message = f"{command} would have to be {command.key}{float(exact):g} on {new.title}: permitted is {permitted}"
        return NOT_CONVERTED(command.argument_span, MessageText(message))
    message = f"{command} is {command.key}{float(exact):g} on {new.title}"
    hint = None if exact == number else MessageText("rounded to a whole number")
    return CONVERTED(command.argument_span, MessageText(message), hint, Fix(command.argument_span, str(number)))
