"""The part of a MIC488's state that other controllers do not have."""

from __future__ import annotations

from array import array

from steptwin.controllerstate import DetailRow
from steptwin.datasheet import Detail, FactType
from steptwin.mic488.device import Mic488Device

_BLOCK = 250
_ZEROS = bytes(2 * _BLOCK)


def _used(user: array[int]) -> dict[str, int]:
    """Words that are not 0, by number: nearly all of 2000 are 0, and a state is read for each sample."""
    data, size = user.tobytes(), len(_ZEROS)
    used = (first for first in range(0, len(user), _BLOCK) if data[2 * first : 2 * first + size] != _ZEROS)
    return {
        str(number): user[number] for first in used for number in range(first, min(first + _BLOCK, len(user))) if user[number]
    }


DETAILS: tuple[DetailRow[Mic488Device], ...] = (
    DetailRow(
        Detail("data_type", "Type of positions and velocities in registers: REAL or DINT", FactType.TEXT, is_brief=True),
        lambda device, now: "DINT" if device.data_type else "REAL",
    ),
    DetailRow(
        Detail(
            "axis_control_mode", "Whether motions begin at once (DIRECT) or by a trigger (TRIGGER)", FactType.TEXT, is_brief=True
        ),
        lambda device, now: "TRIGGER" if device.trigger_mode else "DIRECT",
    ),
    DetailRow(
        Detail("program_bank", "Bank of the program that is started next", FactType.WHOLE),
        lambda device, now: device.program.program_bank,
    ),
    DetailRow(
        Detail("position_bank", "Bank of its position table", FactType.WHOLE),
        lambda device, now: device.program.position_bank,
    ),
    DetailRow(
        Detail("user_registers", "User registers that are not 0", FactType.NAMED),
        lambda device, now: _used(device.user),
    ),
)
