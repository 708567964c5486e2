"""The part of a MIC488's state that other controllers do not have."""

from __future__ import annotations

from steptwin.controllerstate import DetailRow
from steptwin.datasheet import Detail, FactType
from steptwin.mic488.device import Mic488Device

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
        lambda device, now: {str(number): word for number, word in enumerate(device.user) if word},
    ),
)
