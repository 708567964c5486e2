"""Find a device by text: running twins and their controllers by name, file or address.

| text | means |
|---|---|
| nothing | the controller of the only running twin |
| ``mic488`` | the twin of this name |
| ``controller.table`` | the controller ``table`` of the twin ``controller`` |
| ``controller.toml`` | the twin that was started from this file |
| ``127.0.0.1:5021``, ``/run/…/mic488`` | an address; at that of a running twin, its controllers are known |
| ``/dev/ttyUSB0``, ``COM3``, ``tcp://host:502`` | an address of a device |

Options stand behind each of them: ``mic488,unit=2``.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from steptwin.drivers.address import device_at, split_device
from steptwin.drivers.kind import AddressSelection, DeviceAddress
from steptwin.drivers.kinds import DRIVERS
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.live.remote import START, ask, running
from steptwin.subject.commands import EndPoints

PATIENCE_S = 2.0
"""Time-out of the description of a twin, s."""
_PREFERRED = ("tcp", "rtu-tcp", "rfc2217", "pty")
"""Links that a driver on this computer can open, the fastest first."""
_HERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Local addresses of a twin that listens on all interfaces."""
_DESCRIPTIONS = (".toml", ".json")
_NAME = re.compile(r"[\w-]+(\.[\w-]+)?")
_HOST_PORT = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[\w.-]+):\d+")
_SERIAL_PORT = re.compile(r"COM\d+", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class TwinController:
    """A controller of a running twin.

    ``address``: its address on the line; None without a line. ``type``: its variant. ``places``: addresses of the line from
    this computer, the fastest first. ``scales``: unit and pulses per unit of each axis.
    """

    twin: str
    name: str
    kind: str
    line: str | None
    address: int | None
    type: str | None
    places: tuple[str, ...]
    scales: tuple[tuple[str, float], ...]

    @property
    def full_name(self) -> str:
        return self.twin if self.name == self.twin else f"{self.twin}.{self.name}"

    @property
    def selected(self) -> Mapping[str, int]:
        """Its address on the line by the option that names it; empty without one."""
        how = _selection(self.kind)
        return {} if how is None or self.address is None else {how.option: self.address}

    @property
    def selection(self) -> str:
        """``unit=1`` or ``chip=F``."""
        how = _selection(self.kind)
        return "" if how is None or self.address is None else f"{how.option}={how.show(self.address)}"

    def is_meant(self, options: Mapping[str, Any]) -> bool:
        """Whether the options behind a name select it."""
        how = _selection(self.kind)
        if options.get("kind", self.kind) != self.kind or options.keys() & _other_options(how):
            return False
        return how is None or options.get(how.option, self.address) == self.address

    def device(self, text: str, options: Mapping[str, Any]) -> DeviceAddress:
        """The device address for a driver; ``text``: the user's input, for messages. Raises `LineFailure` if no driver can
        reach it."""
        if not self.places:
            raise LineFailure(f"{self.full_name} is on no line that this computer can open: {self._why()}")
        how = _selection(self.kind)
        if how is None:
            raise LineFailure(f"{self.full_name} is of kind {self.kind}, for which there is no driver")
        known: dict[str, Any] = {"kind": self.kind, how.option: self.address, how.variant: self.type}
        return replace(device_at(text, self.places[0], {**known, **options}), scales=self.scales)

    def _why(self) -> str:
        if self.line is None:
            return "its description gives it no line"
        return f"line {self.line!r} has no pty and no network address; name a serial port at the other end of its cable"


@dataclass(frozen=True, slots=True)
class Twin:
    """A running twin, from its announcement. ``places``: addresses on this computer, with their lines."""

    name: str
    pid: int
    file: Path | None
    controllers: tuple[TwinController, ...]
    places: Mapping[str, str]

    def line_at(self, address: str) -> str | None:
        """The line that is reached at an address."""
        if "://" in address:
            return self.places.get(address)
        real = os.path.realpath(address)
        return next((line for place, line in self.places.items() if "://" not in place and os.path.realpath(place) == real), None)


# ---------------------------------------------------------------------- what runs


def running_twins() -> list[Twin]:
    """The running twins of this user, by name. Raises `Misuse` as `running`."""
    found = []
    for name in running():
        with contextlib.suppress(LineFailure, Refusal):  # ended meanwhile, or suspended
            found.append(_ask(name))
    return found


def _ask(name: str) -> Twin:
    return _twin(ask(name, EndPoints(), timeout_s=PATIENCE_S))


def _twin(announced: Mapping[str, Any]) -> Twin:
    points = [point for point in announced["end_points"] if point["kind"] in _PREFERRED and point["line"] is not None]
    points.sort(key=lambda point: _PREFERRED.index(point["kind"]))
    places: dict[str, str] = {_place(point): point["line"] for point in points}
    name, file = announced["name"], announced["file"]
    controllers = tuple(_controller(name, each, places) for each in announced["controllers"])
    return Twin(name, announced["pid"], None if file is None else Path(file), controllers, places)


def _place(point: Mapping[str, Any]) -> str:
    """The address of an end point from this computer."""
    if point["kind"] == "pty":
        return str(point["path"])
    host = _HERE.get(point["host"], point["host"])
    return f"{point['kind']}://{f'[{host}]' if ':' in host else host}:{point['port']}"


def _controller(twin: str, announced: Mapping[str, Any], places: Mapping[str, str]) -> TwinController:
    line, how = announced["line"], _selection(announced["kind"])
    address = None if how is None or how.option not in announced else how.read(str(announced[how.option]))
    reached = () if line is None else tuple(place for place, there in places.items() if there == line)
    variant = None if how is None else announced.get(how.variant)
    scales = tuple((axis["unit"], axis["pulses_per_unit"]) for axis in announced["axes"])
    return TwinController(twin, announced["name"], announced["kind"], line, address, variant, reached, scales)


def _selection(kind: str) -> AddressSelection | None:
    """The option that selects a controller; None for a kind without drivers."""
    return DRIVERS[kind].selection if kind in DRIVERS else None


def _other_options(how: AddressSelection | None) -> set[str]:
    """Options that select controllers of other kinds."""
    return {kind.selection.option for kind in DRIVERS.values()} - ({how.option} if how else set())


# ---------------------------------------------------------------------- which one is meant


def find_device(text: str | None, *, whole_line: bool = False) -> DeviceAddress:
    """The address of the device that ``text`` names; None: the controller of the only running twin.

    ``whole_line``: for commands to several chips of one line, of which none is selected. Raises `Misuse` if several fit,
    `LineFailure` if none does.
    """
    place, options = (None, dict[str, Any]()) if text is None else split_device(text)
    shown = text or ""
    of_twin = _named(place)
    if of_twin is None:
        address = address_of(place or "")
        there = _controllers_at(address) if "kind" not in options else ()
        found = device_at(shown, address, {**({"kind": there[0].kind} if there else {}), **options})
        return replace(found, scales=next((each.scales for each in there if each.address == found.number), ()))
    meant = [each for each in of_twin if each.is_meant(options)]
    if whole_line and len(meant) > 1 and len({each.line for each in meant}) == 1 and all(map(_may_be_open, meant)):
        types = {each.type for each in meant}
        line = replace(meant[0], address=None, type=types.pop() if len(types) == 1 else None)
        return line.device(shown, options)
    if len(meant) != 1:
        raise _unclear(shown, of_twin, meant)
    return meant[0].device(shown, options)


def _may_be_open(controller: TwinController) -> bool:
    how = _selection(controller.kind)
    return how is not None and how.may_be_open


def controller_of(text: str | None) -> TwinController | None:
    """The controller of a running twin that ``text`` names, by name, file or address; None for another device. Errors as of
    `find_device`."""
    place, options = (None, dict[str, Any]()) if text is None else split_device(text)
    of_twin = _named(place)
    if of_twin is None:
        of_twin = _controllers_at(address_of(place or ""))
        if not of_twin:
            return None
    meant = [each for each in of_twin if each.is_meant(options)]
    if len(meant) != 1:
        raise _unclear(text or "", of_twin, meant)
    return meant[0]


def find_controller(text: str | None) -> tuple[str, str | None]:
    """The running twin that ``text`` names (None: the only one), and its controller where ``text`` selects one.

    Errors as of `find_device`; `Misuse` for a device that is not a twin.
    """
    place, options = (None, dict[str, Any]()) if text is None else split_device(text)
    of_twin = _named(place)
    if of_twin is None:
        of_twin = _controllers_at(address_of(place or ""))
        if not of_twin:
            raise Misuse(f"{text} is not a running twin, and this command is for twins: {_there()}")
    meant = [each for each in of_twin if each.is_meant(options)]
    if not meant:
        raise _unclear(text or "", of_twin, meant)
    selects = bool(options) or "." in (place or "")
    return meant[0].twin, meant[0].name if len(meant) == 1 and selects else None


def _named(place: str | None) -> Sequence[TwinController] | None:
    """The controllers of the twin with this name or file; None if it is neither. Only that twin is queried."""
    if place is None:
        names = running()
        if len(names) > 1:
            raise Misuse(f"several twins are running: name one with --device (-d): {', '.join(names)}")
        if not names:
            raise LineFailure(f"no twin is running: {START}, or name a device with --device (-d) or STEPTWIN_DEVICE")
        return _ask(names[0]).controllers
    if Path(place).suffix in _DESCRIPTIONS and "://" not in place:
        file = Path(place).absolute()
        started = [twin for twin in running_twins() if twin.file == file]
        if len(started) != 1:
            raise LineFailure(f"no running twin was started from {place}: {_there()}. 'steptwin up {place}' starts one")
        return started[0].controllers
    name, dot, controller = place.partition(".")
    if not _NAME.fullmatch(place) or name not in running():
        return None
    twin = _ask(name)
    called = [each for each in twin.controllers if not dot or each.name.upper() == controller.upper()]
    found = called or [each for each in twin.controllers if controller.upper() in each.selection.upper().split("=")[1:]]
    if not found:
        raise Misuse(f"{name} has no controller {controller!r}: there are {', '.join(each.name for each in twin.controllers)}")
    return found


def address_of(place: str) -> str:
    """Parse ``place`` as an address. Raises `LineFailure` for text that can only be a name."""
    if "://" in place:
        return place.replace("//localhost:", "//127.0.0.1:")
    if _HOST_PORT.fullmatch(place):
        address = f"tcp://{place.replace('localhost:', '127.0.0.1:')}"
        known = [known for twin in running_twins() for known in twin.places] if _is_here(address) else []
        return next((each for each in known if each.endswith(address[len("tcp:") :])), address)
    if not _NAME.fullmatch(place) or _SERIAL_PORT.fullmatch(place) or Path(place).exists():
        return place
    raise LineFailure(f"no twin named {place!r} is running: {_there()}; a serial port is named as /dev/ttyUSB0 or COM3")


def _is_here(address: str) -> bool:
    """Whether a twin of this computer could have this address. For others no twin is queried, because a suspended one would
    delay a stop."""
    if "://" not in address:
        return os.path.realpath(address).startswith("/dev/pts/")
    return address.partition("://")[2].startswith(("127.", "[::1]"))


def _controllers_at(address: str) -> Sequence[TwinController]:
    """The controllers that are reached at an address of a running twin."""
    if not _is_here(address):
        return ()
    for twin in running_twins():
        line = twin.line_at(address)
        if line is not None:
            return [each for each in twin.controllers if each.line == line]
    return ()


def _unclear(text: str, of_twin: Sequence[TwinController], meant: Sequence[TwinController]) -> Misuse:
    listed = ", ".join(f"{each.full_name} ({' '.join(filter(None, (each.kind, each.selection)))})" for each in meant or of_twin)
    if meant:
        return Misuse(f"{meant[0].twin} has several controllers: name one with --device (-d): {listed}")
    return Misuse(f"device {text!r}: no controller fits its options: there are {listed}")


def _there() -> str:
    names = running()
    return f"running twins are {', '.join(names)}" if names else f"no twin is running; {START}"
