"""The Modbus face of the MIC488: request PDU in, response PDU out.

A request is compiled once into a plan, code without state, that every controller of the firmware shares: which registers it
touches, whether it may, and how their values lie in its bytes. Only values are checked every time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

from steptwin.mic488.core import ControllerCore
from steptwin.mic488.reads import compile_read
from steptwin.mic488.registermap import DataType
from steptwin.mic488.registers import register_map
from steptwin.mic488.writes import WritePlan, compile_coil, compile_registers
from steptwin.wire.pdu import (
    WRITE_MULTIPLE_REGISTERS,
    WRITE_SINGLE_REGISTER,
    ModbusException,
    ReadRequest,
    WriteCoilRequest,
    decode_request,
)

PLANS_KEPT = 4096
"""For all controllers together; then compiling begins anew, so that a master that tries everything fills no memory."""

RequestPlan: TypeAlias = Callable[[ControllerCore], bytes]
"""Serves one request at the controller's present moment."""


class Slave:
    """Serves the requests of a firmware, strict or ``lenient`` (MIC-3)."""

    __slots__ = ("_heads", "_lenient", "_map", "_whole")

    def __init__(self, firmware: str, *, lenient: bool) -> None:
        self._map = register_map(firmware)
        self._lenient = lenient
        # By DATA_TYPE: reads and coil writes by the whole PDU, register writes by the bytes before their values.
        self._whole: tuple[dict[bytes, RequestPlan], ...] = tuple({} for _ in DataType)
        self._heads: tuple[dict[bytes, WritePlan], ...] = tuple({} for _ in DataType)

    def __len__(self) -> int:
        """Plans kept at present."""
        return sum(map(len, self._whole + self._heads))

    def answer(self, device: ControllerCore, pdu: bytes) -> bytes:
        """The response to ``pdu``; a request that cannot be served is answered with its exception."""
        data_type = device.data_type
        try:
            plan = self._whole[data_type].get(pdu)
            if plan is not None:
                return plan(device)
            function = pdu[0] if pdu else 0
            if function in _REGISTER_WRITES:
                writing = self._heads[data_type].get(pdu[:6] if function == WRITE_MULTIPLE_REGISTERS else pdu[:3])
                if writing is not None and writing.length == len(pdu):
                    return writing(device, pdu)
            return self._compiled(DataType(data_type), pdu)(device)
        except ModbusException as refusal:
            return refusal.pdu

    def _compiled(self, data_type: DataType, pdu: bytes) -> RequestPlan:
        request = decode_request(pdu)
        if isinstance(request, ReadRequest):
            plan = compile_read(self._map, request, data_type, lenient=self._lenient)
        elif isinstance(request, WriteCoilRequest):
            plan = compile_coil(self._map, request, pdu, lenient=self._lenient)
        else:
            writing = compile_registers(self._map, request, data_type, lenient=self._lenient)
            _keep(self._heads[data_type], pdu[: writing.head], writing)
            return lambda device: writing(device, pdu)
        _keep(self._whole[data_type], bytes(pdu), plan)
        return plan


_REGISTER_WRITES = frozenset({WRITE_SINGLE_REGISTER, WRITE_MULTIPLE_REGISTERS})


def _keep(plans: dict, key: bytes, plan: object) -> None:
    if len(plans) >= PLANS_KEPT:
        plans.clear()
    plans[key] = plan


@cache
def slave(firmware: str, *, lenient: bool) -> Slave:
    """The slave all controllers of a firmware share. Raises `Misuse` for an unknown firmware."""
    return Slave(firmware, lenient=lenient)
