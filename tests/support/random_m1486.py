"""M1486 chips on a line by chance: what hosts type, what happens at their pins, and all that comes of it; programs as texts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

from chance import Chance

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse
from steptwin.m1486.characterlog import CharacterLog, LineSplitter, changes_nothing
from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.line import SerialChain
from steptwin.m1486.lines import DUAL_DAC, INTERFACES
from steptwin.m1486.points import POINTS, live_point
from steptwin.m1486.present import state_of
from steptwin.m1486.signals import strobes
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import Variant, variant
from steptwin.motion.divisions import StepTrain

STEPS = 60
MUCH = 1500
"""After so many lines a session ends."""
MEMBERS = ("A", "B", "C", "E1", "E2", "B2x", "A2x", "E12x")
WORDS: Mapping[str, Sequence[str]] = {
    "motion": (
        "F⟨#1..4000⟩", "B⟨#1..4000⟩", "F⟨#200..20000⟩", "G⟨#1..3000⟩", "G", "G+", "G-", "H", "D", "R", "R", "R", "=⟨#1..900⟩",
        "F⟨#1..4000⟩\rR", "B⟨#1..900⟩\rR", "G⟨#1..3000⟩\rR", "H\rR", "D\rR", "F⟨#200..20000⟩\rR", "G+\rR", "G-\rR",
        "C100", "N", "M", "Q", "V", "F", "P", ")",
        "A⟨#100..60000⟩", "S⟨#16..400⟩", "P⟨#20..2000|#6000..8000⟩", "V⟨#100..4000⟩", ")⟨#1..21⟩", "(⟨#1..21⟩",
        "M⟨1|2|4|8|16|32|64⟩", "Q⟨1|2|4|8⟩", "N⟨#1..7⟩",
    ),
    "lines": (
        "T⟨#1..21⟩", "C⟨#1..21⟩", "O⟨#1..21⟩", "O⟨#1..4⟩", "!⟨#1..21⟩⟨#1..9⟩", "?⟨#1..21⟩⟨#1..9⟩", "!14", "?14", "!93", "?184",
        "?", "!", "T", "C", "O",
        "Z⟨#1..4⟩", "!⟨#1..9⟩⟨#1..4⟩",
    ),
    "switches": (
        "T⟨#40..63⟩", "C⟨#40..63⟩", "T⟨#80..86⟩", "C⟨#80..86⟩", "T44", "T47", "T57", "T58", "T59", "T41", "T50", "C51", "T43",
    ),
    "numbers": (
        ":⟨#0..300⟩", ":⟨#0..70000⟩", ":16777215", ":0", "+⟨#1..255⟩", "-⟨#1..255⟩", "*⟨#1..255⟩", "/⟨#1..255⟩", ">⟨#1..10⟩",
        "<⟨#1..10⟩", "+", "-", "/", "*", "<9", "<", ">", "U⟨#1..20⟩", "U1", "U4",
    ),
    "flow": (
        "@⟨#1..9⟩", "J⟨#1..9⟩", "I⟨#1..21|#80..87⟩⟨H|L⟩⟨#1..9⟩", "'⟨#1..9⟩", ".", "L⟨#1..5⟩", "E", "W⟨#1..90⟩", "L", "W", "[",
    ),
    "now": ("K", "C75", "X⟨#0..9⟩", "XF", "XG", "\\", "]", "[", "U⟨#1..20⟩"),
    "odd": (
        "F0", "F16000001", "V⟨#0..20001⟩", "Q3", "P19", "S15", "N8", "A0", "T⟨#0..99⟩", "C⟨#0..120⟩", "U21", "?10", "!219", "@99",
        "J81", "I22H1", "I80X1", "Y", "f 12", "F-5", "X", "::", "W0", "*256", "123456789", "é", "", ";note", "R1", "E5", "K2",
    ),
}  # fmt: skip
KINDS = ("motion", "motion", "motion", "lines", "switches", "numbers", "numbers", "flow", "flow", "now", "odd")
IN_FILE = ("motion", "motion", "lines", "lines", "numbers", "numbers", "flow", "switches")


def command(chance: Chance, kinds: Sequence[str] = KINDS) -> str:
    text = chance.filled(chance.one(WORDS[chance.one(kinds)]))
    return text.lower() if chance.below(2) else text


def file(chance: Chance, *, odd: bool = False) -> list[str]:
    """A program as hosts send it: settings, a loop, subroutines and labels."""
    kinds = (*IN_FILE, "odd") if odd else IN_FILE
    lines = ["T44" if chance.is_so() else "C51", chance.filled("V⟨#200..4000⟩"), chance.filled("A⟨#500..60000⟩"), "@1"]
    lines += [command(chance, kinds) for _ in range(3 + chance.below(9))]
    if chance.below(2):
        lines += [chance.filled("L⟨#1..4⟩"), *(command(chance, ("motion", "numbers")) for _ in range(1 + chance.below(3))), "E"]
    if chance.below(2):
        lines += ["'7", "J8", "@7", command(chance, ("numbers",)), chance.filled("W⟨#1..30⟩"), ".", "@8"]
    lines += ["W⟨#5..80⟩", "J1"] if chance.is_so() else []
    return [chance.filled(line) for line in lines]


def stored(chance: Chance, member: Variant) -> bytes:
    """A file in the memory of the chip from the start."""
    while True:
        try:
            return image_of(parse("\n".join(file(chance)).replace("\r", "\n"))[0], member)
        except Misuse:
            continue


class RandomChips:
    """Chips of one type on a line, treated by chance. ``found`` is what is seen of them, by kind."""

    def __init__(self, seed: int, *, stepwise: bool) -> None:
        chance = self.chance = Chance("m1486", seed)
        self.stepwise = stepwise
        """Whether time goes from event to event, or on to what comes next at once."""
        member = variant(MEMBERS[seed % len(MEMBERS)])
        interface = chance.one(INTERFACES)
        addresses = (1, 4, 9)[: 1 + chance.below(3)]
        self.options = {
            "interface": interface,
            "baud": chance.one([member.baud(*pins) for pins in ((0, 0), (0, 1), (1, 1), (1, 1))]),
            "statement_ns": chance.one((None, None, 0, 10_000)),
            "is_timed": chance.below(2) == 0,
        }
        image = stored(chance, member) if chance.below(3) == 0 else b""
        self.chips = [M1486Chip(member, address=address, image=image, **self.options) for address in addresses]  # type: ignore[arg-type]
        self.chain = SerialChain(self.chips)
        self.port = self.chain.port()
        self.now = 0
        self.found: dict[str, list[str]] = {name: [] for name in ("typed", "sent", "happened", "motions", "values", "words")}
        self.log = CharacterLog(member)
        self.log.sinks.append(lambda line: self.found["words"].append(repr(line)))
        self.splitter = LineSplitter(self.log, "line")
        self.trains: list[list[tuple[int, StepTrain]]] = [[(0, chip.drive.train)] for chip in self.chips]
        for number, chip in enumerate(self.chips):
            self._hook(number, chip)

    def _hook(self, number: int, chip: M1486Chip) -> None:
        happened = self.found["happened"]
        chip.on_event = lambda event: happened.append(f"{event.time} {number} {event.code}: {event.text} {event.facts}")
        chip.changed = lambda: self._look(number, chip)
        chip.store = self._store

    def _store(self, image: bytes) -> bytes | None:
        if self.chance.below(6) == 0:
            raise OSError("worn out")
        self.found["values"].append(f"stored {image.hex()}")
        return None

    def _look(self, number: int, chip: M1486Chip) -> None:
        self.found["happened"] += [f"{edge.time} {number} {edge.pin} = {edge.value:g}" for edge in chip.take_edges()]
        train = chip.drive.train
        begun, before = self.trains[number][-1]
        if train is not before:
            if self.options["interface"] is DUAL_DAC:
                taken = list(strobes(before, chip.drive.characteristic, begun, min(chip.now, begun + SECOND // 10)))
                self.found["motions"].append(f"{len(taken)} {taken[-3:]}")
            self.trains[number].append((chip.now, train))
            self.found["motions"].append(f"{chip.now} {number} {shown_train(train)}")

    def values(self) -> Iterator[str]:
        for number, chip in enumerate(self.chips):
            yield f"{self.now} {number} {state_of(chip, self.now)}"
            yield f"{number} {dict(chip.pins())} {chip.deadline()} {chip.is_busy(self.now)} {chip.is_idle()} {chip.memory.file}"

    def points(self) -> Iterator[str]:
        """All that points of the first chip show now, and when that turns next."""
        chip, now = self.chips[0], self.now
        for path in POINTS:
            live = live_point(chip, path)
            assert live is not None
            ahead = live.turning_points and list(islice(live.turning_points(now), 3))
            yield f"{live.point} {live.read and live.read(now)} {ahead} {live.is_kept} {live.version and live.version()}"

    def run(self) -> None:
        kinds = (self.type, self.type, self.type, self.type, self.send_file, self.pin, self.pin, self.rare)
        if self.chance.below(6):
            self.send("XG\rT44\r")
        for _ in range(STEPS):
            self.chance.one(kinds)()
            self.wait()
            if len(self.found["happened"]) + len(self.found["motions"]) > MUCH:
                break
        self.found["values"] += [*self.values(), *self.points()]
        for number, chip in enumerate(self.chips):
            self.found["values"].append(f"{chip.image.hex()} {chip.snapshot().variant.title} {self.chain.collisions}")
            assert way_u(self.trains[number], self.now) == chip.drive.true_u(self.now)

    def type(self) -> None:
        """A line, or several, or a part of one."""
        chance = self.chance
        text = "".join(f"{command(chance)}\r" for _ in range(1 + chance.below(4)))
        self.send(text[: -1 - chance.below(3)] if chance.below(9) == 0 else text)

    def send_file(self) -> None:
        lines = ["[", *file(self.chance, odd=self.chance.below(4) == 0), "]"]
        self.send("".join(f"{line}\r" for line in lines))
        self.now += SECOND // 5

    def send(self, text: str) -> None:
        data = text.encode("latin-1", errors="replace")
        self.found["typed"].append(f"{self.now} {data!r} {changes_nothing(data)}")
        self.splitter.take(data, self.now)
        self.chain.receive(data, self.now)

    def pin(self) -> None:
        chance = self.chance
        chip = chance.one(self.chips)
        name = chance.filled(chance.one(("B⟨#1..21⟩", "B⟨#1..4⟩", "LIMIT", "LIMIT", "JOG", "B7", "JOG")))
        chip.set_pin(name, 0.0, self.now)
        if chance.is_so():
            self.wait()
            chip.set_pin(name, 1.0, self.now)

    def rare(self) -> None:
        chance = self.chance
        number = chance.below(len(self.chips))
        chip = self.chips[number]
        kind = chance.below(8)
        if kind == 0:
            chip.power_off(self.now)
            self.now += chance.below(2) * SECOND
            chip.power_cycle(self.now)
        elif kind <= 2:
            chip.set_pin("RST", 1.0, self.now)
            self.now += chance.below(20) * MILLISECOND
            chip.set_pin("RST", 0.0, self.now)
        elif kind == 3:
            level = chance.below(2)
            chip.set_pin("SD", level, self.now)
            self.now += 30 * MILLISECOND
            chip.set_pin("RST", 1.0, self.now)
            self.now += chance.below(14) * MILLISECOND
            chip.set_pin("SD", 1.0, self.now)
        elif kind == 4:
            self.send("K\rC75\rXG\r")
        elif kind == 5:
            self.found["values"] += self.values()
        else:
            self.go_on_elsewhere(number)

    def go_on_elsewhere(self, number: int) -> None:
        """The chip goes on from a snapshot, after it has done something else."""
        chip = self.chips[number]
        chip.advance(self.now)
        chip.changed = lambda: None
        chip.on_event = None
        snapshot = chip.snapshot()
        self.found["values"].append(f"{chip.deadline()}")
        chip.receive(b"f9999\rr\rt3\r:77\r", self.now)
        chip.advance(self.now + SECOND // 50)
        chip.take_edges()
        chip.restore(snapshot)
        self._hook(number, chip)

    def wait(self) -> None:
        chance = self.chance
        kind = chance.below(8)
        deadlines = [due for chip in self.chips if (due := chip.deadline()) is not None]
        if kind == 0:
            return
        if kind == 1 and deadlines:
            self.now = max(min(deadlines) - chance.below(2), self.now)
        else:
            self.now += int(float(chance.filled("⟨1|1..9|5..60|20..400|200..900⟩")) * MILLISECOND)
        for chip in self.chips:
            while self.stepwise and (due := chip.deadline()) is not None and due <= self.now:
                chip.advance_to_change(self.now)
            chip.advance(self.now)
        sent = self.port.to_send(self.now)
        self.found["sent"] += [f"{moment} {data.hex()}" for moment, data in sent]
        for moment, data in sent:
            self.log.sent(moment, data[0])
        if kind == 2:
            self.found["values"] += self.values()


def shown_train(train: StepTrain) -> str:
    profile = train.profile
    parts = "; ".join(
        f"{one.end_s:.9g} {one.anchor_s:.9g} {one.c0:.9g} {one.c1:.9g} {one.c2:.9g} {one.c3:.9g} {one.direction}"
        for one in profile.segments
    )
    ends = f"{profile.start} {profile.base} {profile.end} {profile.final_p:.9g}"
    return f"{ends} [{parts}] {list(train.intervals())} {train.microstepping}"


def way_u(trains: list[tuple[int, StepTrain]], end: int) -> int:
    """Where the pulses of trains lead that were in force one after the other, in minimum microsteps."""
    from m1486_rig import way_u as way_of_train

    ends = [begin for begin, _ in trains[1:]] + [end]
    return sum(way_of_train(train, begin, end) for (begin, train), end in zip(trains, ends, strict=True))


def session(seed: int, *, stepwise: bool) -> dict[str, list[str]]:
    """What chips send and do."""
    chips = RandomChips(seed, stepwise=stepwise)
    chips.run()
    return chips.found
