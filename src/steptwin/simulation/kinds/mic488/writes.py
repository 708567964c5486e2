"""Registers of a MIC488 that are written by name."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.controller import Nanos
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import MOTION_REGISTERS
from steptwin.mic488.values import encoded, halted, named
from steptwin.mic488.writes import permitted
from steptwin.simulation.kinds.kind import NamedRegisters, NewValues
from steptwin.simulation.kinds.programs import Resource, ResourceKind, WriteUse
from steptwin.wire.pdu import (
    MAX_WRITTEN_REGISTERS,
    ModbusException,
    ModbusRequest,
    WriteRegistersRequest,
    decode_request,
    encode_request,
)

MODE = "AXIS_CTR_MODE"
"""TRIGGER while it is not 0: values of motion registers wait for their trigger register (MIC-16)."""


class Mic488Registers(NamedRegisters[Mic488Device]):
    def requests(self, device: Mic488Device, values: NewValues, *, is_command: bool) -> tuple[bytes, ...]:
        requests: list[ModbusRequest] = []
        data_type = DataType(device.data_type)
        for register, value in values:
            item = named(device.registers, register)
            number = item.register.axis
            if number is None:
                request = encoded(item, value, data_type)
            else:
                axis = device.axes[number - 1]
                taken = permitted(item.register, data_type, axis.gear) if is_command else None
                request = encoded(item, value, data_type, axis.config.unit_name, taken)
            last = requests[-1] if requests else None
            if (
                isinstance(request, WriteRegistersRequest)
                and isinstance(last, WriteRegistersRequest)
                and last.address + len(last.values) == request.address
                and len(last.values) + len(request.values) <= MAX_WRITTEN_REGISTERS
            ):
                requests[-1] = WriteRegistersRequest(last.address, (*last.values, *request.values))
            else:
                requests.append(request)
        return tuple(map(encode_request, requests))

    def dialect(self, device: Mic488Device) -> tuple[str, int]:
        return device.firmware.name, device.data_type

    def execute(self, device: Mic488Device, pdu: bytes, now: Nanos) -> bytes:
        return device.execute(pdu, now)

    def uses(self, axis: str) -> Mapping[str, WriteUse]:
        if not axis:
            banks = tuple(Resource(ResourceKind.VALUE, name) for name in ("PROG_BANK_SEL", "POS_BANK_SEL"))
            return {"PROGRAM_CTRL": WriteUse(banks)}
        found = {f"M{axis}_JOG_{way}": WriteUse((Resource(ResourceKind.VALUE, "JOG_SPEED"),)) for way in ("PLUS", "MINUS")}
        for key in MOTION_REGISTERS:
            register, trigger = f"M{axis}_{key}", f"AXIS_{key}_TRIG"
            origin = (Resource(ResourceKind.ORIGIN, axis),) if key == "POS_ABS" else ()
            found[register] = WriteUse(origin, MODE, trigger, 1 << int(axis) - 1)
            found[trigger] = WriteUse((Resource(ResourceKind.VALUE, MODE), Resource(ResourceKind.VALUE, register), *origin))
        return found

    def ended_by(self, device: Mic488Device, pdu: bytes) -> tuple[int, ...]:
        try:
            return halted(device.registers, decode_request(pdu))
        except ModbusException:
            return ()


REGISTERS = Mic488Registers()
