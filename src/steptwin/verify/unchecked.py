"""The assumptions that no check decides, each with the reason.

With the tables of checks these are all ids of docs/assumptions.md.
"""

from __future__ import annotations

from collections.abc import Mapping

_MOTION = "needs motions whose trajectory is measured at STEP and DIR, or at the phases"
_HOMING = "needs a homing run with switches"
_PROGRAM = "needs a program in the controller, and its download protocol is not documented"
_CHIP_PROGRAM = "needs a program of its own in the memory of the chip, which would replace the present one"
_POWER = "needs power off and on"
_PINS = "needs levels at the pins of the chip"


def _spread(groups: Mapping[str, str]) -> dict[str, str]:
    return {id_: reason for ids, reason in groups.items() for id_ in ids.split()}


OF_MIC488: dict[str, str] = _spread(
    {
        "MIC-6": "JOG_SPEED cannot be read, so it could not be put back",
        "MIC-9 MIC-11 MIC-13 MIC-14 MIC-18 MIC-29 MIC-40 MIC-41": _MOTION,
        "MIC-12": "a move to the end of DINT shows it, or power off and on",
        "MIC-16": "a trigger moves axes",
        "MIC-19": "needs an encoder and a motor that is held",
        "MIC-20 MIC-21 MIC-30": _HOMING,
        "MIC-26": "needs a program error or a position error",
        "MIC-27": _POWER,
        "MIC-31": "needs a program that may be stopped",
        " ".join(f"WBC-{n}" for n in (*range(1, 13), *range(14, 15), *range(16, 27))): _PROGRAM,
        "WBC-13": "the form of these statements is unknown",
        "WBC-15 WBC-27": "needs a program that reads vision records",
        "WBC-40 WBC-42": "about the vendor's compiler, not the controller",
        "WBC-41": _PROGRAM,
    }
)
OF_M1486: dict[str, str] = _spread(
    {
        "M-3 M-4 M-6 M-7 M-8 M-9 M-10 M-16 M-18 M-26 M-28 M-34 M-39 M-40 M-41": _MOTION,
        "M-5 M-12 M-14 M-17 M-20 M-24 M-29 M-35": _CHIP_PROGRAM,
        "M-13": "needs writes to counters",
        "M-19": "needs a time base finer than the line",
        "M-21 M-25 M-42": _PINS,
        "M-23 M-30 M-31": "needs the pin RST or SHUTDOWN, and the address pins",
        "M-27 M-45": "K stops what runs, and needs a full buffer to tell",
        "M-33": "needs several chips that send at the same moment",
        "M-37": _POWER,
        "M-46": "nothing sets them",
        "M-44": "wrong data have no answer that tells them from a command",
    }
)
