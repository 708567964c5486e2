"""Requests that write registers of a MIC488 by name."""

from __future__ import annotations

from steptwin.mic488.device import Mic488Device
from steptwin.mic488.registermap import DataType
from steptwin.mic488.values import encoded, named
from steptwin.mic488.writes import permitted
from steptwin.simulation.kinds.kind import NewValues
from steptwin.wire.pdu import MAX_WRITTEN_REGISTERS, ModbusRequest, WriteRegistersRequest, encode_request


def encode_write(device: Mic488Device, values: NewValues) -> tuple[bytes, ...]:
    """The requests that write registers by name; neighbours go together. Raises `Misuse` for what one does not take."""
    requests: list[ModbusRequest] = []
    for register, value in values:
        item = named(device.registers, register)
        axis = item.register.axis
        unit = "u" if axis is None else device.config.axes[axis - 1].unit_name
        request = encoded(item, value, DataType(device.data_type), unit)
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


def check_positions(device: Mic488Device, values: NewValues) -> None:
    """Raises `Misuse` for a position that the controller would ignore, because its pulses do not fit a DINT."""
    data_type = DataType(device.data_type)
    for register, value in values:
        item = named(device.registers, register)
        if item.register.axis is not None:
            axis = device.axes[item.register.axis - 1]
            encoded(item, value, data_type, axis.config.unit_name, permitted(item.register, data_type, axis.gear))
