"""Configuration files and names of values of a MIC488 by chance, and what is said and made of them."""

from __future__ import annotations

from collections.abc import Sequence

from chance import Chance

from steptwin.diagnostics import render
from steptwin.errors import Misuse
from steptwin.mic488.config import examine_config, keys_of, sections_of
from steptwin.mic488.configform import config_form, with_values
from steptwin.mic488.configtext import config_text
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.registermap import DataType, RegisterMap
from steptwin.mic488.registers import FIRMWARES, register_map
from steptwin.mic488.values import RegisterItem, decoded, encoded, moves, named, plan, repeatable, value_of
from steptwin.wire.pdu import encode_request

VALUES = (
    "⟨#0..4⟩", "⟨#0..21⟩", "⟨#-5..500⟩", "⟨0.5..900.0⟩", "⟨1,5|1e3|-2.5|2147483647|2147483648|0|3600000|3600001|1e39⟩",
    "⟨abc|1 000|1.2.3|+4|.5|5.|0x10|1e|--1⟩", "⟨9600|38400|12345|247|248⟩", "",
)  # fmt: skip
LINES = (
    "; note",
    "# note",
    "//",
    "nonsense",
    "=5",
    "[Axis7]",
    "[Axis0",
    "[IN3] x",
    "Gear = 5",
    "Geer=5",
    "Acc =7 ; it",
    "[axsi1]",
    "[AIN1]",
)
NAMES = (
    "M⟨#1..5⟩_⟨POS_ACT|ACC|VMAX|STATUS|POS_ABS|HOME|ENC_IMP|POSLIM_L|JOG_PLUS|STOP|EN|XYZ⟩", "⟨OUT|IN⟩⟨#1..21⟩",
    "USER_REGISTER[⟨#0..2000⟩]⟨|:int|:dint|:real|:word|:x⟩", "USER_REGISTER[⟨0|2|498|1998|7⟩]:⟨dint|real⟩", "USER_REGISTER",
    "⟨DATA_TYPE|PROGRAM_CTRL|M_STATUS|M_ENABLE|JOG_SPEED|USER_REG_SAVE|AXIS_POS_ABS_TRIG|AXIS_CTR_MODE|M_ALL_STATUS⟩⟨|[1]|:int⟩",
    "⟨|.|M1|m1_pos_act|12|M1_POS_ACT[0]⟩",
)  # fmt: skip
TYPED = ("⟨#-9..70000⟩", "⟨-9.9..9.9⟩", "⟨on|off|ON|run|0x1F|1,5|1e40|nan|inf|DIRECT|direct|stop|true|0xG|x|⟩", "0", "1")


def configuration(chance: Chance) -> str:
    """A file, not without mistakes."""
    end = chance.one(("\r\n", "\n", "\r\n"))
    lines: list[str] = [chance.one(LINES)] if chance.below(3) == 0 else []
    for section in sections_of():
        if chance.is_so():
            lines.append(chance.one((f"[{section}]", f"[{section}]", f" [ {section.upper()} ] ; it")))
            for key in keys_of(section):
                if chance.below(3) == 0:
                    lines.append(f"{key.name}{chance.one(('=', ' = ', '='))}{chance.filled(chance.one(VALUES))}")
                elif chance.below(30) == 0:
                    lines.append(chance.one(LINES))
    for _ in range(chance.below(3)):
        lines.insert(chance.below(len(lines)), chance.one(lines))
    return end.join(lines) + chance.one((end, "", end + end))


def said(chance: Chance) -> list[str]:
    """What is said of a configuration, and of changes in it."""
    text, firmware = configuration(chance), chance.one(tuple(FIRMWARES))
    data = text.encode(chance.one(("utf-8", "utf-8", "utf-16", "cp1250")))
    file = IniFile.parse(data, "c.cfg")
    assert file.to_bytes() == data
    config, findings = examine_config(file, firmware)
    form = config_form(text, "c.cfg", firmware, (1.0, None, 10.0, config.axes[3].gear))
    found = [
        text,
        repr(config),
        render(file.source, findings),
        *map(repr, findings),
        repr(form),
        config_text(config, FIRMWARES[firmware]),
    ]
    for _ in range(6):
        section = chance.one(sections_of())
        key = chance.one([key.name for key in keys_of(section)])
        value = chance.one((chance.filled(chance.one(VALUES)), " 5", "a=b", "5 ; x", "ś"))
        try:
            found.append(with_values(text, "c.cfg", {f"{chance.one((section, section, 'Axs1'))}.{key}": value}))
        except Misuse as error:
            found.append(str(error))
    return found


def valued(chance: Chance) -> list[str]:
    """What values of registers are called, what may be typed for them, and how they are read and written."""
    registers = register_map(chance.one(tuple(FIRMWARES)))
    found: list[str] = []
    known: list[RegisterItem] = []
    for _ in range(40):
        name = chance.filled(chance.one(NAMES))
        try:
            item = named(registers, name)
            known.append(item)
            found.append(f"{name} {item!r} {item.address} {item.size} {item.register.meaning}")
            found += _written(chance, registers, item)
        except Misuse as error:
            found.append(f"{name}: {error}")
    readable = [item for item in known if item.register.reads]
    for block in plan(registers, readable):
        words = [chance.below(65_536) for _ in range(block.request.count)]
        found.append(f"{block.request} {block.values(words, chance.one(tuple(DataType)))}")
    try:
        found.append(repr(plan(registers, known)))
    except Misuse as error:
        found.append(str(error))
    return found


def _written(chance: Chance, registers: RegisterMap, item: RegisterItem) -> Sequence[str]:
    typed, kind = chance.filled(chance.one(TYPED)), chance.one(tuple(DataType))
    words = [chance.below(2) for _ in range(1)] if item.size == 1 else [chance.below(65_536) for _ in range(item.size)]
    found = [f"{words} {decoded(item, words, kind)}"]
    value = value_of(item.register, typed)
    request = encoded(item, value, kind, "mm")
    found.append(f"{typed} {value} {encode_request(request).hex()} {repeatable(registers, request)} {moves(registers, request)}")
    return found
