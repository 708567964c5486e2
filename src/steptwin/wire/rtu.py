"""Modbus RTU frames in a stream of bytes.

A frame is cut where its function makes it end and its CRC is right; silence does not cut frames, because pseudo
terminals, USB adapters and networks deliver in bursts (MIC-15). The gap only synchronises the framer after noise.

A line with several slaves carries requests and responses, and both have to be cut so that nothing inside them is taken for
a frame. At the front of the held bytes the framer tries the length that the function has as a request and the one it has
as a response. When neither can match any more, one byte is discarded and the rest is examined again, so that a good frame behind
noise is found at once. When the gap has passed, complete frames are taken wherever they are, and
a rest with a right CRC is a frame even where the length of its function is not known.
"""

from __future__ import annotations

import enum
import re
from collections import deque
from collections.abc import Collection
from functools import partial
from typing import NamedTuple

from steptwin.errors import Misuse
from steptwin.machine import MICROSECOND, MILLISECOND, SECOND, Nanos
from steptwin.state import Plain, Stateful
from steptwin.wire.crc import crc16, with_crc
from steptwin.wire.pdu import REFUSED

BROADCAST = 0
MAX_UNIT = 247
MIN_FRAME = 4
MAX_FRAME = 256

# MIC-15: the manual's gap belongs to a real UART; elsewhere delivery is bursty.
UART_GAP_NS: Nanos = 750 * MICROSECOND
BURSTY_GAP_NS: Nanos = 20 * MILLISECOND
# USB adapters (16 ms latency timer), Nagle's algorithm (40 to 200 ms) and masters that write byte by byte deliver one frame in
# pieces. The beginning of a frame is kept for this time; a new frame behind it is found at once.
PAUSE_NS: Nanos = 2 * SECOND
MAX_LOOKS = MAX_FRAME
"""Most places of one delivery that are examined and at which no frame begins. Behind them only the last 256 bytes are kept,
until the gap has passed. It bounds the cost of noise."""

# function: (length of the frame, index of a byte to be added to it or 0). Modbus application protocol V1.1b3, section 6.
_REQUEST_LENGTHS = {
    **dict.fromkeys((0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x08), (8, 0)),
    **dict.fromkeys((0x07, 0x0B, 0x0C, 0x11), (4, 0)),
    **dict.fromkeys((0x0F, 0x10), (9, 6)),
    **dict.fromkeys((0x14, 0x15), (5, 2)),
    0x16: (10, 0),
    0x17: (13, 10),
    0x18: (6, 0),
    0x2B: (7, 0),
}
_RESPONSE_LENGTHS = {
    **dict.fromkeys((0x01, 0x02, 0x03, 0x04, 0x0C, 0x11, 0x14, 0x15, 0x17), (5, 2)),
    **dict.fromkeys((0x05, 0x06, 0x08, 0x0B, 0x0F, 0x10), (8, 0)),
    0x07: (5, 0),
    0x16: (10, 0),
    0x18: (6, 3),
    **{function | REFUSED: (5, 0) for function in range(1, 0x80)},
}
_REQUESTS = tuple(_REQUEST_LENGTHS.get(function) for function in range(256))
_RESPONSES = tuple(_RESPONSE_LENGTHS.get(function) for function in range(256))
_IMPOSSIBLE = -1
_UNKNOWN_YET = MAX_FRAME + 1
"""Longer than anything held: the byte with the length has not arrived."""

_KNOWN = re.escape(bytes(sorted(_REQUEST_LENGTHS | _RESPONSE_LENGTHS)))
_FRAME_START = re.compile(rb"[\x00-\xf7](?:[" + _KNOWN + rb"]|\Z)", re.DOTALL)


class FrameRole(enum.Enum):
    """A response that repeats its request (05, 06) is recognised only after its request."""

    REQUEST = "request"
    RESPONSE = "response"
    UNKNOWN = "unknown"
    """The CRC is right, but the function or the length is not in the tables of the protocol."""


class RtuFrame(NamedTuple):
    raw: bytes
    """The whole frame with unit and CRC."""
    role: FrameRole
    end: int
    """Number of bytes received up to the end of this frame."""
    begin: Nanos = 0
    """The moment of its first byte."""
    pause: Nanos = 0
    """The longest silence inside it."""

    @property
    def unit(self) -> int:
        return self.raw[0]

    @property
    def pdu(self) -> bytes:
        return self.raw[1:-2]


class _Piece(NamedTuple):
    """Bytes of one delivery, which have no pause between them."""

    first: int
    """Number of bytes received before."""
    size: int
    begin: Nanos
    end: Nanos


def encode_frame(unit: int, pdu: bytes) -> bytes:
    """Unit, PDU and CRC. `Misuse` for a unit outside 0 to 247 or a PDU outside 1 to 253 bytes."""
    if not 0 <= unit <= MAX_UNIT:
        raise Misuse(f"unit {unit} is outside 0 to {MAX_UNIT}")
    if not 1 <= len(pdu) <= MAX_FRAME - 3:
        raise Misuse(f"a PDU of {len(pdu)} bytes is outside 1 to {MAX_FRAME - 3}")
    return with_crc(bytes((unit,)) + pdu)


def _length(table: tuple[tuple[int, int] | None, ...], frame: bytes | bytearray, start: int = 0) -> int:
    if len(frame) < start + 2:
        return _UNKNOWN_YET
    row = table[frame[start + 1]]
    if row is None:
        return _IMPOSSIBLE
    length, index = row
    if index:
        if len(frame) <= start + index:
            return _UNKNOWN_YET
        length += frame[start + index]
    return length if length <= MAX_FRAME else _IMPOSSIBLE


request_length = partial(_length, _REQUESTS)
"""Bytes of the request frame that begins at an index: more than 256 while unknown, -1 when it cannot be a request."""
response_length = partial(_length, _RESPONSES)
"""Bytes of the response frame that begins at an index: more than 256 while unknown, -1 when it cannot be a response."""


class RtuFramer(Stateful):
    """Cuts the frames of one line, at most 256 bytes held between calls.

    ``own`` are the units on this side: a frame that begins with one of them, or with the broadcast address, can only be a request
    (the echo of an adapter has to be removed before). ``gap_ns`` is the silence after which bytes of no frame are discarded,
    ``pause_ns`` the longest silence inside a frame (the gap, when that is longer). Call `expire` when `deadline` has come.
    """

    FIXED = ("_own", "_pause_ns", "gap_ns")
    __slots__ = (*FIXED, "_asked", "_burst", "_fed", "_framed", "_last", "_pieces", "_scan", "held")

    def __init__(self, own: Collection[int] = (), gap_ns: Nanos = BURSTY_GAP_NS, pause_ns: Nanos = PAUSE_NS) -> None:
        if gap_ns < 1:
            raise Misuse(f"a gap of {gap_ns} ns is not positive")
        self.gap_ns = gap_ns
        self._pause_ns = pause_ns
        self.held = bytearray()
        """Bytes not yet cut; empty when the framer is synchronised. It is always the same object."""
        self._own = frozenset(own)
        self._scan = 0  # index in `held` before which no frame begins
        self._burst = 0  # index in `held` where the bytes after the last cut or gap begin
        self._last: Nanos = 0
        self._fed = 0
        self._framed = 0
        self._asked: tuple[int, int] | None = None  # unit and function of the last request, until its response
        self._pieces: deque[_Piece] = deque()  # deliveries of which `held` consists; the first may begin before it

    @property
    def fed(self) -> int:
        """Bytes received so far."""
        return self._fed

    @property
    def unframed(self) -> int:
        """Bytes received and discarded so far."""
        return self._fed - self._framed - len(self.held)

    def set_state(self, plain: Plain) -> None:
        held = self.held
        super().set_state(plain)
        held[:] = self.held
        self.held = held

    def deadline(self) -> Nanos | None:
        """The end of the gap, if there are bytes that may have to be discarded then."""
        return None if len(self.held) == self._burst else self._last + self.gap_ns

    def feed(self, data: bytes, now: Nanos, end: Nanos | None = None) -> list[RtuFrame]:
        """The frames completed by ``data``; its first byte arrives at ``now``, its last at ``end`` (default ``now``)."""
        if self.held:
            frames = self.expire(now)
            if now - self._last > self._pause_ns and len(self.held) == self._burst:
                self._drop(len(self.held))
        else:
            frames = []
        if not data:
            return frames
        self._last = now if end is None else end
        self._pieces.append(_Piece(self._fed, len(data), now, self._last))
        self.held += data
        self._fed += len(data)
        self._cut_frames(frames)
        return frames

    def expire(self, now: Nanos) -> list[RtuFrame]:
        """The frames found if the gap has passed at ``now``; empty before that."""
        frames: list[RtuFrame] = []
        deadline = self.deadline()
        if deadline is None or now < deadline:
            return frames
        held = self.held
        while held:
            if self._is_one_unknown():
                self._take(self._burst, len(held) - self._burst, FrameRole.UNKNOWN, frames)
                self._drop(len(held))
                break
            beginning = len(held)
            start = self._next_start(self._scan)
            while start < len(held):
                length, role = self._look(start, waiting=False)
                if length > 0:
                    break
                if length == 0:
                    beginning = min(beginning, start)
                start = self._next_start(start + 1)
            else:
                self._drop(beginning)
                break
            self._take(start, length, role, frames)
            self._drop(start + length)
        self._burst = len(held)
        return frames

    def _is_one_unknown(self) -> bool:
        """Whether all bytes since the last cut or gap are one frame of a function whose length is not known."""
        rest = self.held[self._burst :]
        return MIN_FRAME <= len(rest) <= MAX_FRAME and crc16(rest) == 0 and self._look(self._burst, waiting=False)[0] <= 0

    def _cut_frames(self, frames: list[RtuFrame]) -> None:
        held = self.held
        size = len(held)
        done = looks = 0
        start = self._scan
        while start < size:
            length, role = self._look(start, waiting=True)
            if length == 0 and start < self._burst:
                # The sender may have abandoned the bytes before the gap: then a frame begins after it.
                after, after_role = self._look(self._burst, waiting=True)
                if after > 0:
                    start, length, role = self._burst, after, after_role
            if length == 0:
                break
            if length < 0:
                looks += 1
                if looks == MAX_LOOKS and size - start > MAX_FRAME:
                    self._drop(size - MAX_FRAME)
                    return
                start = self._next_start(start + 1)
                continue
            self._take(start, length, role, frames)
            start += length
            done = start
        self._scan = start
        if done:
            self._drop(done)
            self._scan = start - done
        if len(held) > MAX_FRAME:
            # Too long for one frame: the bytes before the next possible beginning are not needed any more.
            self._drop(self._scan)

    def _next_start(self, start: int) -> int:
        found = _FRAME_START.search(self.held, start)
        return len(self.held) if found is None else found.start()

    def _take(self, start: int, length: int, role: FrameRole, frames: list[RtuFrame]) -> None:
        raw = bytes(self.held[start : start + length])
        self._framed += length
        self._asked = (raw[0], raw[1]) if role is FrameRole.REQUEST else None
        first = self._fed - len(self.held) + start
        end = first + length
        begin, pause, before = None, 0, 0
        for piece in self._pieces:
            if piece.first >= end:
                break
            if piece.first + piece.size > first:
                if begin is None:
                    begin = piece.begin + (piece.end - piece.begin) * (first - piece.first) // piece.size
                else:
                    pause = max(pause, piece.begin - before)
            before = piece.end
        frames.append(RtuFrame(raw, role, end, begin or 0, pause))

    def _drop(self, count: int) -> None:
        """Remove the first ``count`` bytes; the rest is examined from its beginning."""
        del self.held[:count]
        self._burst = 0
        self._scan = 0
        pieces, first = self._pieces, self._fed - len(self.held)
        while pieces and pieces[0].first + pieces[0].size <= first:
            pieces.popleft()

    def _look(self, start: int, *, waiting: bool) -> tuple[int, FrameRole]:
        """Length and role of the frame that begins at ``start``. Length 0: a frame may still be completed there; -1: none can be.

        ``waiting``: more bytes may follow.
        """
        held = self.held
        unit = held[start]
        if unit > MAX_UNIT:
            return _IMPOSSIBLE, FrameRole.UNKNOWN
        have = len(held) - start
        mine = unit == BROADCAST or unit in self._own
        request = request_length(held, start)
        response = _IMPOSSIBLE if mine else response_length(held, start)
        first, first_role, second, second_role = request, FrameRole.REQUEST, response, FrameRole.RESPONSE
        if not mine and have > 1 and self._asked == (unit, held[start + 1]):
            first, first_role, second, second_role = response, FrameRole.RESPONSE, request, FrameRole.REQUEST
        if first > have:
            # A short response can be the beginning of a longer request by chance; the next bytes or the gap decide.
            if waiting and first <= 8:
                return 0, FrameRole.UNKNOWN
        elif first > 0 and crc16(held[start : start + first]) == 0:
            # The CRC stays right when zeros follow: the shorter of two that both match is the frame.
            if 0 < second < first and crc16(held[start : start + second]) == 0:
                return second, second_role
            return first, first_role
        if 0 < second <= have and crc16(held[start : start + second]) == 0:
            return second, second_role
        return (0 if max(first, second) > have else _IMPOSSIBLE), FrameRole.UNKNOWN
