"""Generated worlds of M1486 chips on one line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from steptwin.simulation.describe.generated import LINE, InputChange, TomlTable, Whole, generated_world

HOST = "host"
"""The script that sends lines to chips."""
_EXAMPLE = """
# An axis with a switch that the program waits for:
#
# [[axis]]
# name = "x"
# drive = "{controller}.M1"
# unit = "mm"
# pitch = 5.0
#
# [[axis.switch]]
# below = 0.0
# to = "{controller}.LIMIT"
# contact = "NC"
"""


def m1486_world(
    whole: Whole,
    addresses: Sequence[int],
    values: Mapping[str, object],
    wires: Iterable[tuple[str, str]] = (),
    *,
    typed: Iterable[str] = (),
    changes: Iterable[InputChange] = (),
) -> str:
    """M1486 chips by their addresses, all with the same ``values`` of ``[[m1486]]``; wires between ``CHIP.PIN``.

    ``typed``: lines that a host sends as soon as all chips have room for them.
    """
    tables = [TomlTable("m1486", {"name": chip_name(one), "line": LINE, "address": one, **values}) for one in addresses]
    tables += [TomlTable("wire", {"from": source, "to": target}) for source, target in wires]
    tables += _host([chip_name(one) for one in addresses], typed)
    return generated_world(whole, "m1486", tables, changes, _EXAMPLE.format(controller=chip_name(addresses[0])))


def chip_name(address: int) -> str:
    """Name of a chip: ``chip7``, ``chipF``."""
    return f"chip{address:X}"


def _host(chips: Sequence[str], lines: Iterable[str]) -> Iterator[TomlTable]:
    room = " and ".join(f"{chip}.room" for chip in chips)
    steps = [step for line in lines for step in ({"until": room}, {"send": LINE, "text": f"{line}\r"})]
    if steps:
        yield TomlTable("script", {"name": HOST, "steps": steps}, remark="A host that sends lines as chips have room for them.")
