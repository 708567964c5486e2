"""Value change dumps (IEEE 1364): the signals at the terminals, for waveform viewers such as GTKWave.

STEP and DIR, or the two phase currents, of every axis; all pins; position and velocity, the true position of mechanics that can
be elsewhere, and the positions of what axes move, as real numbers; program lines, frames, events and faults as text. One unit of
time is a nanosecond. Whole pulse lists become text at once (`vcdtext`), so that a pulse costs less than a tenth of a microsecond.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import replace
from operator import itemgetter
from typing import IO, NamedTuple, TypeAlias

import numpy as np

from steptwin import __version__
from steptwin.controller import MILLISECOND, Nanos
from steptwin.files.export.polyline import curve
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.tracetracks import TraceTracks
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.files.export.vcdtext import Times, Tokens, changes_text
from steptwin.motion import Profile
from steptwin.motion.divisions import Plan, StepTrain, profile_of
from steptwin.motion.pulses import pulse_runs, step_times
from steptwin.motion.waveforms import PERIOD, currents
from steptwin.simulation.mechanics.channels import PhaseOutputs, StepOutputs

_WINDOW_CHANGES = 1 << 20
"""About how many changes are in memory at a time."""
_TEXT_NS = 1 * MILLISECOND
"""A text (frame, event) ends after this time, so that a following equal text is visible."""

_Quiet: TypeAlias = list[tuple[Nanos, bytes]]
"""Single changes: moments and tokens."""


def write_vcd(tracks: TraceTracks, file: IO[bytes], progress: TimeProgress, *, texts: bool = True) -> None:
    """Without ``texts`` there are no signals of type string, an extension of GTKWave that sigrok does not read."""
    dump = _Dump(tracks if texts else replace(tracks, marks=tracks.of("statement")))
    file.write(dump.header())
    for after, until in _windows(tracks):
        file.writelines(dump.changes(after, until))
        progress(until)
    if tracks.until > dump.latest:
        file.write(b"#%d\n" % tracks.until)


def _windows(tracks: TraceTracks) -> Iterator[tuple[Nanos, Nanos]]:
    """Consecutive windows of time with few enough changes each."""
    after, size = tracks.begin, tracks.until - tracks.begin
    while after < tracks.until:
        until = min(after + size, tracks.until)
        pulses = sum(track.most_pulses(after, until) for track in tracks.axes)
        if 2 * pulses > _WINDOW_CHANGES and size > 1:
            size //= 2
            continue
        yield after, until
        after = until
        if 8 * pulses < _WINDOW_CHANGES:
            size *= 2


class _Dump:
    """All variables of a dump, and the sources of their changes."""

    def __init__(self, tracks: TraceTracks) -> None:
        self._begin = tracks.begin
        self.latest = tracks.begin
        """The moment of the last change given."""
        self._declared: dict[str, list[str]] = {name: [] for name in tracks.controllers}
        self._initial: list[bytes] = []
        self._codes = 0
        self._tokens: list[bytes] = []
        """Those of the pulses: each train of pulses or pair of currents knows where its own begin."""
        self._trains: list[_Train] = []
        self._phases: list[_Phases] = []
        quiet: _Quiet = []
        pins = {(pin.controller, pin.pin): pin for pin in tracks.pins}
        for track in tracks.axes:
            self._add_outputs(track, pins, tracks, quiet)
            self._add_motion(track, tracks, quiet)
        for track in tracks.moved:
            points = curve(track, tracks.begin, tracks.until)
            self._add_real(track.controller, track.plain_name, points.times, points.positions, quiet)
        for pin in tracks.pins:
            self._add_pin(pin, tracks, quiet)
        self._add_texts(tracks, quiet)
        quiet.sort(key=lambda change: change[0])
        self._quiet_times: Times = np.array([time for time, _ in quiet], dtype=np.int64)
        self._quiet_tokens = [token for _, token in quiet]

    # ------------------------------------------------------------------ declarations

    def _declare(self, controller: str, kind: str, width: int, name: str) -> bytes:
        """The code of a new variable."""
        number, self._codes = self._codes, self._codes + 1
        code = chr(33 + number % 94)
        while number >= 94:
            number = number // 94 - 1
            code += chr(33 + number % 94)
        self._declared[controller].append(f"$var {kind} {width} {code} {_name(name)} $end\n")
        return code.encode()

    def header(self) -> bytes:
        lines = [f"$version steptwin {__version__} $end\n$timescale 1 ns $end\n"]
        for controller, variables in self._declared.items():
            lines += [f"$scope module {_name(controller)} $end\n", *variables, "$upscope $end\n"]
        head = "".join(lines) + f"$enddefinitions $end\n#{self._begin}\n$dumpvars\n"
        return head.encode() + b"".join(self._initial) + b"$end\n"

    def _add_outputs(self, track: AxisTrack, pins: dict[tuple[str, str], PinTrack], tracks: TraceTracks, quiet: _Quiet) -> None:
        outputs = track.view.outputs
        first = len(self._tokens)
        if isinstance(outputs, StepOutputs):
            code = self._declare(track.controller, "wire", 1, outputs.step)
            rest, pulse = (b"1", b"0") if outputs.active_low else (b"0", b"1")
            self._tokens += [pulse + code + b"\n", rest + code + b"\n"]
            self._initial.append(self._tokens[first + 1])
            self._trains.append(_Train(track, first, outputs.width_ns))
            if outputs.dir is not None:
                code = self._declare(track.controller, "wire", 1, outputs.dir)
                reversals = _reversals(track, tracks.until, outputs.width_ns)
                done = bisect_right(reversals, tracks.begin, key=itemgetter(0))
                direction = reversals[max(done - 1, 0)][1] if reversals else 1
                self._initial.append(_bit(direction > 0, code))
                quiet += [(time, _bit(direction > 0, code)) for time, direction in reversals[max(done, 1) :]]
        else:
            for phase in outputs.phases:
                code = self._declare(track.controller, "integer", 8, phase)
                self._tokens += [b"b%s %s\n" % (format(value & 255, "08b").encode(), code) for value in range(-127, 128)]
            phases = _Phases(track, first, outputs, pins.get((track.controller, outputs.characteristic_pin)))
            self._initial += [self._tokens[token] for token in phases.at(tracks.begin)]
            self._phases.append(phases)

    def _add_motion(self, track: AxisTrack, tracks: TraceTracks, quiet: _Quiet) -> None:
        view = track.view
        coordinate = track.coordinate()
        points = curve(coordinate or track, tracks.begin, tracks.until)
        scale = view.pulses_per_unit
        self._add_real(track.controller, view.position_name, points.times, [p / scale for p in points.positions], quiet)
        self._add_real(track.controller, view.velocity_name, points.times, [v / scale for v in points.velocities], quiet)
        if coordinate is not None:
            points = curve(track, tracks.begin, tracks.until)
            self._add_real(track.controller, view.counted_name, points.times, [p / scale for p in points.positions], quiet)
        load = track.true()
        if load is not None and view.mechanics is not None:
            points, scale = curve(load, tracks.begin, tracks.until), load.view.pulses_per_unit
            name = view.mechanics.position_name
            self._add_real(track.controller, name, points.times, [p / scale for p in points.positions], quiet)

    def _add_real(self, controller: str, name: str, times: list[Nanos], values: list[float], quiet: _Quiet) -> None:
        code = self._declare(controller, "real", 64, name)
        tokens = [b"r%r %s\n" % (value, code) for value in values]
        self._initial.append(tokens[0] if tokens else b"r0.0 %s\n" % code)
        quiet += _drawn_to(times, tokens)

    def _add_pin(self, pin: PinTrack, tracks: TraceTracks, quiet: _Quiet) -> None:
        code = self._declare(pin.controller, *(("real", 64) if pin.analog else ("wire", 1)), pin.pin)
        level = pin.level(tracks.begin)
        if pin.analog:
            if level is not None:
                self._initial.append(b"r%r %s\n" % (level, code))
            quiet += [(time, b"r%r %s\n" % (value, code)) for time, value in pin.changes(tracks.begin, tracks.until)]
        else:
            self._initial.append(_bit(level == 1.0, code))
            quiet += [(time, _bit(value == 1.0, code)) for time, value in pin.changes(tracks.begin, tracks.until)]

    def _add_texts(self, tracks: TraceTracks, quiet: _Quiet) -> None:
        """One variable for each link and direction, for the lines of each program, for events, faults and inputs."""
        changes: dict[tuple[str, str, str], _Quiet] = {}
        for time, controller, kind, subject, value, _ in tracks.marks:
            name = f"{kind}s" if kind in {"event", "fault", "input"} else f"{subject}_line" if kind == "statement" else subject
            text = value.hex(" ") if isinstance(value, bytes) else str(value) if kind == "statement" else f"{subject} {value}"
            changes.setdefault((controller, kind, name), []).append((time, text.encode()))
        for (controller, kind, name), texts in changes.items():
            if kind == "statement":
                code = self._declare(controller, "integer", 32, name)
                self._initial.append(b"b0 %s\n" % code)
                quiet += [(time, b"b%s %s\n" % (format(int(line), "b").encode(), code)) for time, line in texts]
                continue
            code = self._declare(controller, "string", 1, name)
            self._initial.append(b"s %s\n" % code)
            for i, (time, text) in enumerate(texts):
                quiet.append((time, b"s%s %s\n" % (_escaped(text), code)))
                gone = time + _TEXT_NS
                if gone < tracks.until and (i + 1 == len(texts) or gone < texts[i + 1][0]):
                    quiet.append((gone, b"s %s\n" % code))

    # ------------------------------------------------------------------ changes

    def changes(self, after: Nanos, until: Nanos) -> list[bytes]:
        """The text of all changes with ``after`` < time <= ``until``."""
        begin, end = np.searchsorted(self._quiet_times, [after, until], side="right").tolist()
        parts = [part for train in self._trains for part in train.changes(after, until)]
        parts += [part for phases in self._phases for part in phases.changes(after, until)]
        parts.append((self._quiet_times[begin:end], np.arange(end - begin) + len(self._tokens)))
        times = np.concatenate([times for times, _ in parts])
        if not len(times):
            return []
        chosen = np.concatenate([chosen for _, chosen in parts])
        order = np.argsort(times, kind="stable")
        self.latest = int(times[order[-1]])
        return changes_text(times[order], chosen[order], self._tokens + self._quiet_tokens[begin:end])


class _Train(NamedTuple):
    """The STEP line of an axis. Token ``first`` begins a pulse, the next one ends it."""

    track: AxisTrack
    first: int
    width_ns: Nanos

    def changes(self, after: Nanos, until: Nanos) -> Iterator[tuple[Times, Tokens]]:
        """A pulse ends after its width, or half-way to the next one. So pulses before and after the window matter too."""
        lists = [_pulses(plan, a, b) for plan, a, b in self.track.intervals(after - self.width_ns, until + 2 * self.width_ns)]
        begins = np.concatenate(lists) if lists else np.empty(0, dtype=np.int64)
        if not len(begins):
            return
        ends = begins + self.width_ns
        np.minimum(ends[:-1], begins[:-1] + (begins[1:] - begins[:-1]) // 2, out=ends[:-1])
        for token, times in ((self.first, begins), (self.first + 1, ends)):
            low, high = np.searchsorted(times, [after, until], side="right").tolist()
            yield times[low:high], np.full(high - low, token)


class _Phases(NamedTuple):
    """The phase currents of an axis. Token ``first`` is −127 in the first phase; those of the second follow."""

    track: AxisTrack
    first: int
    outputs: PhaseOutputs
    chosen: PinTrack | None
    """The characteristic, where it changes."""

    def changes(self, after: Nanos, until: Nanos) -> Iterator[tuple[Times, Tokens]]:
        cuts = [] if self.chosen is None else [time for time, _ in self.chosen.changes(after, until)]
        for i, (begin, end) in enumerate(zip([after, *cuts], [*cuts, until], strict=True)):
            table = self._table(begin)
            for plan, a, b in self.track.intervals(begin, end):
                times = _pulses(plan, a, b)
                before = plan.count(max(a, profile_of(plan).start))
                angles = np.append(before, _positions(plan, a, b)) % PERIOD
                for tokens in table:
                    chosen = tokens[angles]
                    differs = chosen[1:] != chosen[:-1]
                    yield times[differs], chosen[1:][differs]
            if i < len(cuts):
                moment = np.array([end], dtype=np.int64)
                for token in self.at(end):
                    yield moment, np.array([token])

    def at(self, now: Nanos) -> tuple[int, int]:
        """Both tokens at ``now``."""
        plan = self.track.plan(now)
        theta = plan.count(max(now, profile_of(plan).start)) % PERIOD
        first, second = self._table(now)
        return int(first[theta]), int(second[theta])

    def _table(self, now: Nanos) -> tuple[Tokens, Tokens]:
        """The tokens of both phases by electrical angle, with the characteristic in force at ``now``."""
        level = None if self.chosen is None else self.chosen.level(now)
        characteristic = self.outputs.characteristic if level is None else int(level)
        values = np.array([currents(characteristic, theta) for theta in range(PERIOD)]) + 127 + self.first
        return values[:, 0], values[:, 1] + 255


# ---------------------------------------------------------------------- pulses of a plan


def _pulses(plan: Plan, after: Nanos, until: Nanos) -> Times:
    if isinstance(plan, StepTrain):
        return step_times(plan, after, until)
    runs = pulse_runs(plan, after, until)
    return runs[0][1] if len(runs) == 1 else np.concatenate([np.empty(0, dtype=np.int64), *(times for _, times in runs)])


def _positions(plan: Plan, after: Nanos, until: Nanos) -> Tokens:
    """The counted position after each of the pulses."""
    profile = profile_of(plan)
    after, until = max(after, profile.start), max(until, profile.start)
    if isinstance(plan, StepTrain):
        begin, end = plan.count(after) * plan.direction, plan.count(until) * plan.direction
        parts = [np.empty(0, dtype=np.int64)]
        for first, last, grid in plan.intervals():
            low, high = first * plan.direction, end if last is None else min(last * plan.direction, end)
            reached = np.arange(low + grid, high + 1, grid)
            parts.append(reached[reached > begin] * plan.direction)
        return np.concatenate(parts)
    count = plan.count(after)
    parts = [np.empty(0, dtype=np.int64)]
    for direction, times in pulse_runs(plan, after, until):
        parts.append(count + direction * np.arange(1, len(times) + 1))
        count += direction * len(times)
    return np.concatenate(parts)


def _reversals(track: AxisTrack, until: Nanos, width_ns: Nanos) -> list[tuple[Nanos, int]]:
    """Changes of direction from the first plan on: as the motion that way begins, but not within a pulse."""
    reversals: list[tuple[Nanos, int]] = []
    for plan, after, end in track.intervals(track.times[0], until):
        profile = profile_of(plan)
        for begin, last, direction in _ways(profile, after, end):
            if reversals and reversals[-1][1] == direction:
                continue
            following = profile.pulse_time(profile.count(begin) + direction, begin)
            if following is None or following > last:
                continue
            before = [time for p, a, b in track.intervals(begin - width_ns, begin) for time in _pulses(p, a, b).tolist()]
            at = max(begin, min(before[-1] + width_ns, (before[-1] + following) // 2)) if before else begin
            reversals.append((at, direction))
    return reversals


def _ways(profile: Profile, after: Nanos, until: Nanos) -> Iterator[tuple[Nanos, Nanos, int]]:
    """(begin, end, direction) of every interval of one direction."""
    legs = list(profile.legs(max(after, profile.start)))
    for i, (begin, direction) in enumerate(legs):
        following = legs[i + 1][0] if i + 1 < len(legs) else until
        if begin < until:
            yield begin, min(following, until), direction


# ---------------------------------------------------------------------- text


def _bit(high: bool, code: bytes) -> bytes:
    return (b"1" if high else b"0") + code + b"\n"


def _name(name: str) -> str:
    """Readers take blanks as ends and dots as levels of hierarchy."""
    return re.sub(r"[^\w&$+-]+", "_", name)


def _escaped(text: bytes) -> bytes:
    """Printable characters without blanks; others as GTKWave reads them."""
    return b"".join(bytes([c]) if 33 <= c < 127 and c != ord("\\") else b"\\x%02x" % c for c in text)


def _drawn_to(times: list[Nanos], tokens: list[bytes]) -> _Quiet:
    """At a jump the previous value is written a nanosecond before, because viewers draw lines between changes."""
    quiet: _Quiet = []
    for i, (time, token) in enumerate(zip(times, tokens, strict=True)):
        jumps = i + 1 < len(times) and times[i + 1] == time
        at = time - 1 if jumps else time
        if i and at > times[0] and (tokens[i - 1] != token or not jumps):
            quiet.append((at, token))
    return quiet
