"""The stored file of an E type as bytes: what survives without power.

Layout: version, number of labels, for each label its number and its place (two bytes, low first), then the commands as they
lie in the memory. No bytes at all: nothing is stored.
"""

from __future__ import annotations

from steptwin.errors import Misuse
from steptwin.m1486.commands import When, when
from steptwin.m1486.encoding import encode
from steptwin.m1486.memory import StoredFile
from steptwin.m1486.ranges import out_of_range
from steptwin.m1486.syntax import ChipCommand, ParsedProgram
from steptwin.m1486.variants import Variant
from steptwin.messages import Message

_VERSION = 1
_HEAD = 2
_LABEL = 3


def pack(image: StoredFile) -> bytes:
    labels = b"".join(bytes((label, place & 0xFF, place >> 8)) for label, place in sorted(image.labels.items()))
    return bytes((_VERSION, len(image.labels))) + labels + image.code


NO_STORED_FILE = Message("m1486.no-stored-file", "this is not the stored file of an M1486")
STORED_FILE_IS_TOO_LONG = Message("m1486.stored-file-is-too-long", "the stored file takes {size} bits: {title} has {memory}")
STORED_FILE_HAS_OTHER_LABELS = Message(
    "m1486.stored-file-has-other-labels", "the stored file has labels that {title} does not have: permitted are 1 to {most}"
)


def unpack(data: bytes, variant: Variant) -> StoredFile | None:
    """The file in ``data``, None if it is empty. Raises `Misuse` if it has another format or does not fit the variant."""
    if not data:
        return None
    begin = _HEAD + _LABEL * data[1] if len(data) >= _HEAD else 0
    if data[0] != _VERSION or not _HEAD <= begin <= len(data):
        raise Misuse(NO_STORED_FILE())
    code = data[begin:]
    labels = {data[i]: data[i + 1] | data[i + 2] << 8 for i in range(_HEAD, begin, _LABEL)}
    if 8 * len(code) > variant.memory_bits:
        raise Misuse(STORED_FILE_IS_TOO_LONG(size=8 * len(code), title=variant.title, memory=variant.memory_bits))
    if any(place > len(code) or not 1 <= label <= variant.labels for label, place in labels.items()):
        raise Misuse(STORED_FILE_HAS_OTHER_LABELS(title=variant.title, most=variant.labels))
    return StoredFile(code, labels)


def stored_commands(program: ParsedProgram) -> list[ChipCommand]:
    """The commands and labels between ``[`` and ``]``; all of a program that has none around it."""
    commands = program.all_commands
    is_file = len(commands) > 1 and (commands[0].key, commands[-1].key) == ("[", "]")
    return commands[1:-1] if is_file else commands


CANNOT_BE_STORED = Message(
    "m1486.cannot-be-stored", "{command} cannot be stored: a program to switch on with is one file for one chip"
)


def image_of(program: ParsedProgram, variant: Variant) -> bytes:
    """The stored file after downloading a program, with or without ``[ ]`` around it.

    Raises `Misuse` for a program that is more than one file for one chip, or that the variant does not take.
    """
    commands = stored_commands(program)
    code = b""
    labels: dict[int, int] = {}
    for command in commands:
        why = out_of_range(command, variant)
        if why is not None:
            raise Misuse(why)
        if command.key == "@":
            labels[command.number or 0] = len(code)
        elif when(command.key, command.number) is When.QUEUED:
            code += encode(command)
        else:
            raise Misuse(CANNOT_BE_STORED(command=command))
    image = pack(StoredFile(code, labels))
    unpack(image, variant)
    return image
