"""A port with a faulty line before it. Without faults its calls are those of the port behind it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import ClassVar

from steptwin.controller import Nanos, Port, SendingPort
from steptwin.messages import Message, text_of
from steptwin.simulation.faults.active import ActiveFault, Faults
from steptwin.simulation.faults.answers import Exchange, must_not_be_sent, pdu_of, spoil_answer
from steptwin.simulation.faults.stream import spoil
from steptwin.simulation.faults.table import Layer, LineProtocol
from steptwin.state import Plain, Stateful
from steptwin.wire.slave import FrameCallback, FrameDirection, SlavePort

_ASKED = 64
"""More requests than this never wait for their answers (`steptwin.wire.gateway.QUEUE_REQUESTS`)."""


WHERE = Message("simulation.where-a-fault-strikes", "{place}, {what}")
TOWARDS_THE_TWIN = Message("simulation.towards-the-twin", "towards the twin")
FROM_THE_TWIN = Message("simulation.from-the-twin", "from the twin")


class FaultyPort(Stateful):
    """One link of a twin, or one line of a world. Only while faults are set, or something delayed is on its way, anything is
    done here: `exchange`, `to_send` and `deadline` are the inner port's own else.

    ``framed`` is the slave port that reports frames, inside ``port``; without it bytes alone can go wrong. ``units`` are the
    units it serves (MIC-23: on TCP a single one is addressed by 0 and 255 too). ``line_name`` is the line of a world it is on:
    what goes wrong is recorded there, else at the link.
    """

    FIXED: ClassVar[tuple[str, ...]] = (
        "__weakref__",
        "_before",
        "_faults",
        "_framed",
        "_inner",
        "_line",
        "_now",
        "_units",
        "deadline",
        "exchange",
        "line_name",
        "link",
        "to_send",
    )
    __slots__ = (*FIXED, "_arriving", "_asked", "_fresh", "_held", "_leaving")

    exchange: Callable[[bytes, Nanos], bytes]
    to_send: Callable[[Nanos], list[tuple[Nanos, bytes]]]
    deadline: Callable[[], Nanos | None]

    def __init__(
        self,
        port: Port,
        link: str,
        faults: Faults,
        line: LineProtocol,
        *,
        framed: SlavePort | None = None,
        units: tuple[int, ...] = (),
        line_name: str = "",
    ) -> None:
        self._inner = port
        self._faults = faults
        self._line = line
        self._framed = framed
        self._units = units
        self.link = link
        self.line_name = line_name
        self._before: FrameCallback | None = None
        self._now: Nanos = 0  # of the present call: an answer may have left before it
        self._asked: deque[bytes] = deque(maxlen=_ASKED)
        self._fresh: list[tuple[Nanos, Nanos, bytes]] = []  # moment, delay, bytes: as the faults of frames leave them
        self._held = b""  # answers that come with the next one
        self._arriving: deque[tuple[Nanos, bytes]] = deque()
        self._leaving: deque[tuple[Nanos, bytes]] = deque()
        self._be_transparent()
        faults.ports.add(self)
        self.choose()

    @property
    def broken(self) -> str | None:
        return self._inner.broken

    def close(self) -> None:
        """The program has closed the link."""
        self._inner.close()

    def set_state(self, plain: Plain) -> None:
        super().set_state(plain)
        self.choose()

    # ------------------------------------------------------------------ which way calls go

    def choose(self) -> None:
        """Select the path of calls from now on."""
        if self._faults.interfere or self._arriving or self._leaving:
            self._be_faulty()
        else:
            self._be_transparent()

    def _be_transparent(self) -> None:
        self.exchange = self._inner.exchange
        self.to_send = self._inner.to_send
        self.deadline = self._inner.deadline
        if self._framed is not None and self._framed.on_frame == self._observe:
            self._framed.on_frame = self._before
        self._asked.clear()
        self._held = b""

    def _be_faulty(self) -> None:
        self.exchange = self._exchange
        self.to_send = self._to_send
        self.deadline = self._deadline
        if self._framed is not None and self._framed.on_frame != self._observe:
            self._before = self._framed.on_frame
            self._framed.on_frame = self._observe

    # ------------------------------------------------------------------ the faulty way

    def _exchange(self, data: bytes, now: Nanos) -> bytes:
        self._deliver(now)
        for delay, piece in spoil(data, self._bytewise("in"), now, self._reporter(TOWARDS_THE_TWIN())):
            # A line keeps the order of its bytes.
            at = max(now + delay, self._arriving[-1][0] if self._arriving else now)
            self._arriving.append((at, piece))
        return b"".join(piece for _, piece in self._to_send(now))

    def _to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        self._deliver(now)
        self._faults.link = self.link
        sent = self._inner.to_send(now)
        self._faults.link = ""
        self._take(sent, now)
        out = []
        while self._leaving and self._leaving[0][0] <= now:
            out.append(self._leaving.popleft())
        if not self._faults.interfere:
            self.choose()
        return out

    def _deadline(self) -> Nanos | None:
        moments = [self._inner.deadline()]
        moments += [queue[0][0] for queue in (self._arriving, self._leaving) if queue]
        return min((moment for moment in moments if moment is not None), default=None)

    def _deliver(self, now: Nanos) -> None:
        self._now = now
        while self._arriving and self._arriving[0][0] <= now:
            _, piece = self._arriving.popleft()
            self._faults.link = self.link
            answer = self._inner.exchange(piece, now)
            self._faults.link = ""
            self._take([(now, answer)] if answer else [], now)

    def hasten(self, now: Nanos) -> None:
        """Deliver at once what faults hold up on its way to the twin."""
        self._arriving = deque((now, piece) for _, piece in self._arriving)
        if self._arriving:
            self._deliver(now)

    def _take(self, sent: list[tuple[Nanos, bytes]], now: Nanos) -> None:
        """The output of the inner port: bytes, or the frames that it reported."""
        if self._framed is None:
            fresh = [(moment, 0, data) for moment, data in sent]
        else:
            fresh, self._fresh = self._fresh, []
        outgoing = self._bytewise("out")
        for moment, delay, data in fresh:
            for more, piece in spoil(data, outgoing, now, self._reporter(FROM_THE_TWIN())):
                at = moment + delay + more
                self._leaving.append((max(at, self._leaving[-1][0]) if self._leaving else at, piece))

    def call_with_frames(self, callback: FrameCallback | None) -> None:
        """Call ``callback`` with the frames of the port from now on; None ends that."""
        framed = self._framed
        if framed is not None and framed.on_frame == self._observe:
            self._before = callback
        elif framed is not None:
            framed.on_frame = callback

    def _observe(self, moment: Nanos, direction: FrameDirection, raw: bytes) -> None:
        if direction is FrameDirection.OUT and must_not_be_sent(self._line, raw):
            self._request_of(raw)
            return
        if self._before is not None:
            self._before(moment, direction, raw)
        if direction is FrameDirection.IN:
            self._asked.append(raw)
            return
        request = self._request_of(raw)
        if request is None:  # asked before there were faults
            self._fresh.append((moment, 0, raw))
            return
        faults = [a for a in self._faults.of_layer(Layer.FRAMES) if self._is_for(a) and a.fault.get("lost") != "request"]
        exchange = Exchange(self._line, request, raw)
        sent = spoil_answer(exchange, self._addressed(exchange.unit), faults, moment, self._reporter(""))
        if sent.before:
            self._fresh.append((moment, 0, sent.before))
        if sent.later:
            self._held += sent.later
        elif sent.answer:
            held, self._held = self._held, b""
            self._fresh.append((moment, sent.delay, held + sent.answer))

    def _request_of(self, raw: bytes) -> bytes | None:
        """The oldest request that ``raw`` can be the answer to; on RTU older ones get none any more."""
        key = self._key(raw)
        for index, asked in enumerate(self._asked):
            if self._key(asked) == key:
                for _ in range(index if self._line is LineProtocol.RTU else 0):
                    self._asked.popleft()
                self._asked.remove(asked)
                return asked
        return None

    def _key(self, raw: bytes) -> tuple[bytes, int]:
        """The common part of a request and its answer: the unit (on TCP after the transaction) and the function."""
        head = raw[:1] if self._line is LineProtocol.RTU else raw[:2] + raw[6:7]
        return head, pdu_of(self._line, raw)[0] & 0x7F

    def _addressed(self, unit: int) -> int:
        return self._units[0] if self._line is LineProtocol.TCP and len(self._units) == 1 and unit in (0, 255) else unit

    def _bytewise(self, direction: str) -> list[ActiveFault]:
        faults = self._faults.of_layer(Layer.BYTES)
        return [a for a in faults if a.fault.get("direction") == direction and self._is_for(a)]

    def _is_for(self, active: ActiveFault) -> bool:
        return self._line in active.fault.kind.lines and active.is_on(self.link, self.line_name)

    def _reporter(self, which: str) -> Callable[[ActiveFault, str], None]:
        words = [*([self.link] if self.line_name else []), *([which] if which else [])]
        place = self.line_name or self.link

        def report(active: ActiveFault, text: str) -> None:
            self._faults.act(active, self._now)
            self._faults.report(active, place, self._now, WHERE(place=words, what=text_of(text)) if words else text)

        return report


class FaultySendingPort(FaultyPort):
    """As `FaultyPort`, for a port that also sends without a request. ``is_read``: a program reads the output of the port;
    otherwise its output is no occasion for faults."""

    FIXED: ClassVar[tuple[str, ...]] = ("_is_read", "_sending")
    __slots__ = (*FIXED,)

    def __init__(
        self, port: SendingPort, link: str, faults: Faults, line: LineProtocol, *, line_name: str = "", is_read: bool = True
    ) -> None:
        self._is_read = is_read
        self._sending = port
        super().__init__(port, link, faults, line, line_name=line_name)

    def _bytewise(self, direction: str) -> list[ActiveFault]:
        return super()._bytewise(direction) if self._is_read or direction != "out" else []

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._sending.on_output

    @on_output.setter
    def on_output(self, hook: Callable[[], None] | None) -> None:
        self._sending.on_output = hook
