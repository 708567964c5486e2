"""Sessions of a MIC488 by chance: what a master, the terminals, the shafts and the supply do to it, and all that comes of it.

Requests are made here from the addresses of the manuals (`mic488_rig`): wanted and border values of all registers, requests
across their borders and with unknown functions.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from itertools import islice

from chance import Chance
from mic488_rig import EN, IN, JOG, OFFSETS, OUT, STOP, USER_REG_READ, VALUES, WORDS, coil_pdu, read_pdu, word_pdu, words_pdu
from random_programs import program, rows, sound

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.mic488.config import AnalogConfig, AxisConfig, ControllerConfig, InputConfig, ProgramConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.encoder import Coupling
from steptwin.mic488.framelog import FrameLog
from steptwin.mic488.points import live_point, marks, points
from steptwin.mic488.present import state_of
from steptwin.mic488.program_banks import LoadedProgram, load
from steptwin.mic488.vision import VisionRecord
from steptwin.motion.profile import Profile
from steptwin.wbc.check import check
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.positions import parse_positions
from steptwin.wire.slave import FrameDirection

STEPS = 110
WORDED = 300
MUCH = 2500
"""After so many lines a session ends: a program commands axes again and again."""
FIRMWARES = ("1.23", "1.40", "1.70")
STATEMENT_TIMES = (MILLISECOND, MILLISECOND, 0, 300_001, 7 * MILLISECOND)
REALS = (0.0, -0.0, 0.5, -0.5, 1e-44, -3.4e38, 3.4e38, float("inf"), float("nan"), 2.0**31, -(2.0**31), 1e9, -1.5e6)
DINTS = (0, 1, -1, 0x7FFFFFFF, -0x80000000, 16_777_217, -70_000)
WORD_VALUES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 15, 16, 31, 255, 0x7FFF, 0x8000, 0xFFF0, 0xFFFF)
JOG_SPEED = 17
"""A value register of which there is one, after the 17 of type WORD."""
EDGES = (0, 498, 499, 500, 999, 1000, 1017, 1018, 1135, 1136, 1998, 1999, 2000, 10_000, 10_013, 10_018, 10_134, 10_136, 65_534)


def configured(chance: Chance) -> ControllerConfig:
    """Axes that move, with what can stop them."""

    def real(text: str) -> float:
        return float(chance.filled(text))

    def whole(text: str) -> int:
        return int(chance.filled(text))

    axes = tuple(
        AxisConfig(
            unit=whole("⟨#0..5⟩"),
            gear=real("⟨1|10|100|3.7⟩"),
            acc=real("⟨50.0..900.0⟩"),
            dec=real("⟨50.0..900.0⟩"),
            vel=real("⟨20.0..90.0⟩"),
            mot_resol=whole("⟨3200|200⟩"),
            enc_resol=whole("⟨400|4000|333⟩"),
            enc_offset=whole("⟨0|0|-17⟩"),
            home_mode=whole("⟨#0..4⟩"),
            limit_mode=whole("⟨#0..3⟩"),
            in_kl=whole("⟨0|1|2|20⟩"),
            in_kr=whole("⟨3|4|5|20⟩"),
            pos_ctrl_mode=whole("⟨0|0|1|2⟩"),
            err_ctrl_mode=whole("⟨#0..3⟩"),
            kp=real("⟨50|0|400⟩"),
            enc_tolerance=whole("⟨4|0|30⟩"),
            enc_settle_ms=whole("⟨100|1|37⟩"),
            err_time_ms=whole("⟨2000|300⟩"),
            en_wired=whole("⟨1|1|1|0⟩"),
        )
        for _ in range(4)
    )
    inputs = tuple(InputConfig(whole("⟨0|0|#0..4⟩"), whole("⟨0|0|1⟩"), whole("⟨#0..3⟩")) for _ in range(20))
    runs = ProgramConfig(whole("⟨0|1⟩"), whole("⟨#0..3⟩"), whole("⟨#0..3⟩"))
    analog = (AnalogConfig(), AnalogConfig(real("⟨-5.0..5.0⟩"), real("⟨-5.0..50.0⟩")))
    return ControllerConfig(axes=axes, inputs=inputs, analog=analog, program=runs, trigger_keeps=whole("⟨0|0|1⟩"))


class RandomMic488:
    """A controller that is treated by chance. ``found`` is what is seen of it, by kind."""

    def __init__(self, seed: int, *, stepwise: bool) -> None:
        self.stepwise = stepwise
        """Whether time goes from event to event, or on to the next request at once."""
        chance = self.chance = Chance("mic488", seed)
        self.firmware = FIRMWARES[seed % 3]
        self.base = OFFSETS[self.firmware]
        self.table, _ = parse_positions(rows(chance))
        self.config = configured(chance)
        programs = {bank: self._program() for bank in range(3)}
        self.options = {
            "lenient": chance.below(4) == 0,
            "memory": bytes(chance.below(256) for _ in range(2000)) if self.firmware == "1.70" and chance.below(2) else None,
            "programs": programs,
            "positions": dict.fromkeys((0, 2), self.table),
            "statement_time": chance.one(STATEMENT_TIMES),
        }
        self.device = self._made()
        self.stored: list[bytes] = []
        self.now = 0
        self.dint = False
        self.found: dict[str, list[str]] = {name: [] for name in ("answers", "happened", "motions", "values", "words")}
        self.profiles: list[Profile] = [axis.profile for axis in self.device.axes]
        self.revisions = [0] * 4
        self._hook()

    def _made(self) -> Mic488Device:
        return Mic488Device(self.config, self.firmware, **self.options)  # type: ignore[arg-type]

    def _hook(self) -> None:
        device = self.device
        device.on_event = lambda event: self.found["happened"].append(f"{event.time} {event.axis} {event.code}: {event.text}")
        device.changed = self._look
        device.store = self._store
        log = FrameLog({1: device})
        log.sinks.append(lambda line: self.found["words"].append(line.meaning))
        self.observe = log.callback("line", tcp=False)

    def _store(self, memory: bytes) -> bytes | None:
        if self.chance.below(5) == 0:
            raise OSError("no room")
        self.stored.append(memory)
        return None if self.chance.is_so() else bytes(reversed(memory))

    def _program(self) -> LoadedProgram:
        text = sound(program(self.chance), self.table, self.firmware)
        return load(check(text, self.table, dialect=dialect_for(self.firmware)))

    # ------------------------------------------------------------------ what is seen

    def _look(self) -> None:
        """Edges, and motions that have begun: the position of an axis goes on where it was."""
        device, now = self.device, self.device.now
        self.found["happened"] += [f"{edge.time} {edge.pin} = {edge.value:g}" for edge in device.take_edges()]
        for number, axis in enumerate(device.axes):
            if axis.profile is not self.profiles[number]:
                before, self.profiles[number] = self.profiles[number], axis.profile
                begin = axis.profile.start
                assert axis.profile.count(begin) == before.count(begin), f"M{number + 1} jumps at {begin} ns"
                self.found["motions"].append(f"{now} M{number + 1} {shown_profile(axis.profile)}")

    def values(self) -> Iterator[str]:
        device, now = self.device, self.now
        for axis in device.axes:
            counts = f"{axis.coordinate_p(now)} {axis.profile.velocity(now):.9g} {axis.encoder_counts(now)}"
            yield f"{now} M{axis.number} {axis.status.name} {counts} {axis.limit_l_p} {axis.limit_r_p} {axis.revision > 0}"
        control = device.program
        yield f"{now} {control.state} {control.statement(now)} {dict(control.variables(now))} {device.deadline()}"
        yield f"{device.status().name} {dict(device.pins())}"
        yield " ".join(f"{number}={word}" for number, word in enumerate(device.user) if word)

    def points(self) -> Iterator[str]:
        """All that points show now, and when that turns next."""
        device, now = self.device, self.now
        yield f"{state_of(device, now)} {marks(device)}"
        for point in points(device.registers, [axis.unit_name for axis in self.config.axes]):
            if "USER" not in point.path:
                live = live_point(device, point.path)
                assert live is not None
                read, turning_points = live.read, live.turning_points
                frozen = read if live.freeze is None else live.freeze(now)
                later = now + SECOND // 7
                ahead = turning_points and list(islice(turning_points(now), 3))
                yield f"{point} {read and read(now)} {frozen and frozen(later)} {ahead} {live.is_kept}"

    # ------------------------------------------------------------------ what is done

    def run(self) -> None:
        kinds = (
            self.write_value, self.write_value, self.write_value, self.move, self.move, self.write_word, self.coil, self.coil,
            self.jog, self.read, self.read, self.odd_request, self.pin, self.pin, self.pin, self.program, self.program,
            self.user, self.shaft, self.rare,
        )  # fmt: skip
        self.ask(word_pdu(self.base + WORDS["M_ENABLE"], 0xF if self.chance.is_so() else 3))
        for _ in range(STEPS):
            self.chance.one(kinds)()
            self.wait()
            if len(self.found["happened"]) + len(self.found["motions"]) > MUCH:
                break
        self.found["values"] += [*self.values(), *self.points()]
        for first, last in ((0, 40), (490, 500), (1000, 1136), (1980, 2000), (10_000, 10_136)):
            for address in range(first, last):
                self.ask(read_pdu(3, address, 1))
                if address >= OFFSETS[self.firmware]:
                    self.ask(read_pdu(3, address, 2))
        self.found["values"].append(f"{[len(memory) for memory in self.stored]} {self.device.memory.hex()}")

    def wait(self) -> None:
        """To a moment by chance or of the machine itself; at once, or from event to event."""
        chance = self.chance
        kind = chance.below(8)
        due = self.device.deadline()
        if kind == 0:
            return
        if kind == 1 and due is not None:
            self.now = max(due - chance.below(2), self.now)
        else:
            ms = float(chance.filled("⟨1|5..60|20..400|200..900⟩"))
            self.now += int(ms * MILLISECOND) // (1 if self.device.program.interpreter.statement_time >= MILLISECOND else 30)
        if self.stepwise:
            while (due := self.device.deadline()) is not None and due <= self.now:
                self.device.advance_to_change(self.now)
        self.device.advance(self.now)
        if kind == 2:
            self.found["values"] += self.values()

    def ask(self, pdu: bytes) -> None:
        answer = self.device.execute(pdu, self.now)
        if pdu and len(self.found["words"]) < WORDED:
            self.observe(self.now, FrameDirection.IN, bytes((1, *pdu, 0, 0)))
            self.observe(self.now, FrameDirection.OUT, bytes((1, *answer, 0, 0)))
        self.found["answers"].append(f"{self.now} {pdu.hex()} -> {answer.hex()}")

    def value(self) -> float:
        chance = self.chance
        if chance.below(4) == 0:
            return chance.one(DINTS) if self.dint else chance.one(REALS)
        if chance.below(2):
            return float(chance.filled("⟨-40.0..40.0⟩"))
        return float(chance.filled("⟨#-500..500⟩"))

    def words(self, value: float) -> tuple[int, int]:
        if self.dint:
            return int(value) & 0xFFFF, int(value) >> 16 & 0xFFFF
        high, low = struct.unpack(">HH", struct.pack(">f", value))
        return low, high

    def write_value(self) -> None:
        chance = self.chance
        key = chance.one(tuple(VALUES))
        axis, count = chance.below(4), 1 + chance.below(4)
        words = [word for _ in range(min(count, 4 - axis) + (chance.below(12) == 0)) for word in self.words(self.value())]
        if chance.below(15) == 0:
            words.pop()
        self.ask(words_pdu(self.base + VALUES[key] + 2 * axis, *words))

    def move(self) -> None:
        key = self.chance.one(("POS_ABS", "POS_REL", "VEL_ABS", "VEL_REL", "HOME", "POS_ABS", "POS_REL"))
        self.ask(
            words_pdu(self.base + VALUES[key] + 2 * self.chance.below(4), *self.words(float(self.chance.filled("⟨-30..30⟩"))))
        )

    def write_word(self) -> None:
        chance = self.chance
        key = chance.one(tuple(WORDS))
        value = chance.one(WORD_VALUES) if chance.below(2) else chance.below(4)
        if key == "DATA_TYPE" and value < 2:
            self.dint = value == 1
        address = self.base + WORDS[key]
        self.ask(words_pdu(address, value) if chance.below(9) == 0 else word_pdu(address, value))

    def coil(self) -> None:
        chance = self.chance
        first, count = chance.one(
            ((EN, 4), (STOP, 4), (JOG, 8), (OUT, 8), (USER_REG_READ, 3), (EN - 1, 2), (OUT + 7, 3), (IN, 1))
        )
        self.ask(coil_pdu(first + chance.below(count), chance.is_so()))

    def jog(self) -> None:
        chance = self.chance
        if chance.below(3) == 0:
            address = self.base + JOG_SPEED
            value = self.value()
            self.ask(
                word_pdu(address, int(value) if abs(value) < 1e5 else 7)
                if chance.below(2)
                else words_pdu(address, *self.words(value))
            )
        else:
            self.ask(coil_pdu(JOG + chance.below(4), chance.below(2) == 0))

    def read(self) -> None:
        chance = self.chance
        kind = chance.below(4)
        if kind == 0:
            self.ask(read_pdu(1 + chance.below(2), chance.one((OUT, IN, OUT - 1, EN)) + chance.below(9), 1 + chance.below(21)))
        elif kind == 1:
            self.ask(read_pdu(3, self.base + 9 + chance.below(5), 1 + chance.below(4)))
        else:
            self.ask(read_pdu(3, self.base + 2 * chance.below(68), 2 * (1 + chance.below(6)) - (chance.below(9) == 0)))

    def odd_request(self) -> None:
        chance = self.chance
        pdu = chance.one(
            (
                read_pdu(chance.below(9), chance.one(EDGES), 1 + chance.below(4)),
                read_pdu(3, chance.one(EDGES), chance.one((0, 1, 2, 125, 126, 2000, 65_535))),
                read_pdu(1 + chance.below(2), chance.one((OUT, IN, 2000)), chance.one((0, 8, 20, 2000, 2001))),
                words_pdu(chance.one(EDGES), *(chance.below(65_536) for _ in range(1 + chance.below(3)))),
                word_pdu(chance.one(EDGES), chance.one(WORD_VALUES)),
                struct.pack(">BHH", 5, OUT + chance.below(8), chance.one((0xFF00, 0, 1, 0xFF01, 0xFFFF))),
                words_pdu(chance.one(EDGES), 1, 2)[: chance.below(9)],
                bytes((chance.below(256),)) + bytes(chance.below(6)),
                struct.pack(">BHHB", 15, OUT, 8, 1) + b"\x55",
            )
        )
        self.ask(pdu)

    def pin(self) -> None:
        chance = self.chance
        if chance.below(8) == 0:
            name, level = f"AIN{1 + chance.below(2)}", float(chance.filled("⟨0..10⟩"))
        else:
            name, level = chance.filled("IN⟨#1..8|#1..20⟩"), float(chance.below(2))
        self.device.set_pin(name, level, self.now)

    def program(self) -> None:
        chance = self.chance
        if chance.below(6) == 0:
            bank, content = chance.below(8), self._program() if chance.below(2) else self.table
            try:
                if isinstance(content, LoadedProgram):
                    self.device.load_program(bank, content)
                else:
                    self.device.load_positions(bank, content)
            except Misuse as error:
                self.found["happened"].append(f"{self.now} {error}")
        elif chance.below(3) == 0:
            self.ask(word_pdu(self.base + 1 + chance.below(2), chance.below(4)))
        else:
            self.ask(word_pdu(self.base + WORDS["PROGRAM_CTRL"], chance.one((1, 1, 1, 2, 0))))

    def user(self) -> None:
        chance = self.chance
        address = chance.one((0, 2, 4, 5, 6, 8, 20, 998, 1000, 1999))
        count = 1 + chance.below(4)
        values = [chance.one((chance.below(65_536), chance.below(50))) for _ in range(count)]
        self.ask(word_pdu(address, values[0]) if count == 1 else words_pdu(address, *values))
        self.ask(read_pdu(3, chance.below(12), 1 + chance.below(8)))

    def shaft(self) -> None:
        chance, device, axis = self.chance, self.device, 1 + self.chance.below(4)
        kind = chance.below(6)
        if kind <= 2:
            device.turn_encoder(axis, int(chance.filled("⟨#-60..60⟩")), self.now)
        elif kind <= 4:
            device.couple_encoder(axis, chance.one(tuple(Coupling)), self.now)
        else:
            device.gear_encoder(axis, int(chance.filled("⟨400|-400|1⟩")), int(chance.filled("⟨3200|7⟩")), self.now)

    def rare(self) -> None:
        chance, device = self.chance, self.device
        kind = chance.below(6)
        if kind == 0:
            device.power_off(self.now)
            self.now += chance.below(3) * SECOND
            device.power_cycle(self.now)
            self.dint = False
        elif kind == 1:
            device.set_master_error(chance.is_so(), self.now)
        elif kind == 2:
            x, y, a = (float(chance.filled("⟨-9..99⟩")) for _ in range(3))
            device.see(VisionRecord(chance.below(9), x, y, a), self.now)
        elif kind == 3:
            self.found["values"] += self.values()
        else:
            self.go_on_elsewhere()

    def go_on_elsewhere(self) -> None:
        """Another controller goes on from a snapshot of this one."""
        snapshot, master_values = self.device.snapshot(), self.device.written
        self.device = self._made()
        self.device.restore(snapshot)
        assert self.device.written == master_values
        self._hook()


def shown_profile(profile: Profile) -> str:
    parts = [
        f"{one.end_s:.10g} {one.anchor_s:.10g} {one.c0:.9g} {one.c1:.9g} {one.c2:.9g} {one.direction}"
        if hasattr(one, "c0")
        else f"{one.end_s:.10g} {one.position(0.0):.9g} {one.direction}"
        for one in profile.segments
    ]
    return f"{profile.start} {profile.base} {profile.end} {profile.final_p:.9g} [{'; '.join(parts)}]"


def session(seed: int, *, stepwise: bool) -> dict[str, list[str]]:
    """What a controller answers and does."""
    controller = RandomMic488(seed, stepwise=stepwise)
    controller.run()
    return controller.found
