"""Every byte of every exchange goes wrong once: no wrong motion, the right error, and the next poll is right again.

The axis stands at 2 mm (200 pulses) before each operation. A single fault must not keep an operation from being done that may
be repeated; one that may not is either done once or not done, and says that this is not known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import pytest
from host_rig import KINDS, Fault, Kind, Wire, driver

from steptwin.drivers import Mic488, NoAnswer
from steptwin.errors import LineFailure
from steptwin.mic488.status import AxisStatus

START_P = 200
POS_ACT = 10020


@dataclass(frozen=True)
class Operation:
    """``done`` and ``undone`` tell by the twin whether it was done exactly once or not at all."""

    do: Callable[[Mic488], object]
    done: Callable[[Wire], bool]
    undone: Callable[[Wire], bool]
    repeatable: bool = True


def target(wire: Wire, axis: int = 1) -> int:
    wire.rest()
    return wire.position(axis)


def still(wire: Wire) -> bool:
    return target(wire) == START_P and target(wire, 2) == 0


def velocity(wire: Wire) -> float:
    wire.rest(0.2)
    return wire.twin.axes[0].profile.velocity(wire.now)


def outputs(wire: Wire) -> list[bool]:
    return list(wire.twin.outputs)


def stop_in_motion(mic: Mic488) -> None:
    mic.axis(1).move_velocity(5.0)
    mic.axis(1).stop()


def read_positions(mic: Mic488) -> None:
    for address, expected in ((POS_ACT, (0, 0x4000)), (POS_ACT + 2, (0, 0)), (POS_ACT, (0, 0x4000))):
        assert mic.registers(address, 2) == expected


OPERATIONS = {
    "read": Operation(read_positions, still, still),
    "move_to": Operation(lambda mic: mic.axis(1).move_to(7.0), lambda w: target(w) == 700, still),
    "move_by": Operation(lambda mic: mic.axis(1).move_by(3.0), lambda w: target(w) == 500, still, repeatable=False),
    "move_velocity": Operation(lambda mic: mic.axis(1).move_velocity(5.0), lambda w: velocity(w) == 500.0, still),
    "home": Operation(
        lambda mic: mic.axis(1).home(-5.0),
        lambda w: target(w) == 0 and w.twin.axes[0].status is AxisStatus.REACHED,
        still,
        repeatable=False,
    ),
    "stop": Operation(
        stop_in_motion,
        lambda w: w.twin.axes[0].status is AxisStatus.ON and not w.moving(),
        lambda w: False,
    ),
    "move_together": Operation(
        lambda mic: mic.move_together({1: 7.0, 2: 4.0}),
        lambda w: target(w) == 700 and target(w, 2) == 400 and w.twin.trigger_mode == 0,
        still,
        repeatable=False,
    ),
    "set_output": Operation(
        lambda mic: mic.set_output(2, True),
        lambda w: outputs(w) == [False, True] + [False] * 6,
        lambda w: not any(outputs(w)),
    ),
}


def ready(*, tcp: bool = False) -> tuple[Wire, Mic488]:
    wire = Wire(tcp=tcp)
    mic = driver(wire)
    mic.enable(1, 2)
    mic.axis(1).set_position(START_P / 100)
    return wire, mic


def cases(operation: Operation, kinds: Iterable[Kind], *, tcp: bool, whole: bool) -> Iterator[Fault]:
    """Faults at every byte; unless ``whole``, not in the read before a motion, which is the same everywhere."""
    wire, mic = ready(tcp=tcp)
    wire.put()
    begin = {"to twin": 0, "to master": 0}
    if not whole:
        mic.axis(1).status()
        begin = dict(wire._passed)
        wire.put()
    operation.do(mic)
    for direction, length in wire._passed.items():
        for index in range(begin[direction] if length > begin[direction] else 0, length):
            for kind in kinds:
                yield Fault(direction, index, kind)  # type: ignore[arg-type]


def check_recovery(wire: Wire, mic: Mic488) -> None:
    """What is read next is right, although answers to other reads of the same kind may still come."""
    wire.put()
    assert mic.registers(POS_ACT + 4, 2) == (0, 0)
    assert mic.get("M2_ACC") == {"M2_ACC": 50.0}
    assert mic.get("M2_VMAX") == {"M2_VMAX": 25.0}
    assert mic.axis(3).position() == 0.0
    assert mic.axis(4).velocity() == 0.0
    assert list(mic.outputs()) == wire.twin.outputs
    wire.rest(10.0)
    status = mic.status()
    assert status.axes == tuple(axis.status for axis in wire.twin.axes)
    assert status.positions == pytest.approx([wire.position(axis) / 100 for axis in (1, 2, 3, 4)], abs=0.2)


def failure_of(operation: Operation, mic: Mic488) -> LineFailure | None:
    try:
        operation.do(mic)
    except LineFailure as failure:
        return failure
    return None


def run(operation: Operation, fault: Fault, *, tcp: bool) -> None:
    wire, mic = ready(tcp=tcp)
    wire.put(fault)
    failure = failure_of(operation, mic)
    if failure is not None:
        assert not operation.repeatable, f"{fault}: {failure}"
        assert isinstance(failure, NoAnswer), f"{fault}: {failure}"
        assert failure.uncertain == ("it is unknown" in str(failure))
        check_recovery(wire, mic)
        assert operation.done(wire) or operation.undone(wire), fault
        if not failure.uncertain:
            assert operation.undone(wire), fault
    else:
        assert operation.done(wire), fault
        check_recovery(wire, mic)
        assert operation.done(wire), fault


FEW_KINDS: tuple[Kind, ...] = ("drop", "too late", "cut")
"""For operations of many exchanges, each of which is the same as in others."""
TIMES: tuple[Kind, ...] = ("late", "too late", "much too late")
"""TCP keeps bytes or loses the connection: only their time can be wrong."""


@pytest.mark.parametrize("name", OPERATIONS)
def test_a_fault_at_every_byte_of_every_exchange_rtu(name: str) -> None:
    kinds = FEW_KINDS if name == "move_together" else KINDS
    faults = list(cases(OPERATIONS[name], kinds, tcp=False, whole=name == "move_to"))
    assert len(faults) >= len(kinds) * 16
    for fault in faults:
        run(OPERATIONS[name], fault, tcp=False)


@pytest.mark.parametrize("name", ["read", "move_to", "move_by"])
def test_a_late_byte_anywhere_tcp(name: str) -> None:
    faults = list(cases(OPERATIONS[name], TIMES, tcp=True, whole=False))
    assert len(faults) >= len(TIMES) * 20
    for fault in faults:
        run(OPERATIONS[name], fault, tcp=True)


@pytest.mark.parametrize("place", ["function", "address", "count"])
def test_an_answer_to_something_else_tcp(place: str) -> None:
    """What a gateway has changed in an answer is found out where the answer says so: as on RTU, it is none."""
    control, written = 7 + 2 + 28, 7 + {"function": 0, "address": 2, "count": 4}[place]
    wire, mic = ready(tcp=True)
    wire.put(Fault("to master", 7, "corrupt"))  # the function of the read before the motion, which is asked again
    mic.axis(1).move_by(1.0)
    assert target(wire) == START_P + 100
    wire.put(Fault("to master", control + written, "corrupt"))
    with pytest.raises(
        NoAnswer, match=r"^memory: no answer to 'unit 1: .*M1_POS_REL.*only 00 .* was received.*it is unknown"
    ) as lost:
        mic.axis(1).move_by(1.0)
    assert lost.value.uncertain
    assert target(wire) == START_P + 200
    check_recovery(wire, mic)
