"""One chip on a line: commands, answers, and the state that drivers of the same chip share.

All exchanges except stops take turns (`ChipUnit.turn`): while an answer is pending, no other chip is addressed, because a
byte does not identify its sender. A stop interrupts a turn.
"""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager, suppress

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers.exchange import Job, NoAnswer, Overtaken, SentLate, TooLate
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.failures import Busy, Garbled, NoEcho, Restarted, SeveralChips, WrongType, unconfirmed
from steptwin.drivers.m1486.linecount import find_chips
from steptwin.drivers.m1486.lines import TALK
from steptwin.drivers.m1486.motion import ChipMotion
from steptwin.drivers.m1486.sharedstate import FUNCTION_BYTES, SharedChipState
from steptwin.drivers.m1486.talk import INVALID_COMMAND, TYPE_QUERY, CharacterTalk, ChipRequest, ChipRequestKind, chip_name
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.commands import memory_bits
from steptwin.m1486.functions import CONTINUE, RECOVER, REPORT, RETURN
from steptwin.m1486.lines import INTERFACES, Interface
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import parse_line
from steptwin.m1486.variants import VARIANTS, Variant
from steptwin.messages import Message, MessageText

TRIES = 3
STOP_TRIES = 5
"""Number of attempts for a stop."""
PAUSES_NS: tuple[Nanos, ...] = (0, 40 * MILLISECOND, 1300 * MILLISECOND)
"""Time for the execution of ``t41``, ns: first without it, for a chip that echoes already; the last is for chips that write
commands into an EEPROM."""
WAKE_COMMANDS = 2
"""Number of commands that `ChipUnit.wake` sends at most, and that a chip stores."""
SELECT_ALL = "xg\rxg\r"
"""Selects all chips. The first line may end the rest of another command."""
PATIENCE_NS: Nanos = 10 * SECOND
"""A motion is not begun after this time without progress towards it, ns."""
SLICE_NS: Nanos = 20 * MILLISECOND
"""Waiting for a pending answer is interrupted for stops at this interval, ns."""
BEGUN_NS: Nanos = 100 * MILLISECOND
"""A chip has begun a motion so long after its command was sent, and, of an E type, written, ns."""
STOP = f"{INVALID_COMMAND.decode()}\rk"
"""Wrong data and Kill in one burst (M-11, M-27). The wrong data lie behind everything that the chip has received. They drop
what of it has not begun when they are read, at the latest after the motion that Kill ends: also what is being written into an
EEPROM."""
LONGEST_WRITE_NS: Nanos = max(variant.write_ns for variant in VARIANTS)
ASK_AGAIN_NS: Nanos = SECOND
"""First interval of further queries of a program that does not end, ns; it doubles each time."""
_NAMES = {variant.type_letter: variant.name for variant in reversed(VARIANTS)}
DONE_NS: Nanos = 20 * MILLISECOND
"""A chip at rest has executed a command so long after its CR, ns."""
RUNS_NS: Nanos = 60 * MILLISECOND
"""The time in which a chip at rest answers, with adapters that delay bytes, ns."""
READINGS = 4
"""Number of attempts to read the same value twice."""

IS_BUSY = Message("drivers.m1486.is-busy", "{place}: {chip} {why}")
IS_HELD_BY_KILL = Message(
    "drivers.m1486.is-held-by-kill",
    "is held by Kill because its function 51 is OFF: recover it; a program of it then continues",
)
IS_NOT_DONE = Message("drivers.m1486.is-not-done", "is not done with {motion}: wait for its end or stop it")
DOES_NOT_ANSWER_YET = Message(
    "drivers.m1486.does-not-answer-yet", "does not answer yet: it moves or waits, its program runs, or LIMIT holds it"
)


IS_NOT_OPEN = Message("drivers.m1486.is-not-open", "{place}: {chip} is not open")
UNKNOWN_NUMBER_OF_CHIPS = Message(
    "drivers.m1486.unknown-number-of-chips",
    "{place}: the answers do not show how many chips there are: name the address of the chip",
)
NOT_ALONE_ON_ITS_LINE = Message(
    "drivers.m1486.not-alone-on-its-line", "{place}: a chip without address has to be the only one on its line"
)
UNKNOWN_TYPE_LETTER = Message(
    "drivers.m1486.unknown-type-letter", "{place}: {chip} reports the type letter {letter:02X}H, which no M1486 has"
)
REPORTS_ANOTHER_TYPE = Message(
    "drivers.m1486.reports-another-type", "{place}: {chip} reports that it is an M1486{letter}, not {title}"
)


class ChipUnit:
    """The chip with ``address`` on ``line``; None: the only one, which needs no selection."""

    def __init__(self, line: DriverLine[ChipRequest, bytes], address: int | None, *, timeout_ns: Nanos) -> None:
        self.line = line
        self.address = address
        self.timeout_ns = timeout_ns
        self.talk: CharacterTalk = line.shared[TALK]
        known = line.shared.setdefault("m1486 chips", set())
        if (None in known) is not (address is None) and known:
            raise Misuse(NOT_ALONE_ON_ITS_LINE(place=line.place))
        known.add(address)
        self.shared: SharedChipState = line.shared.setdefault(("m1486", address), SharedChipState())

    @property
    def name(self) -> str:
        return chip_name(self.address)

    @property
    def _pin_address(self) -> int | None:
        """The address that the pins select; None for the only chip before it was found."""
        return self.talk.only if self.address is None else self.address

    @property
    def place(self) -> str:
        return self.line.place

    @property
    def is_alone(self) -> bool:
        """Whether the line has no driver of another chip."""
        return len(self.line.shared["m1486 chips"]) == 1

    @property
    def write_ns(self) -> Nanos:
        """Time for writing a command into the EEPROM, ns; 0 without EEPROM or if unknown."""
        return 0 if self.shared.variant is None else self.shared.variant.write_ns

    @property
    def variant(self) -> Variant:
        if self.shared.variant is None:
            raise Misuse(IS_NOT_OPEN(place=self.place, chip=self.name))
        return self.shared.variant

    def turn(self, permission: Permission | None = None) -> AbstractAsyncContextManager[object]:
        """Hold the line for exchanges that belong together. Waiting for it extends ``permission``."""
        return self.line.lock("m1486 turn", None if permission is None else permission.extend)

    def permission(self, patience_ns: Nanos | None = None) -> Permission:
        """Permission for a motion requested now. It ends with a stop of the chip, or after too long without progress. While a
        stop is not acknowledged there is none."""
        shared = self.shared
        before = None if shared.pending_stops else shared.stops
        if patience_ns is None:
            patience_ns = max(PATIENCE_NS, 4 * TRIES * self.timeout_ns)
        return Permission(self.line.now, patience_ns, lambda: shared.stops != before)

    # ------------------------------------------------------------------ exchanges

    async def _exchange(
        self,
        request: ChipRequest,
        *,
        timeout_ns: Nanos | None = None,
        urgent: bool = False,
        permission: Permission | None = None,
    ) -> bytes:
        job: Job[ChipRequest, bytes] = Job(
            request, self.timeout_ns if timeout_ns is None else timeout_ns, urgent=urgent, permission=permission
        )
        return await self.line.exchange(job)

    async def _blind(self, text: str, pause_ns: Nanos, *, urgent: bool = False) -> None:
        with suppress(NoAnswer):
            await self._exchange(ChipRequest(self.address, text, sort=ChipRequestKind.BLIND), timeout_ns=pause_ns, urgent=urgent)

    async def wake(self, before: str = "") -> None:
        """Select the chip and have it echo, which verifies the selection. ``before`` is sent first. Raises `NoEcho`.

        A chip that echoes already stores nothing of that: ``t41`` is sent only to one that does not.
        """
        failure: LineFailure | None = None
        for attempt, pause in enumerate(PAUSES_NS):
            try:
                await self._verify_echo(f"{before}{SELECT_ALL}" + (f"t{RETURN}\r" if attempt else ""), pause)
            except (NoAnswer, Garbled) as error:
                failure = error
                # What was not echoed lacks only its CR. To spoil it would end a program that runs (M-11).
                before = "\r" if isinstance(error, NoAnswer) else ""
                continue
            if attempt:
                self._written()
            return
        # A chip that is missing must not leave the others without selection.
        await self._blind(f"{before}{SELECT_ALL}", PAUSES_NS[1])
        self.talk.only = None
        raise NoEcho(self.place, self.name, failure) from failure

    async def _verify_echo(self, text: str, pause: Nanos) -> None:
        """Send ``text``, which selects all chips, and select this one. Nothing of that is stored. Raises `NoAnswer`, `Garbled`.

        The selection is sent three times: once without looking, so that only this chip listens and echoes; once to be echoed,
        although the rest of a garbled line may precede it; and once behind a line that was echoed to its end.
        """
        address = self._pin_address
        select = "xg" if address is None else f"x{address:x}"
        await self._blind(text if address is None else f"{text}{select}\r", pause)
        await self._exchange(ChipRequest(self.address, select, acts=False))
        self.talk.echoing.add(self.address)
        self.shared.was_awake = True

    async def _ready(self) -> None:
        """Wait until the chip echoes, is the only one where it has no address, and its EEPROM is free."""
        restarted, self.shared.restarted = self.shared.restarted, None
        if restarted is not None:
            raise restarted
        rest = self.shared.ready_at - self.line.now()
        if rest > 0:
            await self.line.sleep(rest / SECOND)
        if not self.talk.knows(self.address):
            await self._wake_again()
            await self._ready()
        elif self.address is None and self.talk.only is None:
            await self._find_the_only_one()

    async def _wake_again(self) -> None:
        """Raises `Restarted` for a chip that does not echo any more: its settings are lost. (The line may also have failed.)"""
        known = self.shared.was_awake
        if known and await self._still_echoes():
            return
        await self.wake("\r" if known else "")
        if known:
            self.shared.forget()
            raise Restarted(self.place, self.name)

    async def _still_echoes(self) -> bool:
        for _ in range(TRIES):
            try:
                await self._verify_echo(SELECT_ALL, PAUSES_NS[1])
            except Garbled:
                continue
            except NoAnswer:
                return False
            return True
        return False

    async def _find_the_only_one(self) -> None:
        """Find the chip that is addressed without an address, and select it, so that no other one can hear anything. The chip
        stores one command. Raises `SeveralChips`; `LineFailure` where the line does not show how many there are."""
        for _ in range(TRIES):
            found = await find_chips(self._probe)
            self.talk.note_stored(None, TYPE_QUERY)
            if len(found.addresses) > 1 or found.letters > 1:
                self.talk.forget(None)
                raise SeveralChips(self.place, found.addresses)
            if len(found.addresses) == 1:
                (address,) = found.addresses
                await self._exchange(ChipRequest(address, "", sort=ChipRequestKind.SELECT))
                self.talk.only = address
                if not found.letters:
                    self.talk.owed[None] = 1
                    self.shared.asked_at = self.line.now()
                return
        self.talk.forget(None)
        raise LineFailure(UNKNOWN_NUMBER_OF_CHIPS(place=self.place))

    async def _probe(self, text: str, patience_ns: Nanos) -> bytes:
        """Send ``text``, and return everything that comes back within ``patience_ns`` after it."""
        try:
            return await self._exchange(ChipRequest(None, text, sort=ChipRequestKind.PROBE), timeout_ns=patience_ns)
        except NoAnswer as silence:
            return silence.received

    def _written(self) -> None:
        """Register a command in the memory. While the type is unknown, no more is sent than the input buffer holds."""
        if self.shared.variant is not None:
            self.shared.ready_at = self.line.now() + self.shared.variant.write_ns

    async def send(
        self,
        text: str,
        *,
        once: bool = False,
        acts: bool = False,
        retype: bool = True,
        answers: bool = False,
        permission: Permission | None = None,
        stored: bool = True,
    ) -> bytes:
        """Send a command. ``once``: CR is sent only once, because executing it twice is not the same. ``acts``: a garbled
        command may have acted, even if it is sent correctly afterwards. ``retype``: it may be sent again before its CR.
        ``stored``: the command goes into the memory, which takes time on an E type. Raises `NoRoom`, `Garbled` or `NoAnswer`;
        with ``uncertain`` set the chip may have executed it."""
        tries = 0
        while True:
            await self._ready()
            self.shared.note_command(text)
            request = ChipRequest(self.address, text, answers=answers, acts=once or acts)
            try:
                answer = await self._exchange(request, permission=permission, timeout_ns=self._patience(answers))
            except (Garbled, NoAnswer) as error:
                tries += 1
                if isinstance(error, NoAnswer) and not request.committed:
                    self.talk.forget(self.address)
                if tries == TRIES or (request.committed and once) or (request.commented and request.acts) or not retype:
                    raise
                continue
            if stored and not answers:
                self._written()  # a command that was answered is in the EEPROM
            return answer

    async def act(
        self,
        text: str,
        permission: Permission,
        *,
        once: bool = False,
        retype: bool = True,
        stored: bool = True,
    ) -> None:
        """Send a command that may move the motor, as `send`. If the permission has ended, the chip drops it.

        Raises `Overtaken`, `TooLate`; `SentLate` when it was sent too late, and then the motor was stopped.
        """
        shared, write_ns = self.shared, self.write_ns if stored else 0
        try:
            await self.send(text, once=once, acts=True, permission=permission, retype=retype, stored=stored)
        except (Overtaken, TooLate):
            await self.drop_line()
            raise
        except SentLate:
            shared.begins_at = self.line.now() + write_ns
            shared.is_position_valid = False
            await self.kill()
            raise
        except LineFailure:  # it may be there even so
            shared.begins_at = self.line.now() + write_ns
            raise
        shared.begins_at = self.line.now() + write_ns

    def _patience(self, answers: bool) -> Nanos:
        """The time to wait for an answer, ns: it may have to wait for the EEPROM; for an unknown type, for all commands of
        `wake`, and for one more question."""
        variant = self.shared.variant
        write_ns = (WAKE_COMMANDS + 2) * LONGEST_WRITE_NS if variant is None else variant.write_ns
        return self.timeout_ns + write_ns if answers else self.timeout_ns

    def checked(self, text: str) -> str:
        """A command as it is sent. Raises `Misuse` for one that the chip would drop."""
        line, found = parse_line(text)
        command = line.command
        if command is None:
            raise Misuse(f"{text!r} is not a command{f': {found[0].message}' if found else ''}")
        why = out_of_range(command, self.variant)
        if why is not None:
            raise Misuse(why)
        return str(command).lower()

    # ------------------------------------------------------------------ state and identity

    async def query_type(self, patience_ns: Nanos = 0, permission: Permission | None = None) -> int | None:
        """The type letter, which the chip sends when it has executed all commands; None if not within ``patience_ns`` or a
        time-out.

        Waiting for it extends ``permission``.
        """
        patience_ns = max(patience_ns, self._patience(True))
        if not self.talk.owes(self.address):
            await self.ask()
        letter = await self._listen(patience_ns, permission)
        if letter is None and self._is_query_gone():
            await self.ask()
            letter = await self._listen(self._patience(True))
        if letter is not None:
            await self._note_rest()
        return letter

    async def _note_rest(self) -> None:
        """Register that the chip has answered."""
        await self._receive_rest()
        self.shared.is_killed = False
        self.shared.is_at_rest = True
        if self.talk.uploads is self.shared.uploads:
            self.talk.uploads = None

    async def runs_at_once(self) -> bool:
        """Whether the chip, which was at rest, is busy with what it was just sent: a question that follows is not answered."""
        await self.line.sleep(DONE_NS / SECOND)  # what is wrong data drops a question that is there already (M-11)
        for _ in range(2):  # a program may upload what looks like a letter
            if not self.talk.owes(self.address):
                await self.ask()
            if await self._listen(RUNS_NS + self.write_ns) is None:
                return True
        await self._note_rest()
        return False

    def _is_near_its_end(self) -> bool:
        """Whether the motion was stopped by this program, or should have ended as computed."""
        motion = self.shared.motion
        if motion is None:
            return False
        return motion.stops != self.shared.stops or (motion.duration_s is not None and self.line.now() >= motion.end)

    def _is_query_gone(self) -> bool:
        """Whether a query that was not answered in time is to be repeated: the answer may have been lost, or the query with a
        program that wrong data have ended (`should_ask_again`)."""
        motion = self.shared.motion
        if motion is not None and motion.kind is ChipMotion.BLOCK:
            return self.should_ask_again(ASK_AGAIN_NS)
        return self.talk.owes(self.address) == 1

    def should_ask_again(self, interval_ns: Nanos) -> bool:
        """Whether to query a program that has not ended once more; ``interval_ns``: from the first query to the second.

        Wrong data that end it drop the queries received before, too (M-11). They stay in the input buffer as long as it runs, so
        they become rarer and rarer, and one more fits in the end.
        """
        owed = self.talk.owes(self.address)
        most = self.variant.input_bits // (8 * (len(TYPE_QUERY) + 1)) - 1
        is_due = 0 < owed < most and self.line.now() >= self.shared.asked_at + (interval_ns << owed - 1)
        return is_due and self.has_room_for_questions(1)

    async def _receive_rest(self) -> None:
        """Receive the second letter of a chip that was asked twice, so that it is not taken for the next answer."""
        talk = self.talk
        if talk.surplus:
            listening = ChipRequest(self.address, TYPE_QUERY, sort=ChipRequestKind.LISTEN)
            with suppress(NoAnswer):
                while talk.surplus:
                    await self._exchange(listening, timeout_ns=self._patience(True))
            talk.surplus = 0  # lost, or of a chip that is asked no more

    async def ask(self) -> None:
        """Request the type letter, which the chip sends when it has executed all commands."""
        self.talk.arrived.pop(self.address, None)
        await self.send(TYPE_QUERY)
        shared = self.shared
        shared.asked_at = self.line.now()
        if shared.motion is not None and shared.motion.asked_at is None:
            shared.motion.asked_at = shared.asked_at

    async def _listen(self, patience_ns: Nanos, permission: Permission | None = None) -> int | None:
        """Wait for a pending letter, in slices that stops can interrupt."""
        talk = self.talk
        limit = self.line.now() + patience_ns
        while self.address not in talk.arrived:
            listening = ChipRequest(self.address, TYPE_QUERY, sort=ChipRequestKind.LISTEN)
            try:
                return (await self._exchange(listening, timeout_ns=SLICE_NS))[0]
            except NoAnswer:
                if permission is not None:
                    permission.extend()
                if self.line.now() >= limit:
                    return talk.arrived.pop(self.address, None)
                if not talk.owes(self.address):  # a stop has dropped the question
                    await self.ask()
                elif self._is_near_its_end() and talk.owes(self.address) == 1 and self.should_ask_again(ASK_AGAIN_NS):
                    await self.ask()  # its letter may have been taken for that of another chip
        return talk.arrived.pop(self.address)

    async def receive_letter(self, patience_ns: Nanos) -> None:
        """Wait for a pending letter of any chip (`CharacterTalk.letters`)."""
        with suppress(NoAnswer):
            await self._exchange(ChipRequest(self.address, TYPE_QUERY, sort=ChipRequestKind.LETTER), timeout_ns=patience_ns)

    async def receive_upload(self, patience_ns: Nanos) -> None:
        """Wait for bytes that a program uploads."""
        with suppress(NoAnswer):
            await self._exchange(ChipRequest(self.address, "", sort=ChipRequestKind.UPLOAD), timeout_ns=patience_ns)

    def others(self) -> list[SharedChipState]:
        """The shared state of the other chips on the line."""
        return [self.line.shared[("m1486", address)] for address in self.line.shared["m1486 chips"] if address != self.address]

    async def rest(self) -> int:
        """Check that the chip is at rest; returns its type letter. Raises `Busy` if it is not, `WrongType` if it has another
        type."""
        letter = await self.query_type()
        if letter is None:
            raise Busy(IS_BUSY(place=self.place, chip=self.name, why=self.why_busy()))
        shared = self.shared
        if shared.variant is None or letter == shared.variant.type_letter:
            return letter
        (letter,) = await self.read(20, rests=True)
        if letter != shared.variant.type_letter:
            raise WrongType(
                REPORTS_ANOTHER_TYPE(place=self.place, chip=self.name, letter=_NAMES.get(letter, "?"), title=shared.variant.title)
            )
        return letter

    def why_busy(self) -> MessageText:
        if self.shared.is_killed and self.shared.function(RECOVER) is False:
            return IS_HELD_BY_KILL()
        if self.shared.motion is not None:
            return IS_NOT_DONE(motion=self.shared.motion.kind.value)
        return DOES_NOT_ANSWER_YET()

    # ------------------------------------------------------------------ reading

    async def read(self, *numbers: int, rests: bool = False) -> tuple[int, ...]:
        """Read bytes by their numbers of ``U``, until they are the same twice: the line has no checksum, and a counter may
        change between its bytes. Raises `Busy` unless the chip is at rest; ``rests``: it is known to be."""
        if not rests:
            await self.rest()
        before: tuple[int, ...] | None = None
        for _ in range(READINGS):
            found = tuple([(await self.send(f"u{number}", answers=True))[0] for number in numbers])
            if found == before:
                self.shared.note_readings(numbers, found)
                return found
            before = found
        raise self._differs(*numbers)

    def _differs(self, *numbers: int) -> LineFailure:
        return LineFailure(f"{self.place}: {self.name}: what U{' U'.join(map(str, numbers))} sends differs at every reading")

    async def read_number(self, first: int, *, rests: bool = False) -> int:
        """Read 24 bits from byte ``first`` on."""
        low, middle, high = await self.read(first, first + 1, first + 2, rests=rests)
        return low | middle << 8 | high << 16

    async def look(self) -> None:
        """Find the type of the chip, and functions 40 to 47: what a stop ends depends on 44. Nothing else is asked, because each
        question takes a place in the command memory, in which most types have their program."""
        shared = self.shared
        letter = await self.rest()
        for again in range(READINGS):
            before = letter
            (letter,) = await self.send(TYPE_QUERY, answers=True)
            if letter not in _NAMES and not again:
                # Function 57 reports an empty input buffer before each answer, which is still to come.
                self.talk.surplus += 1
                await self._receive_rest()
                await self.send(f"c{REPORT}")
                await self.line.sleep((RUNS_NS + max(one.write_ns for one in VARIANTS)) / SECOND)
            elif letter == before:
                break
        else:
            raise self._differs(20)
        if letter not in _NAMES:
            raise WrongType(UNKNOWN_TYPE_LETTER(place=self.place, chip=self.name, letter=letter))
        if shared.variant is None:
            shared.variant = next(variant for variant in VARIANTS if variant.type_letter == letter)
        await self.read(FUNCTION_BYTES[0], rests=True)

    async def find_interface(self) -> Interface | None:
        """The driver interface, which pins select; None for a number that no interface has. The chip is at rest."""
        shared = self.shared
        if shared.interface is None:
            (code,) = await self.read(15, rests=True)
            shared.interface = next((interface for interface in INTERFACES if interface.code == code), None)
        return shared.interface

    async def reading(self, *numbers: int) -> tuple[int, ...]:
        """Bytes as they were read since the last command; others are read now. Raises `Busy`."""
        known = self.shared.readings
        if not (self.shared.is_at_rest and known.keys() >= set(numbers)):
            await self.read(*numbers)
        return tuple(known[number] for number in numbers)

    async def greet(self) -> None:
        """Check by its echo that the chip is still there; it stores nothing. Raises `Restarted`, `LineFailure`."""
        await self._ready()
        try:
            await self._exchange(ChipRequest(self.address, f"x{self._pin_address:x}", acts=False))
        except (Garbled, NoAnswer):
            self.talk.forget(self.address)
            await self._ready()

    # ------------------------------------------------------------------ the command memory

    @property
    def stored_bits(self) -> int:
        """The bits of commands that were sent to the chip since the line was made."""
        return self.talk.stored_bits(self.address)

    def spare_bits(self, begins_at: int | None = None) -> int | None:
        """The bits that can still be sent before a downloaded program is overwritten, negative if it is; None where no program
        is known. ``begins_at``: the bits that had been sent before its first command, by default of the oldest."""
        size = self.variant.memory_bits
        begins_at = self.shared.sent.begins_at(self.stored_bits - size) if begins_at is None else begins_at
        return None if begins_at is None else size - (self.stored_bits - begins_at)

    def has_room_for_questions(self, count: int) -> bool:
        """Whether so many questions overwrite no program that is known."""
        spare = self.spare_bits()
        return spare is None or spare >= count * memory_bits("U")

    # ------------------------------------------------------------------ stopping

    async def drop_line(self) -> None:
        """Make the chip drop characters sent without CR: the next CR on the line would execute them."""
        if self.talk.dirty:
            with suppress(NoAnswer, Garbled, Misuse):  # a stop that went first has spoilt them: there is nothing to send
                await self._exchange(ChipRequest(self.address, "", sort=ChipRequestKind.SELECT))

    async def kill(self, *, program: bool = False) -> bool:
        """Stop before all waiting requests, so that nothing begins that was asked for before.

        K is enough for a motion of this line that has begun, because the chip was at rest before it; everything else, and with
        ``program`` in any case, is ended by `STOP`. Where wrong data may end nothing (function 44 is ON or not known), it is sent
        again when what may lie in an EEPROM has begun, and only that confirms the stop. Returns whether a program that ran
        has ended; where it is not known, False. Raises `Unconfirmed`.
        """
        shared = self.shared
        shared.stops += 1
        shared.is_killed = True
        stop = object()
        shared.pending_stops.add(stop)
        try:
            return await self._kill(program=program)
        finally:
            shared.pending_stops.discard(stop)

    async def _kill(self, *, program: bool) -> bool:
        shared = self.shared
        if not program and self._has_begun():
            await self._send_kill("k")
            return True
        await self._send_kill(STOP)
        if shared.function(CONTINUE) is False:
            self.talk.settle(self.address)  # questions went with the program
            return True
        write_ns = LONGEST_WRITE_NS if shared.variant is None else shared.variant.write_ns
        await self.line.sleep((write_ns + BEGUN_NS) / SECOND)
        await self._send_kill(STOP)
        return False

    def _has_begun(self) -> bool:
        """Whether all that the chip may have to do is a motion, which has begun. After its computed end, or where that is not
        known, somebody else may have started a program."""
        motion, now = self.shared.motion, self.line.now()
        if motion is None or now < self.shared.begins_at + BEGUN_NS:
            return False
        return motion.kind is ChipMotion.ENDLESS or (motion.kind is ChipMotion.MOVE and now < motion.end)

    async def _send_kill(self, text: str) -> None:
        shared = self.shared
        failure: LineFailure | None = None
        for attempt in range(STOP_TRIES):
            if attempt and not self.talk.knows(self.address):
                break  # it was worth a try: function 41 may be ON since before
            try:
                await self._exchange(ChipRequest(self.address, text, sort=ChipRequestKind.KILL), urgent=True)
            except (Garbled, NoAnswer) as error:
                failure = error
                continue
            self.talk.echoing.add(self.address)
            return
        select = "" if self.address is None else f"x{self.address:x}\r"
        await self._blind(2 * f"{select}{text}\r", PAUSES_NS[1], urgent=True)
        try:
            had_echoed = shared.was_awake
            await self.wake()
            if had_echoed:  # it was switched off; of one that had never echoed nothing is known, function 44 neither
                shared.forget()
            await self._exchange(ChipRequest(self.address, text, sort=ChipRequestKind.KILL), urgent=True)
        except (NoEcho, Garbled, NoAnswer) as error:
            raise unconfirmed(self.name, failure or error) from error
