"""Groups of registers in the monitor, and the texts of their values."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.mic488.registermap import DataType, Register, RegisterMap, Space, Type
from steptwin.mic488.values import RegisterValue

AXES = "M"
CONTROLLER, INPUTS, OUTPUTS, USER = "Controller", "Inputs", "Outputs", "User"
USER_SHOWN = 32
"""User registers shown at a time."""


def groups_of(registers: RegisterMap) -> Mapping[str, list[Register]]:
    """Every register by the group it is shown in, in the order of groups; user registers apart."""
    groups: dict[str, list[Register]] = {f"{AXES}{axis}": [] for axis in range(1, 5)}
    groups |= {CONTROLLER: [], INPUTS: [], OUTPUTS: []}
    for register in registers:
        if register.type is Type.MEMORY:
            continue
        if register.axis is not None:
            group = f"{AXES}{register.axis}"
        elif register.space is Space.INPUT:
            group = INPUTS
        else:
            group = OUTPUTS if register.key == "OUT" else CONTROLLER
        groups[group].append(register)
    # What changes comes before what is set, and that before what only can be written.
    for members in groups.values():
        members.sort(key=lambda r: (not r.reads, bool(r.accepts) and bool(r.reads)))
    return groups


def shown(register: Register, value: RegisterValue) -> str:
    """A value as text: ``REAL (0)``, ``on``, ``12.5``."""
    if register.type is Type.BIT:
        return "on" if value else "off"
    if register.values:
        return f"{register.values.get(int(value), 'unknown')} ({value})"
    return f"{value:.7g}" if isinstance(value, float) else str(value)


def permitted(register: Register, data_type: DataType, unit: str) -> str:
    """The permitted values of a register as text."""
    if not register.accepts:
        return "read only"
    if register.values:
        return ", ".join(f"{name} ({number})" for number, name in register.values.items())
    if register.type is Type.BIT:
        return "on, off"
    return f"{register.permitted} {register.unit(data_type, unit)}".rstrip()
