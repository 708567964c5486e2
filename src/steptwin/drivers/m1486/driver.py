"""The driver of the M1486 for asyncio. `steptwin.drivers.m1486.sync` is the one for threads."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite

from steptwin.drivers.line import check_wait
from steptwin.drivers.m1486.chip import LARGEST, AsyncChip
from steptwin.drivers.m1486.download import DownloadProgress, begin, reset, send_program, type_file
from steptwin.drivers.m1486.failures import Busy, ProgramLost
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.motion import UNKNOWN_S, ChipMotion, ChipMotionCommand, ChipMoveEnd, ChipMoveFailed
from steptwin.drivers.m1486.settings import COMMANDS, checked_number
from steptwin.drivers.m1486.unit import PATIENCE_NS, SLICE_NS
from steptwin.drivers.m1486.waiting import wait_for
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.commands import memory_bits
from steptwin.m1486.functions import FUNCTIONS, RECOVER
from steptwin.m1486.unit import MASK
from steptwin.m1486.variants import Store, Variant
from steptwin.machine import SECOND
from steptwin.messages import Message

MARK = "u15"
"""The last command of a block: uploads the driver interface, a byte that is not a type letter."""
START_BITS = sum(map(memory_bits, ":JU"))
"""What `AsyncM1486.start_program` stores: the label, the jump and the question whether it runs."""
_TYPED = frozenset("abdfghmnpqsv:+-*/<>=tcw!?oz")
"""Commands that may be sent alone: they move nothing, do not jump and are not answered."""
NO_DISTANCE = Message("drivers.m1486.no-distance", "{distance} {unit} is not a distance")
DISTANCE_IS_OUT_OF_RANGE = Message(
    "drivers.m1486.distance-is-out-of-range", "distance {distance:g} {unit} is outside ±{most:g} {unit}"
)


class AsyncM1486(AsyncChip):
    """A chip at an address (``/dev/ttyUSB0``, ``tcp://host:5022``) or on a line shared with others.

    ``address``: 0 to 15, set by the pins; None for the only chip on a line. ``variant``: determined when not given; a type for
    24 MHz responds like the one for 12 MHz and has to be named. Positions are in ``unit`` of ``steps_per_unit`` full steps. The
    position counter has no sign; ``origin_u`` is its value, in minimum microsteps, at position 0.

    The driver switches function 41 (echo) on and 57 (report) off. It sends nothing before `open` (or ``async with``).
    """

    # ------------------------------------------------------------------ motion

    async def move_to(self, position: float) -> None:
        """Begin to move to a position, rounded to a microstep. `wait` waits for the end.

        Raises `Misuse` for a position outside the counter, `Busy`, `PositionUnknown`; `DoubtfulMove` if it is unknown whether
        the move has begun. R is sent only once.
        """
        target = self._counter_of(position)
        unit = self._unit
        permission = unit.permission()
        async with unit.turn(permission):
            before = await unit.read_number(1)
            self._check_position()
            await self._move(f"g{target}" if target else "h", target - before, target, permission)

    async def move_by(self, distance: float) -> None:
        """Begin to move by a distance, rounded to a microstep. Errors as `move_to`."""
        if not isfinite(distance):
            raise Misuse(NO_DISTANCE(distance=distance, unit=self.unit))
        distance_u = self._on_grid(distance, 0)
        if abs(distance_u) > LARGEST:
            raise Misuse(DISTANCE_IS_OUT_OF_RANGE(distance=distance, unit=self.unit, most=LARGEST / self.scale_u))
        unit = self._unit
        permission = unit.permission()
        async with unit.turn(permission):
            before = await unit.read_number(1)
            text = f"{'f' if distance_u > 0 else 'b'}{abs(distance_u)}"
            await self._move(text, distance_u, before + distance_u & MASK, permission)

    async def _move(self, specification: str, distance_u: int, target_u: int, permission: Permission) -> None:
        if distance_u == 0:
            notes = self._unit.notes
            notes.motion = ChipMotionCommand(ChipMotion.MOVE, self.line.now(), notes.stops, target_u, 0.0)
            return
        await self._unit.send(specification)
        duration = self.settings.travel_s(distance_u, self.variant)
        await begin(self._unit, "r", ChipMotion.MOVE, permission, target_u=target_u, duration_s=duration)

    async def run(self, direction: int, velocity: float | None = None) -> None:
        """Run until stopped, in direction +1 or −1; ``velocity`` sets V first (full steps/s)."""
        if direction not in (1, -1):
            raise Misuse(f"direction {direction}: permitted are 1 and -1")
        permission = self._unit.permission()
        if velocity is not None:
            await self.configure(velocity=velocity)
        async with self._unit.turn(permission):
            await self._unit.rest()
            await self._unit.send("g+" if direction > 0 else "g-")
            await begin(self._unit, "r", ChipMotion.ENDLESS, permission)

    def jog(self, velocity: float) -> AsyncM1486Jog:
        """A jog at a velocity (units/s), as long as it is held: ``async with chip.jog(5.0) as jog: while pressed(): await
        jog.hold()``. See `AsyncM1486Jog`."""
        return AsyncM1486Jog(self, velocity)

    async def seek(self, direction: int, line: int) -> None:
        """Begin to move at start/stop speed until a line has its end level: low for B1–3, 8–11, 16–19, else high.

        The number of the line is passed in the internal variable, so that no garbled digit can select another line.
        """
        if direction not in (1, -1):
            raise Misuse(f"direction {direction}: permitted are 1 and -1")
        checked_number(")", line, self.variant, "the line to seek")
        permission = self._unit.permission()
        async with self._unit.turn(permission):
            await self._unit.rest()
            await self._unit.send(f":{line}")
            await begin(self._unit, ")" if direction > 0 else "(", ChipMotion.SEEK, permission)

    async def start_program(self, label: int) -> None:
        """Start the program in the command memory at a label. Its number is passed in the internal variable, as of `seek`.

        It is known where a program leads that was downloaded on this line. Raises `Misuse` where its end can be reached from the
        label: behind it the chip would execute what was sent since, and with that the J that starts it, again and again (M-12).
        Raises `ProgramLost` where what was sent since has overwritten it, and for a chip that is at rest at once, as without the
        label.
        """
        checked_number("j", label, self.variant, "the label")
        unit = self._unit
        permission = unit.permission()
        part = unit.notes.sent.part(label, unit.variant, unit.notes.interface)
        if part is not None and part.has_end:
            raise Misuse(
                f"label {label}: the end of the program can be reached from it; there the chip goes on with what was sent since, "
                "in the end with the J that starts it, again and again (M-12). End it with a loop, such as @9 W1000 J9, or run "
                "it once with download or run_block"
            )
        async with unit.turn(permission):
            await unit.rest()
            spare = None if part is None else unit.spare_bits(part.begins_at)
            if spare is not None and spare < START_BITS:
                raise ProgramLost(f"{self.line.place}: label {label} is not started: {_lost(spare, unit.variant)}")
            await unit.send(f":{label}")
            await begin(unit, "j", ChipMotion.BLOCK, permission, label=label)
            if not await unit.runs_at_once():
                unit.notes.motion = None
                raise ProgramLost(
                    f"{self.line.place}: {unit.name} is at rest: it has no label {label}, or its program has come to its end at "
                    "once; each command that was sent has overwritten the oldest one in its memory"
                )

    async def stop(self) -> bool:
        """Brake with the ramp, and end a program: nothing begins any more that was asked for before, also if this process dies
        now. It precedes all waiting requests; moves that wait for the line are not begun.

        A motion that has begun is ended by K, everything else by wrong data and K in one burst. Returns whether a program that
        ran has ended: False where function 44 is ON or not known (`open_line`). Then the burst is sent twice, because an E type
        may still be writing a motion into its EEPROM, and a program may go on: `stop_program` finds out. Raises
        `steptwin.drivers.Unconfirmed`.
        """
        self._note_stop()
        return await self._unit.kill()

    def _note_stop(self) -> None:
        """Note that the counter does not show the position any more, where a stop cuts a move short (M-16). Nothing is known of
        what a chip does that was not opened."""
        notes = self._unit.notes
        motion = notes.motion
        is_cut = motion is not None and motion.kind in (ChipMotion.MOVE, ChipMotion.BLOCK) and not motion.is_over(self.line.now())
        if is_cut or notes.variant is None:
            notes.is_position_valid = False

    async def recover(self) -> None:
        """Continue what Kill has stopped (C75), if function 51 is OFF. A program may move the motor at once."""
        permission = self._unit.permission()
        async with self._unit.turn(permission):
            await self._unit.act("c75", permission, stored=False)
            self._unit.notes.is_killed = False

    async def stop_program(self, timeout_s: float = 10.0) -> None:
        """End motion and program: the motion by Kill, the program by wrong data (function 44 must be OFF). Nothing is erased.

        What Kill holds (function 51 OFF) is released only where function 44 is known to be OFF, so that nothing of it is left.
        Raises `Busy` if the chip is not at rest then: it is held, which only `recover` (it goes on) or `reset` ends, or goes on,
        and only `reset` or RST helps, and the position is lost.
        """
        unit = self._unit
        notes = unit.notes
        self._note_stop()
        has_ended = await unit.kill(program=True)
        is_held = notes.function(RECOVER) is not True and not has_ended
        # Another stop does not forbid C75: it leaves nothing that could begin.
        permission = Permission(self.line.now, PATIENCE_NS)
        async with unit.turn(permission):
            unit.talk.settle(unit.address)  # questions went with the program
            if has_ended:
                if notes.function(RECOVER) is not True:
                    await unit.act("c75", permission, stored=False)
                notes.is_killed = False
            notes.motion = None
            if await unit.query_type(round(timeout_s * SECOND)) is None:
                if is_held:
                    raise Busy(
                        f"{self.line.place}: {unit.name} is not at rest: Kill holds it (function 51 OFF), its program continues, "
                        "LIMIT is low, or it is still braking. C75 was not sent, because function 44 may be ON and the motor "
                        "would move again: recover lets it go on, reset ends it"
                    )
                raise Busy(f"{self.line.place}: {unit.name} continues: function 44 is ON, LIMIT is low, or it is still braking")

    async def wait(self, timeout_s: float | None = None, *, check: bool = True) -> ChipMoveEnd:
        """Wait until the chip has executed all commands, and return why a motion ended.

        Without ``timeout_s`` the time-out is computed from the motion if all settings are known, else it is a minute. Other
        chips can use the line until shortly before the computed end, and the ends of their moves are watched, too; a wait of
        unknown length keeps the line, except for stops. Raises `ChipMoveFailed` unless the motion ended as intended, and a
        `LineFailure` if the line fails; with ``check`` false both are returned as the end.
        """
        end = await wait_for(self._unit, timeout_s, self.unit, self._shown, check=check)
        if check and not end.ok:
            raise ChipMoveFailed(end)
        return end

    # ------------------------------------------------------------------ commands and programs

    async def command(self, text: str) -> None:
        """Send one command, such as ``t6`` or ``f12800``. Commands that move, jump or answer have methods of their own.

        Raises `Misuse` for a command that the chip would drop.
        """
        await self.commands([text])

    async def commands(self, texts: Iterable[str]) -> None:
        """Send commands one after the other, as `command`, all checked before the first is sent. Behind a stop nothing of them
        is sent."""
        unit = self._unit
        typed = [self.check_command(text) for text in texts]
        permission = unit.permission()
        for command in typed:
            async with unit.turn(permission):
                await unit.rest()
                self._learn(command)
                await unit.act(command, permission, once=command[0] in "d+-*/")
                permission.extend()

    def check_command(self, text: str) -> str:
        """A command as `command` sends it. Raises `Misuse` for others."""
        typed = self._unit.checked(text)
        if typed == "c75":
            raise Misuse(f"{text!r} is not a command to type alone: recover continues what Kill has stopped")
        if typed[0] not in _TYPED:
            raise Misuse(f"{text!r} is not a command to type alone: motions, files and questions have methods of their own")
        return typed

    def _learn(self, typed: str) -> None:
        """Forget a setting that a typed command changes, until it is configured again."""
        notes = self._unit.notes
        name = next((name for name, letter in COMMANDS.items() if letter == typed[0]), None)
        if name is not None:
            notes.settings = notes.settings.with_(**{name: int(typed[1:]) if typed[1:] else None})
        if typed[0] in "tc" and typed[1:].isdecimal() and int(typed[1:]) in FUNCTIONS:
            notes.note_function(int(typed[1:]), on=typed[0] == "t")
        elif typed in ("t", "c"):  # the internal variable has the number
            notes.forget_functions(*FUNCTIONS)

    async def run_block(self, commands: Iterable[str], timeout_s: float | None = None) -> ChipMoveEnd:
        """Have commands done one after the other, as a file in ``[ ]`` that nothing of runs before it is there whole, and wait
        until the last one is done. An upload that is typed as the last of them reports it (manual chapter II, Memory):
        without it the block was cut short (``ChipReason.CUT``), as by a command that is wrong data when it comes to be done.

        Not for E types, which would keep it in their EEPROM. ``timeout_s``: by default a minute. Raises `Misuse` for commands
        that have no place in a block, `FileGivenUp` when it could not be typed whole.
        """
        check_wait(timeout_s)
        unit = self._unit
        if unit.variant.store is Store.EEPROM:
            raise Misuse(f"{unit.variant.title} writes what is in [ ] into its EEPROM: use download")
        typed = [unit.checked(command) for command in commands]
        for command in typed:
            if command[0] in "[]\\kxu" or command == "c75":
                raise Misuse(f"{command!r} has no place in a block")
        if 8 + sum(memory_bits(command[0].upper()) for command in (*typed, MARK)) > unit.variant.memory_bits - 8:
            raise Misuse(f"the block is larger than the command memory of {unit.variant.title}, {unit.variant.memory_bits} bits")
        permission = unit.permission()
        async with unit.turn(permission):
            await unit.rest()
            await type_file(unit, ["[", *typed, MARK, "]"], permission, lambda count: None)
            if unit.notes.motion is not None:
                unit.notes.motion.is_marked = True
        return await self.wait(timeout_s if timeout_s is not None else UNKNOWN_S)

    async def uploaded(self, count: int = 1, timeout_s: float = 10.0) -> bytes:
        """The next bytes that the program of the chip uploads, in order: each ``U`` among its commands sends one (manual
        chapter VII, Upload).

        The program must have been started by this driver, and no other on this line, because bytes carry no sender: else
        `Misuse`. Raises `LineFailure` at the time-out; bytes that have arrived are kept for the next call.
        """
        check_wait(timeout_s)
        unit = self._unit
        if count < 1:
            raise Misuse(f"{count} bytes: at least 1")
        kept = unit.notes.uploads
        if kept is None:
            raise Misuse(f"{self.line.place}: no program of {unit.name} was started here: download or start_program")
        if any(notes.motion is not None and notes.motion.kind is ChipMotion.BLOCK for notes in unit.others()):
            raise Misuse(
                f"{self.line.place}: another chip runs a program too, so that bytes are not attributable: wait for its end"
            )
        limit = self.line.now() + round(timeout_s * SECOND)
        while len(kept) < count:
            async with unit.turn():
                await unit.receive_upload(SLICE_NS)
            if len(kept) < count and self.line.now() >= limit:
                raise LineFailure(f"{self.line.place}: {unit.name} uploaded {len(kept)} of {count} bytes within {timeout_s:g} s")
        found = bytes(kept[:count])
        del kept[:count]
        return found

    async def reset(self, *, force: bool = False) -> None:
        """``\\``: defaults, position 0, and an E type forgets its stored file. Raises `Busy` while the chip does something.

        ``force``: also then; Kill stops its motion first, and an incomplete file in ``[ ]`` is discarded.
        """
        unit = self._unit
        if force:
            await self.stop()
        async with unit.turn():
            if not force:
                await unit.rest()
                await unit.find_interface()
            await reset(unit)

    async def download(self, text: str, *, progress: DownloadProgress | None = None, name: str = "program") -> bytes:
        """Send a program to the chip: a file in ``[ ]``, which runs from ``]`` on and which an E type stores, or plain
        commands.

        An E type is erased before a file. Returns the bytes that ``U`` outside ``[ ]`` uploaded. Raises `Misuse` with the first
        errors of the checker, `NoRoom`, `FileGivenUp`.
        """
        return await send_program({self.address: self._unit, None: self._unit}, text, progress=progress, name=name)


def _lost(spare_bits: int, variant: Variant) -> str:
    size = f"the {variant.memory_bits} bits of the command memory"
    if spare_bits < 0:
        return (
            f"what was sent since the program, questions too, has filled {size} and overwritten its beginning: download it anew"
        )
    return f"the program and what was sent since fill {size} but for {spare_bits}; a start takes {START_BITS}: download it anew"


async def download_to(
    chips: Iterable[AsyncM1486],
    text: str,
    *,
    first: AsyncM1486 | None = None,
    progress: DownloadProgress | None = None,
    name: str = "program",
) -> bytes:
    """Send a program that selects its chips with ``X`` to chips on one line, all of one type.

    ``first`` gets the commands before any ``X``. Errors as of `AsyncM1486.download`.
    """
    units = {chip.address: chip._unit for chip in chips}
    if first is not None:
        units[None] = first._unit
    return await send_program(units, text, progress=progress, name=name)
