"""An M1486 chip as plain data and in words."""

from __future__ import annotations

from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.drive import MotionMode
from steptwin.m1486.encoding import decode
from steptwin.m1486.functions import CARRY, FUNCTIONS, USER_FLAGS
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.program import WaitReason
from steptwin.m1486.registers import GENERAL
from steptwin.m1486.syntax import Command
from steptwin.machine import SECOND, Nanos

_MOTIONS = {MotionMode.MOVE: "move", MotionMode.ENDLESS: "endless move", MotionMode.SEEK: "seek"}


def program_words(chip: M1486Chip, now: Nanos) -> str:
    """What the program of a chip does."""
    program = chip.program
    if chip.is_shut_down:
        return "shut down"
    if program.is_killed:
        return "stopped by Kill (C75 lets it go on)"
    if program.is_limited:
        return "stopped by LIMIT"
    if program.is_halted:
        return "halted"
    if program.waiting is WaitReason.MOTION:
        return f"waits for the end of the {_MOTIONS.get(chip.drive.motion, 'motion')}"
    if program.waiting is WaitReason.LINE:
        return f"waits until B{program.line} is {'high' if program.line_level else 'low'}"
    if program.ready - now > program.statement_ns:
        return f"waits {(program.ready - now) / SECOND:.3f} s more"
    return "has nothing to do" if program.is_at_end else "runs"


def next_command(chip: M1486Chip) -> Command | None:
    """The command the program stands before, None at the end of what is stored."""
    if chip.program.is_at_end or chip.program.pc == chip.memory.end:
        return None
    stored = decode(chip.memory.fetch(chip.program.pc))
    return None if stored is None else stored.command


def used_bits(chip: M1486Chip) -> int:
    """Command memory written since the program's beginning; all of it once the ring has come round (M-12)."""
    memory = chip.memory
    return 8 * (memory.size if memory.begin is None else memory.age(memory.begin))


def velocity(chip: M1486Chip, now: Nanos) -> float:
    """Commanded velocity in full steps per second."""
    return 0.0 if chip.drive.motion is MotionMode.REST else chip.drive.profile.velocity(now) / FULL_STEP


def functions_on(chip: M1486Chip) -> list[int]:
    return [number for number in FUNCTIONS if chip.unit.on(number)]


def flags_on(chip: M1486Chip) -> list[int]:
    flags = [number for number, on in zip(USER_FLAGS, chip.unit.flags, strict=True) if on]
    return [*flags, CARRY] if chip.unit.carry else flags


def state_of(chip: M1486Chip, now: Nanos) -> dict[str, object]:
    """Everything a person asks for, as plain data; positions in minimum microsteps, speeds in full steps per second."""
    drive, following = chip.drive, next_command(chip)
    return {
        "controller": "M1486",
        "time_s": now / SECOND,
        "variant": chip.variant.name,
        "address": f"{chip.address:X}",
        "interface": chip.interface.name,
        "baud": chip.uart.baud,
        "listens": chip.receiver.is_listening,
        "program": {
            "does": program_words(chip, now),
            "next": None if following is None else str(following),
            "memory_bits": used_bits(chip),
            "memory_size_bits": chip.variant.memory_bits,
            "stored_bytes": len(chip.image),
        },
        "input_buffer": {"waiting": chip.receiver.waiting, "size": chip.receiver.waiting + chip.receiver.free},
        "motion": {
            "is": drive.motion.value,
            "position": drive.counter_u(now),
            "position_valid": drive.is_valid,
            "true_position": drive.true_u(now),
            "velocity": velocity(chip, now),
        },
        "settings": {
            "S": drive.start_stop,
            "A": drive.acceleration,
            "P": drive.profile_speed,
            "V": drive.velocity,
            "M": drive.microstep,
            "Q": drive.qualification,
            "N": drive.characteristic,
            "next_distance": drive.distance_u if not drive.endless else None,
            "next_direction": drive.endless or (1 if drive.distance_u >= 0 else -1),
        },
        "variable": chip.unit.variable,
        "remainder": chip.unit.remainder,
        "registers": {str(number): chip.memory.register(number) for number in GENERAL},
        "flags_on": flags_on(chip),
        "functions_on": functions_on(chip),
        "pins": dict(chip.pins()),
    }
