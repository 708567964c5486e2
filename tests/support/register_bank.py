"""A device to put behind a Modbus port."""

from __future__ import annotations

from steptwin.wire import pdu as modbus


class RegisterBank:
    """A device with plain memory: 3000 coils and registers of its own, function 02 reads the coils inverted."""

    def __init__(self) -> None:
        self.coils = [False] * 3000
        self.registers = list(range(3000))
        self.executed: list[tuple[int, bytes]] = []

    def execute(self, pdu: bytes, now: int) -> bytes:
        self.executed.append((now, pdu))
        try:
            return modbus.encode_response(self._respond(modbus.decode_request(pdu)))
        except modbus.ModbusException as refusal:
            return refusal.pdu

    def _respond(self, request: modbus.ModbusRequest) -> modbus.ModbusResponse:
        match request:
            case modbus.ReadRequest(function, address, count):
                self._check(function, address, count)
                if function == modbus.READ_HOLDING_REGISTERS:
                    return modbus.RegistersResponse(tuple(self.registers[address : address + count]))
                inverted = function == modbus.READ_DISCRETE_INPUTS
                return modbus.BitsResponse(
                    function, modbus.pack_bits(on != inverted for on in self.coils[address : address + count])
                )
            case modbus.WriteCoilRequest(address, on):
                self._check(5, address, 1)
                self.coils[address] = on
                return request
            case modbus.WriteRegisterRequest(address, value):
                self._check(6, address, 1)
                self.registers[address] = value
                return request
            case modbus.WriteRegistersRequest(address, values):
                self._check(16, address, len(values))
                self.registers[address : address + len(values)] = values
                return modbus.WriteResponse(address, len(values))

    def _check(self, function: int, address: int, count: int) -> None:
        if address + count > 3000:
            raise modbus.ModbusException(function, modbus.ILLEGAL_DATA_ADDRESS)
