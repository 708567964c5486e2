"""Programs into chips, from files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from steptwin.drivers.kind import DeviceAddress, Log, Progress, SentProgram
from steptwin.drivers.m1486.download import parts
from steptwin.drivers.m1486.sync import M1486, M1486Line, download_to
from steptwin.errors import Misuse
from steptwin.m1486.syntax import parse


def send(
    address: DeviceAddress, file: Path, text: str, progress: Progress, check: Callable[[], object], log: Log | None
) -> SentProgram:
    """Download a program into the chips it selects with ``X``, or into the one addressed; it runs from its ``]`` on."""
    addresses = _addressed(text, address.number, file)
    with M1486Line(address.place, baud=address.baud, log=log) as line:
        chips = {a: M1486(line, a, variant=address.variant, timeout_s=address.timeout) for a in addresses}
        for chip in chips.values():
            chip.open()
            check()
        uploaded = download_to(chips.values(), text, first=chips.get(address.number), progress=progress, name=str(file))
    title = next(iter(chips.values())).variant.title
    started = _started(text)
    names = [None if a is None else f"{a:X}" for a in addresses]
    where = f"the {title}" if len(addresses) == 1 else f"chips {', '.join(f'{a:X}' for a in addresses)} ({title})"
    return SentProgram(
        {"file": str(file), "type": title, "chips": names, "started": started is not None, "uploaded": uploaded.hex(" ")},
        f"{file} is in {where}{started or ''}" + (f"; it uploaded {uploaded.hex(' ')}" if uploaded else ""),
    )


def _started(text: str) -> str | None:
    """What a downloaded program already does, as the end of a sentence; None if it cannot move the motor."""
    keys = {command.key for command in parse(text).program.commands}
    if "]" in keys:
        return " and was started by its ]: the motor may move; 'steptwin stop --program' ends it"
    return " and its commands were executed while it was sent: the motor may move" if keys & {"R", "(", ")", "J"} else None


def _addressed(text: str, chip: int | None, file: Path) -> list[int | None]:
    """The chips a program is for: those it selects with X, and ``chip`` for commands before the first X. Errors in it are
    reported later."""
    named = dict.fromkeys(chip if address is None else address for address, _ in parts(parse(text).program))
    if None in named and len(named) > 1:
        raise Misuse(f"{file} was not sent: the commands before its first X need a chip: --device ADDRESS,chip=N")
    return list(named) or [chip]
