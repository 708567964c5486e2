"""How long the statements of a WBC program take, where that can be known before.

A statement takes the statement time (WBC-6), DELAY its own. WAITPOS takes until the moves are over, which is known if they began
at rest, a known distance away, with ramps and velocity of the configuration. This is computed for every path: what differs
between paths is not known. It holds as long as no master, interrupt, limit switch or error changes the program or its moves.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

from steptwin.controlflow import ControlFlow
from steptwin.controller import MILLISECOND, Nanos
from steptwin.errors import Misuse
from steptwin.explain.blocks import Timing
from steptwin.explain.model import FlowBlock
from steptwin.mic488.axis import MAX_SPEED_P, SLOWEST_RAMP_P
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.motion.planner import MotionState, plan_position
from steptwin.wbc import steps as s
from steptwin.wbc.positions import PositionTable
from steptwin.wbc.real import real
from steptwin.wbc.registers import ROW_0

AXES = range(1, 5)
_DISTURBING = frozenset({"M", "POSM", "ACCM", "DECM", "VMAXM", "LIMLM", "LIMRM", "ENC"})
_PARAMETERS = frozenset({"ACCM", "DECM", "VMAXM", "LIMLM", "LIMRM", "ENC"})


def move_duration(axis: AxisConfig, distance_p: int) -> Nanos | None:
    """Duration of a move from rest with ramps and velocity of the configuration; None where it cannot be planned."""
    speed, up, down = (value * axis.gear for value in (axis.vel, axis.acc, axis.dec))
    try:
        profile = plan_position(
            MotionState(0, 0, 0.0, 0.0),
            distance_p,
            max(up, SLOWEST_RAMP_P),
            max(down, SLOWEST_RAMP_P),
            min(speed, MAX_SPEED_P),
        )
    except (Misuse, OverflowError, ValueError):
        return None
    return profile.end


class _KnownAxis(NamedTuple):
    """Known state of a drive: whether it is on and at rest, and the position it has or goes to [pulses]."""

    on: bool = False
    at_rest: bool = False
    position_p: int | None = None
    end: Nanos | None = None
    """End of the move in progress, counted from the beginning of the piece; None: not known. Not valid at rest."""

    def joined(self, other: _KnownAxis) -> _KnownAxis:
        same = self.position_p if self.position_p == other.position_p else None
        return _KnownAxis(self.on and other.on, self.at_rest and other.at_rest, same)


_State = tuple[_KnownAxis, ...]
_UNKNOWN: _State = (_KnownAxis(),) * len(AXES)
_AT_START: _State = (_KnownAxis(at_rest=True),) * len(AXES)


class Durations:
    """``timing`` gives those of a block. Without a configuration no move is known."""

    def __init__(
        self,
        executable: s.Executable,
        flow: ControlFlow,
        config: ControllerConfig | None,
        positions: PositionTable | None,
        statement_time: Nanos,
    ) -> None:
        self._steps = executable.steps
        self._positions = positions if not executable.position_records else None
        self._statement_time = statement_time
        handlers = flow.reached(executable.entries.values())
        self._config = None if config is None or self._disturb(handlers) else config
        self._changed = {number for number in AXES if any(self._changes(step, number) for step in self._steps)}
        self._row_0_is_written = any(isinstance(step, s.SetStep) and _is_row_0(step.target) for step in self._steps)
        self._moved_axes = {number for step in self._steps for number, *_ in self._targets(step)}

    def _disturb(self, handlers: Collection[int]) -> bool:
        """Whether an interrupt moves or changes drives."""
        found = [self._steps[number] for number in handlers if number < len(self._steps)]
        moves = any(step.effect().on_drives or _register(step) in _DISTURBING for step in found)
        return moves or len(self._steps) in handlers

    @staticmethod
    def _changes(step: s.ProgramStep, number: int) -> bool:
        return isinstance(step, s.SetStep) and _register(step) in _PARAMETERS and _number(step) == number

    def timings(self, flow: ControlFlow, blocks: Sequence[FlowBlock]) -> list[Timing]:
        """Durations of all steps; those that cannot be reached take the statement time."""
        entered = self._entered(flow, blocks)
        found = [Timing(self._statement_time)] * len(self._steps)
        for block in blocks:
            state, passed = entered.get(block.first, _UNKNOWN), 0
            for number in range(block.first, block.last + 1):
                timing, state = self._step(self._steps[number], state, passed)
                found[number] = timing
                passed += timing.duration or 0
        return found

    def _entered(self, flow: ControlFlow, blocks: Sequence[FlowBlock]) -> dict[int, _State]:
        """Known states of the drives when a block begins, on every path."""
        by_first = {block.first: block for block in blocks}
        entered: dict[int, _State] = {block.first: _UNKNOWN if block.first else _AT_START for block in blocks if block.is_entry}
        work = list(entered)
        while work:
            first = work.pop()
            state = self._after(by_first[first], entered[first])
            for target in flow.next[by_first[first].last]:
                if target not in by_first:
                    continue
                before = entered.get(target)
                joined = state if before is None else tuple(a.joined(b) for a, b in zip(before, state, strict=True))
                if joined != before:
                    entered[target] = joined
                    work.append(target)
        return entered

    def _after(self, block: FlowBlock, state: _State) -> _State:
        passed = 0
        for number in range(block.first, block.last + 1):
            timing, state = self._step(self._steps[number], state, passed)
            passed += timing.duration or 0
        return tuple(axis.joined(axis) for axis in state)

    # ------------------------------------------------------------------ one statement

    def _step(self, step: s.ProgramStep, state: _State, passed: Nanos) -> tuple[Timing, _State]:
        """Its timing, and what is known after it. ``passed``: since the beginning of the block."""
        own, effect = Timing(self._statement_time), step.effect()
        if step.waits is s.StepWait.TIME:
            return self._delay(step, state)
        if step.waits is s.StepWait.CONDITION:
            return Timing(self._statement_time, "its condition"), _moments_lost(state)
        if step.waits is s.StepWait.MOTION:
            return self._wait(state, passed)
        if effect.everything:
            return own, _UNKNOWN
        if effect.on_drives:
            return own, self._moved(step, state, passed)
        if isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand) and step.target.row.key in ("M", "POSM"):
            return own, self._set(step, step.target.row.key, step.target.number, state)
        return own, state

    def _delay(self, step: s.ProgramStep, state: _State) -> tuple[Timing, _State]:
        match step.sources():
            case (s.Literal(value=seconds),):
                whole = round(max(seconds, s.SHORTEST_DELAY_S) * 1000.0) * MILLISECOND
                return Timing(max(self._statement_time, whole)), state
        return Timing(None, "the time of DELAY"), _moments_lost(state)

    def _wait(self, state: _State, passed: Nanos) -> tuple[Timing, _State]:
        rested = tuple(axis._replace(at_rest=axis.on, end=None) for axis in state)
        moving = [state[number - 1] for number in self._moved_axes if not state[number - 1].at_rest]
        if any(axis.end is None for axis in moving):
            return Timing(self._statement_time, "the end of the motion"), rested
        left = max(((axis.end or 0) - passed for axis in moving), default=0)
        looks = max(0, -(-left // self._statement_time)) if self._statement_time else 0
        return Timing((looks + 1) * self._statement_time), rested

    def _set(self, step: s.SetStep, key: str, number: int, state: _State) -> _State:
        value = step.value.value if isinstance(step.value, s.Literal) else None
        axis = state[number - 1]
        if key == "M":
            axis = axis._replace(on=True) if value else _KnownAxis(at_rest=value == 0)
        else:
            known = None if value is None or self._config is None or not axis.at_rest else value
            gear = 1.0 if self._config is None else self._config.axes[number - 1].gear
            axis = axis._replace(position_p=None if known is None else _pulses(known, gear))
        return (*state[: number - 1], axis, *state[number:])

    def _moved(self, step: s.ProgramStep, state: _State, passed: Nanos) -> _State:
        axes = list(state)
        for number, target_u, is_relative in self._targets(step):
            axes[number - 1] = self._move(number, axes[number - 1], target_u, passed, is_relative=is_relative)
        return tuple(axes)

    def _targets(self, step: s.ProgramStep) -> Iterable[tuple[int, float | None, bool]]:
        """Drives, each with its known target or distance. Without one, and relative: homing."""
        match step:
            case s.MotionStep(keyword="PABS" | "PREL" as keyword, axis=number, value=s.Literal(value=value)):
                return [(number, value, keyword == "PREL")]
            case s.MotionStep(keyword="HOME", axis=number, value=s.Literal(value=value)) if value:
                return [(number, None, True)]
            case s.RowMotionStep(keyword="MOVEPTP", row=s.Literal(value=index)) if self._knows_row(index):
                values = () if self._positions is None else self._positions.rows[int(index)].values
                return [(number, value, False) for number, value in zip(AXES, values, strict=True) if value is not None]
        effect = step.effect()
        return [(number, None, False) for number in AXES if effect.any_drive or number == effect.drive]

    def _knows_row(self, index: float) -> bool:
        if index == 0 and self._row_0_is_written:
            return False
        return self._positions is not None and index == int(index) and 0 <= index < len(self._positions.rows)

    def _move(self, number: int, axis: _KnownAxis, target_u: float | None, passed: Nanos, *, is_relative: bool) -> _KnownAxis:
        unknown = _KnownAxis(on=axis.on)
        if target_u is None and is_relative:
            return unknown._replace(position_p=0)  # HOME ends there
        if target_u is None or self._config is None or number in self._changed or not axis.on:
            return unknown
        config = self._config.axes[number - 1]
        if config.pos_ctrl_mode or (not axis.at_rest and is_relative):
            return unknown
        target = _pulses(target_u, config.gear)
        start = 0 if is_relative else axis.position_p
        duration = None if start is None or not axis.at_rest else move_duration(config, target - start)
        position = target if not is_relative else None if axis.position_p is None else axis.position_p + target
        return _KnownAxis(on=True, position_p=position, end=None if duration is None else passed + duration)


def _moments_lost(state: _State) -> _State:
    """After a wait it is not known when moves end that were in progress."""
    return tuple(axis._replace(end=None) for axis in state)


def _pulses(value_u: float, gear: float) -> int:
    return round(real(value_u) * gear)


def _register(step: s.ProgramStep) -> str:
    return step.target.row.key if isinstance(step, s.SetStep) and isinstance(step.target, s.RegisterOperand) else ""


def _number(step: s.SetStep) -> int:
    return step.target.number if isinstance(step.target, s.RegisterOperand) else 0


def _is_row_0(target: s.AssignmentTarget) -> bool:
    return isinstance(target, s.RegisterOperand) and target.row.key in ROW_0
