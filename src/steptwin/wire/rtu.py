"""Modbus RTU frames in a stream of bytes.

::

    unit | function | data … | CRC, low byte | CRC, high byte        4 to 256 bytes

The function gives the length, for some with a count among the data. The CRC over a whole frame with its own CRC is 0.

A frame is cut where its function makes it end and its CRC is right; silence does not cut frames, because pseudo
terminals, USB adapters and networks deliver in bursts (MIC-15). A burst is what comes without a silence as long as the gap.

Nothing is executed that may be the middle of a frame. Frames follow each other from the beginning of a burst. Where the bytes can
be the beginning of a frame whose end has not come, nothing behind is a frame until

* later bytes complete it, or show that it is none: then a frame may begin one byte later, but what lies within the length of a
  frame whose CRC is wrong is its data; or
* a later burst begins with a whole frame and a silence follows: the sender has given up the earlier frame.

A line with several slaves carries requests and responses: at each place the framer tries the length that the function has as a
request and the one it has as a response. When a burst has ended, a rest with a right CRC is a frame even where the length of its
function is not known.

Nothing bounds the search in noise: a cut could fall into a frame, and a byte of noise costs at most about five times as much as
one of a request (2 µs instead of 0.4 µs on an EPYC server).
"""

from __future__ import annotations

import enum
import re
from collections import deque
from collections.abc import Collection
from functools import partial
from typing import NamedTuple

from steptwin.controller import MICROSECOND, MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse
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
# pieces. The beginning of a frame is kept for this time.
PAUSE_NS: Nanos = 2 * SECOND
DELAY_NS: Nanos = 200 * MILLISECOND
"""The longest of these pauses that is usual. A request behind an unfinished frame waits for it, with other bytes behind it."""

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


class _NewRequest(NamedTuple):
    """A whole frame behind an unfinished one."""

    start: int
    length: int
    role: FrameRole
    silence: Nanos
    """The silence after which it counts."""


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
    """Cuts the frames of one line, at most 256 bytes held between calls. How a burst is divided into deliveries changes nothing.

    ``own`` are the units on this side: a frame that begins with one of them, or with the broadcast address, can only be a request
    (the echo of an adapter has to be removed before). ``gap_ns`` is the silence that ends a burst, ``pause_ns`` the longest
    silence inside a frame (the gap, when that is longer). Call `expire` when `deadline` has come.
    """

    FIXED = ("_own", "_pause_ns", "gap_ns")
    __slots__ = (*FIXED, "_asked", "_beginnings", "_due", "_fed", "_framed", "_garbled", "_last", "_pieces", "_scan", "held")

    def __init__(self, own: Collection[int] = (), gap_ns: Nanos = BURSTY_GAP_NS, pause_ns: Nanos = PAUSE_NS) -> None:
        if gap_ns < 1:
            raise Misuse(f"a gap of {gap_ns} ns is not positive")
        self.gap_ns = gap_ns
        self._pause_ns = max(pause_ns, gap_ns)
        self.held = bytearray()
        """Bytes not yet cut; empty when the framer is synchronised. It is always the same object."""
        self._own = frozenset(own)
        self._scan = 0  # index in `held` before which no frame begins
        self._last: Nanos = 0
        self._due: Nanos | None = None
        self._fed = 0
        self._framed = 0
        self._garbled = 0  # number of bytes received up to the end of a frame whose CRC is wrong
        self._beginnings = [0]  # numbers of bytes received before the bursts of which `held` consists and after the last frame
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
        """The moment at which a silence that lasts until then decides about held bytes; None if none does."""
        return self._due

    def feed(self, data: bytes, now: Nanos, end: Nanos | None = None) -> list[RtuFrame]:
        """The frames completed by ``data``; its first byte arrives at ``now``, its last at ``end`` (default ``now``)."""
        frames = self.expire(now)
        if not data:
            return frames
        silence = now - self._last
        if silence > self._pause_ns:
            self._drop(len(self.held))
        if silence >= self.gap_ns and self._fed not in self._beginnings:
            self._beginnings.append(self._fed)
        self._last = now if end is None else end
        self._pieces.append(_Piece(self._fed, len(data), now, self._last))
        self.held += data
        self._fed += len(data)
        self._cut_frames(frames)
        return frames

    def expire(self, now: Nanos) -> list[RtuFrame]:
        """The frames found if the silence has been long enough at ``now``; empty before `deadline`."""
        frames: list[RtuFrame] = []
        if self._due is not None and now >= self._due:
            self._cut_frames(frames, now - self._last)
        return frames

    def _cut_frames(self, frames: list[RtuFrame], silence: Nanos = 0) -> None:
        """Take every frame that is one for certain; ``silence`` is that after the last byte."""
        held = self.held
        size, first = len(held), self._fed - len(held)
        has_ended = silence >= self.gap_ns
        self._due = None if has_ended else self._last + self.gap_ns
        start = self._scan
        if has_ended and self._beginnings:
            start = min(start, self._beginnings[-1] - first)  # the whole burst may be a frame of unknown length
        done = 0
        while start < size:
            length, role = self._whole(start) if has_ended else self._look(start, waiting=True)
            if length == 0 and has_ended and (request := self._new_request(start)) is not None:
                if silence < request.silence:
                    self._due = self._last + request.silence
                else:
                    start, length, role = request.start, request.length, request.role
            if length == 0:
                break
            if (length < 0 or first + start + length <= self._garbled) and self._is_refuted(start, length):
                start = self._next_start(start + 1)
                continue
            self._take(start, length, role, frames)
            start += length
            done = start
        if done:
            self._drop(done)
            start -= done
        if has_ended or len(held) > MAX_FRAME:
            # Nothing before the next possible beginning is needed any more.
            self._drop(start)
            start = 0
        self._scan = start
        if not held:
            self._due = None

    def _whole(self, start: int) -> tuple[int, FrameRole]:
        """As `_look` when the burst has ended: all of its bytes behind the last frame may be one of unknown length."""
        length, role = self._look(start, waiting=False)
        if length <= 0 and self._beginnings and self._fed - len(self.held) + start == self._beginnings[-1]:
            rest = self.held[start:]
            if MIN_FRAME <= len(rest) <= MAX_FRAME and crc16(rest) == 0:
                return len(rest), FrameRole.UNKNOWN
        return length, role

    def _new_request(self, behind: int) -> _NewRequest | None:
        """The first whole frame at the beginning of a burst that counts instead of the unfinished frame at ``behind``, if any.

        Bytes after it and pauses inside it make it more probable that it is data of the unfinished frame, whose rest comes later.
        """
        size, first = len(self.held), self._fed - len(self.held)
        found = []
        for beginning in self._beginnings:
            start = beginning - first
            length, role = self._whole(start) if start > behind else (0, FrameRole.UNKNOWN)
            if length <= 0:
                continue
            end, following = start + length, 1
            while end < size and following > 0:
                following = self._whole(end)[0]
                end += following
            pause = min(self._times(beginning, length)[1], DELAY_NS) if end >= size else DELAY_NS
            found.append(_NewRequest(start, length, role, self.gap_ns + (pause if pause >= self.gap_ns else 0)))
        return min(found, key=lambda request: request.silence, default=None)

    def _is_refuted(self, start: int, length: int) -> bool:
        """Whether no frame begins at ``start``, or only in the data of a garbled one. Notes the end of a garbled one."""
        at = self._fed - len(self.held) + start
        if at not in self._beginnings:
            return length < 0 or at + length <= self._garbled
        if length < 0 and self.held[start] <= MAX_UNIT:
            response = _IMPOSSIBLE if self._is_mine(self.held[start]) else response_length(self.held, start)
            self._garbled = max(self._garbled, at + request_length(self.held, start), at + response)
        return length < 0

    def _next_start(self, start: int) -> int:
        found = _FRAME_START.search(self.held, start)
        return len(self.held) if found is None else found.start()

    def _take(self, start: int, length: int, role: FrameRole, frames: list[RtuFrame]) -> None:
        raw = bytes(self.held[start : start + length])
        self._framed += length
        self._asked = (raw[0], raw[1]) if role is FrameRole.REQUEST else None
        first = self._fed - len(self.held) + start
        end = first + length
        self._beginnings = [end, *(beginning for beginning in self._beginnings if beginning > end)]
        frames.append(RtuFrame(raw, role, end, *self._times(first, length)))

    def _times(self, first: int, length: int) -> tuple[Nanos, Nanos]:
        """The moment of the first of ``length`` bytes and the longest silence between them; ``first`` were received before."""
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
        return begin or 0, pause

    def _drop(self, count: int) -> None:
        """Remove the first ``count`` bytes; the rest is examined from its beginning."""
        del self.held[:count]
        self._scan = 0
        pieces, first = self._pieces, self._fed - len(self.held)
        while pieces and pieces[0].first + pieces[0].size <= first:
            pieces.popleft()
        while self._beginnings and self._beginnings[0] < first:
            del self._beginnings[0]

    def _is_mine(self, unit: int) -> bool:
        """Whether a frame that begins with ``unit`` can only be a request."""
        return unit == BROADCAST or unit in self._own

    def _look(self, start: int, *, waiting: bool) -> tuple[int, FrameRole]:
        """Length and role of the frame that begins at ``start``. Length 0: a frame may still be completed there; -1: none can be.

        ``waiting``: more bytes may follow.
        """
        held = self.held
        unit = held[start]
        if unit > MAX_UNIT:
            return _IMPOSSIBLE, FrameRole.UNKNOWN
        have = len(held) - start
        mine = self._is_mine(unit)
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


class StrictRtuFramer(RtuFramer):
    """Cuts frames as the controller does (MIC-15).

    A silence above 750 µs ends a burst. A burst that is not whole frames from its first byte to its last, or has more than 256
    bytes, is dropped.
    """

    __slots__ = ()

    def __init__(self, own: Collection[int] = ()) -> None:
        super().__init__(own, UART_GAP_NS + 1, UART_GAP_NS + 1)

    def _cut_frames(self, frames: list[RtuFrame], silence: Nanos = 0) -> None:
        held = self.held
        if silence < self.gap_ns:
            self._due = self._last + self.gap_ns
            del held[MAX_FRAME + 1 :]
            while len(self._pieces) > MAX_FRAME + 1:
                self._pieces.pop()
            return
        self._due = None
        found, end = [], 0
        while end < len(held) <= MAX_FRAME:
            length, role = self._whole(end)
            if length <= 0:
                found.clear()
                break
            found.append((end, length, role))
            end += length
        for start, length, role in found:
            self._take(start, length, role, frames)
        self._drop(len(held))
