"""Input buffer and command memory against a model that knows lists only: no ring, no compiled code, no time but "long enough".

A host types commands and holds what the buffer refuses until later; commands take no time, so that what is possible happens
at once.
"""

from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from m1486_rig import Bench

#: Lines, and the bytes each takes in the memory by the manual's rule.
LINES = {
    "u20": 2, ":7": 4, "+1": 2, "u4": 2, "d": 1, "v150": 3, "w1000": 4, "r": 1, "t80": 2, "u14": 2,
    "@1": 0, "@2": 0, "[": 0, "]": 0,
}  # fmt: skip
BUFFER = {"A": 12, "B": 32}
MEMORY = {"A": 108, "B": 254}


class Model:
    """What the manual says of buffer and memory, M-12 included."""

    def __init__(self, kind: str, *, echoes: bool, reports: bool) -> None:
        self.letter = ord(kind)
        self.capacity, self.size = BUFFER[kind], MEMORY[kind]
        self.echoes, self.reports = echoes, reports
        self.buffer: list[str] = []
        self.sent: list[int] = []
        #: Stored commands that were not done yet, each with the bytes written before it.
        self.pending: list[tuple[int, str]] = []
        self.written = 0
        self.labels: dict[int, int] = {}
        self.file: list[tuple[int, str]] | None = None
        self.file_labels: dict[int, int] = {}
        self.is_refused = False
        self.file_begin = 0
        self.variable = 0
        self.flag = False
        self.busy = ""

    def character(self, char: str) -> bool:
        """False: no room."""
        free = self.capacity - len(self.buffer)
        if free == 0:
            self.sent.append(0x5E)
            return False
        if self.echoes:
            self.sent.append(ord(char))
        self.buffer.append(char)
        if free <= 3:
            self.sent.append(255 - ord(char))
        self.settle()
        return True

    def settle(self) -> None:
        while self.compress() or self.execute():
            pass

    def compress(self) -> bool:
        if "\r" not in self.buffer or (self.busy == "r" and self.file is None and not self.is_refused):
            return False
        line = "".join(self.buffer[: self.buffer.index("\r")])
        size = LINES[line]
        if self.file is not None and self.written - self.file_begin + size > self.size:
            size = 0  # it will be dropped
        oldest = self.pending[0][0] if self.pending else self.file_begin if self.file is not None else self.written
        if size and not self.is_refused and self.written - oldest + size > self.size:
            return False
        before = self.capacity - len(self.buffer)
        del self.buffer[: len(line) + 1]
        if self.reports and before < 3 <= self.capacity - len(self.buffer):
            self.sent.append(0x7E)
        if self.reports and not self.buffer:
            self.sent.append(0x7F)
        self.take(line)
        return True

    def take(self, line: str) -> None:
        if line == "[":
            if self.file is None and not self.is_refused:
                self.file, self.file_labels, self.file_begin = [], {}, self.written
        elif line == "]":
            self.pending += self.file or []
            if self.file is not None:
                self.labels |= self.file_labels
            self.file, self.is_refused = None, False
        elif line[0] == "@":
            if self.file is not None:
                self.file_labels[int(line[1:])] = self.written
            else:
                self.labels[int(line[1:])] = self.written
        elif not self.is_refused:
            self.store(line)

    def store(self, line: str) -> None:
        if self.file is not None and self.written - self.file_begin + LINES[line] > self.size:
            self.sent.append(0x5E)
            self.file, self.is_refused, self.written = None, True, self.file_begin
            return
        (self.pending if self.file is None else self.file).append((self.written, line))
        self.written += LINES[line]
        self.labels = {label: place for label, place in self.labels.items() if self.written - place <= self.size}

    def execute(self) -> bool:
        if self.busy or not self.pending:
            return False
        line = self.pending.pop(0)[1]
        if line == "u20":
            self.sent.append(self.letter)
        elif line == "u4":
            self.sent.append(self.variable % 256)
        elif line == "u14":
            self.sent.append(int(self.flag))
        elif line == ":7":
            self.variable = 7
        elif line == "+1":
            self.variable += 1
        elif line == "t80":
            self.flag = True
        elif line in ("w1000", "r"):
            self.busy = line[0]
        return True

    def time_passes(self) -> None:
        while self.busy == "w":
            self.busy = ""
            self.settle()

    def kill(self) -> None:
        if self.echoes:
            self.sent += b"k\r"
        if self.busy == "r":
            self.busy = ""
            self.settle()


class Conversation(RuleBasedStateMachine):
    @initialize(kind=st.sampled_from("AB"), echoes=st.booleans(), reports=st.booleans())
    def power_on(self, kind: str, echoes: bool, reports: bool) -> None:
        self.bench = Bench(kind, statement_ns=0)
        self.model = Model(kind, echoes=echoes, reports=reports)
        # R moves on until K, and K brings it to a stop at once.
        setup = ["g+", "v100", "c50", *(["t57"] if reports else []), *(["t41"] if echoes else [])]
        self.bench.do(*setup)
        self.bench.sent()
        self.begin = self.model.written = self.bench.chip.memory.write
        self.backlog: list[str] = []

    def compare(self, answer: bytes) -> None:
        assert list(answer) == self.model.sent
        self.model.sent = []

    def go_on_typing(self) -> None:
        while self.backlog:
            taken = self.model.character(self.backlog[0])
            self.compare(self.bench.raw(self.backlog[0].encode()))
            if not taken:
                return
            self.backlog.pop(0)

    @rule(lines=st.lists(st.sampled_from(sorted(LINES)), min_size=1, max_size=12))
    def types(self, lines: list[str]) -> None:
        self.backlog += "".join(f"{line}\r" for line in lines)
        self.go_on_typing()

    @rule(count=st.integers(1, 60))
    def fills_the_memory(self, count: int) -> None:
        self.backlog += ":7\r" * count
        self.go_on_typing()

    @rule()
    def types_on(self) -> None:
        self.go_on_typing()

    @rule()
    def time_passes(self) -> None:
        self.model.time_passes()
        self.compare(self.bench.run(100.0))

    @precondition(lambda self: not self.model.buffer or self.model.buffer[-1] == "\r")
    @rule()
    def kills(self) -> None:
        self.model.kill()
        self.compare(self.bench.send("k"))

    @invariant()
    def agree(self) -> None:
        chip, model = self.bench.chip, self.model
        assert chip.receiver.waiting == len(model.buffer)
        assert chip.memory.write == model.written % (2 * model.size)
        assert chip.memory.labels == {label: place % (2 * model.size) for label, place in model.labels.items()}
        assert chip.unit.variable == model.variable
        assert chip.unit.flags[0] == model.flag
        assert chip.drive.is_busy == (model.busy == "r")
        assert self.bench.wrong == []


TestConversation = Conversation.TestCase
TestConversation.settings = settings(max_examples=40, stateful_step_count=25)
