"""A transcription of the manuals' tables of registers, 3.1 and 3.2, typed from each manual, in the manual's own columns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

BITS = """
6000 6001 6002 6003 6004 6005 6006 6007 | OUT1 OUT2 OUT3 OUT4 OUT5 OUT6 OUT7 OUT8 | 01 | 05
5000 5001 5002 5003 5004 5005 5006 5007 5008 5009 | IN1 IN2 IN3 IN4 IN5 IN6 IN7 IN8 IN9 IN10 | 02 |
5010 5011 5012 5013 5014 5015 5016 5017 5018 5019 | IN11 IN12 IN13 IN14 IN15 IN16 IN17 IN18 IN19 IN20 | 02 |
2000 2001 2002 2003 | M1_EN M2_EN M3_EN M4_EN | | 05
2004 2005 2006 2007 | M1_STOP M2_STOP M3_STOP M4_STOP | | 05
2008 2009 | M1_JOG_PLUS M1_JOG_MINUS | | 05
2010 2011 | M2_JOG_PLUS M2_JOG_MINUS | | 05
2012 2013 | M3_JOG_PLUS M3_JOG_MINUS | | 05
2014 2015 | M4_JOG_PLUS M4_JOG_MINUS | | 05
"""
BITS_OF_1_70_ONLY = """
2100 2101 2102 | USER_REG_READ USER_REG_SAVE USER_REG_ZERO | | 05
"""

# Manual 1.23 in English. The first address of POSLIM_L is printed 1114, which is ENC4_XPOS; 1120 is meant.
REGISTERS_1_23 = """
1000 | DATA_TYPE | WORD | 03 | 06
1001 | PROG_BANK_SEL | WORD | 03 | 06
1002 | POS_BANK_SEL | WORD | 03 | 06
1003 | PROGRAM_CTRL | WORD | 03 | 06
1004 | AXIS_CTR_MODE | WORD | 03 | 06
1005 | AXIS_VEL_ABS_TRIG | WORD | 03 | 06
1006 | AXIS_VEL_REL_TRIG | WORD | 03 | 06
1007 | AXIS_POS_ABS_TRIG | WORD | 03 | 06
1008 | AXIS_POS_REL_TRIG | WORD | 03 | 06
1009 | M_ALL_STATUS | WORD | 03 |
1010 1011 1012 1013 | M1_STATUS M2_STATUS M3_STATUS M4_STATUS | WORD | 03 |
1014 | M_ENABLE | WORD | | 06
1015 | M_DISABLE | WORD | | 06
1016 | M_STOP | WORD | | 06
1017 | JOG_SPEED | REAL | | 06
1020 1022 1024 1026 | M1_POS_ACT M2_POS_ACT M3_POS_ACT M4_POS_ACT | REAL/DINT | 03 | 10
1028 1030 1032 1034 | M1_VEL_ACT M2_VEL_ACT M3_VEL_ACT M4_VEL_ACT | REAL/DINT | 03 |
1036 1038 1040 1042 | M1_ACC M2_ACC M3_ACC M4_ACC | REAL/DINT | 03 | 10
1044 1046 1048 1050 | M1_DEC M2_DEC M3_DEC M4_DEC | REAL/DINT | 03 | 10
1052 1054 1056 1058 | M1_VMAX M2_VMAX M3_VMAX M4_VMAX | REAL/DINT | 03 | 10
1060 1062 1064 1066 | M1_HOME M2_HOME M3_HOME M4_HOME | REAL/DINT | | 10
1068 1070 1072 1074 | M1_VEL_ABS M2_VEL_ABS M3_VEL_ABS M4_VEL_ABS | REAL/DINT | | 10
1076 1078 1080 1082 | M1_VEL_REL M2_VEL_REL M3_VEL_REL M4_VEL_REL | REAL/DINT | | 10
1084 1086 1088 1090 | M1_POS_ABS M2_POS_ABS M3_POS_ABS M4_POS_ABS | REAL/DINT | | 10
1092 1094 1096 1098 | M1_POS_REL M2_POS_REL M3_POS_REL M4_POS_REL | REAL/DINT | | 10
1100 1102 1104 1106 | ENC1_IMP ENC2_IMP ENC3_IMP ENC4_IMP | DINT | 03 | 10
1108 1110 1112 1114 | ENC1_XPOS ENC2_XPOS ENC3_XPOS ENC4_XPOS | REAL/DINT | 03 | 10
1120 1122 1124 1126 | M1_POSLIM_L M2_POSLIM_L M3_POSLIM_L M4_POSLIM_L | REAL/DINT | 03 | 10
1128 1130 1132 1134 | M1_POSLIM_R M2_POSLIM_R M3_POSLIM_R M4_POSLIM_R | REAL/DINT | 03 | 10
"""

# Manual 1.70 in Polish. Its table still lists 10009 as M_ALL_STATUS, its section 4.7 describes M_STATUS there.
REGISTERS_1_70 = """
10000 | DATA_TYPE | WORD | 03 | 06
10001 | PROG_BANK_SEL | WORD | 03 | 06
10002 | POS_BANK_SEL | WORD | 03 | 06
10003 | PROGRAM_CTRL | WORD | 03 | 06
10004 | AXIS_CTR_MODE | WORD | 03 | 06
10005 | AXIS_VEL_ABS_TRIG | WORD | 03 | 06
10006 | AXIS_VEL_REL_TRIG | WORD | 03 | 06
10007 | AXIS_POS_ABS_TRIG | WORD | 03 | 06
10008 | AXIS_POS_REL_TRIG | WORD | 03 | 06
10009 | M_STATUS | WORD | 03 |
10010 10011 10012 10013 | M1_STATUS M2_STATUS M3_STATUS M4_STATUS | WORD | 03 |
10014 | M_ENABLE | WORD | | 06
10015 | M_DISABLE | WORD | | 06
10016 | M_STOP | WORD | | 06
10017 | JOG_SPEED | REAL | | 06
10020 10022 10024 10026 | M1_POS_ACT M2_POS_ACT M3_POS_ACT M4_POS_ACT | REAL/DINT | 03 | 10
10028 10030 10032 10034 | M1_VEL_ACT M2_VEL_ACT M3_VEL_ACT M4_VEL_ACT | REAL/DINT | 03 |
10036 10038 10040 10042 | M1_ACC M2_ACC M3_ACC M4_ACC | REAL/DINT | 03 | 10
10044 10046 10048 10050 | M1_DEC M2_DEC M3_DEC M4_DEC | REAL/DINT | 03 | 10
10052 10054 10056 10058 | M1_VMAX M2_VMAX M3_VMAX M4_VMAX | REAL/DINT | 03 | 10
10060 10062 10064 10066 | M1_HOME M2_HOME M3_HOME M4_HOME | REAL/DINT | | 10
10068 10070 10072 10074 | M1_VEL_ABS M2_VEL_ABS M3_VEL_ABS M4_VEL_ABS | REAL/DINT | | 10
10076 10078 10080 10082 | M1_VEL_REL M2_VEL_REL M3_VEL_REL M4_VEL_REL | REAL/DINT | | 10
10084 10086 10088 10090 | M1_POS_ABS M2_POS_ABS M3_POS_ABS M4_POS_ABS | REAL/DINT | | 10
10092 10094 10096 10098 | M1_POS_REL M2_POS_REL M3_POS_REL M4_POS_REL | REAL/DINT | | 10
10100 10102 10104 10106 | ENC1_IMP ENC2_IMP ENC3_IMP ENC4_IMP | DINT | 03 | 10
10108 10110 10112 10114 | ENC1_XPOS ENC2_XPOS ENC3_XPOS ENC4_XPOS | REAL/DINT | 03 | 10
10120 10122 10124 10126 | M1_POSLIM_L M2_POSLIM_L M3_POSLIM_L M4_POSLIM_L | REAL/DINT | 03 | 10
10128 10130 10132 10134 | M1_POSLIM_R M2_POSLIM_R M3_POSLIM_R M4_POSLIM_R | REAL/DINT | 03 | 10
"""
# Revision history: 1.40 brings the addresses and the memory, 1.70 M_STATUS and the USER_REG_ bits.
REGISTERS_1_40 = REGISTERS_1_70.replace("M_STATUS |", "M_ALL_STATUS |", 1)

TABLES = {
    "1.23": (BITS, REGISTERS_1_23, 500),
    "1.40": (BITS, REGISTERS_1_40, 2000),
    "1.70": (BITS + BITS_OF_1_70_ONLY, REGISTERS_1_70, 2000),
}
"""By firmware: bits, registers, number of user registers."""
BASES = {"1.23": 1000, "1.40": 10000, "1.70": 10000}
WORDS_OF = {"WORD": 1, "DINT": 2, "REAL": 2, "REAL/DINT": 2}


class Listed(NamedTuple):
    address: int
    name: str
    kind: str
    reads: tuple[int, ...]
    writes: tuple[int, ...]


def _codes(cell: str) -> tuple[int, ...]:
    return (int(cell, 16),) if cell else ()


def _rows(table: str) -> Iterator[list[str]]:
    for line in table.split("\n"):
        if line:
            yield [cell.strip() for cell in line.split("|")]


def listed(firmware: str) -> list[Listed]:
    """The rows of a manual, one for each bit and register."""
    bits, registers, _ = TABLES[firmware]
    found: list[Listed] = []
    for addresses, names, reads, writes in _rows(bits):
        pairs = zip(addresses.split(), names.split(), strict=True)
        found += [Listed(int(address), bit, "BIT", _codes(reads), _codes(writes)) for address, bit in pairs]
    for addresses, names, kind, reads, writes in _rows(registers):
        pairs = zip(addresses.split(), names.split(), strict=True)
        found += [Listed(int(address), register, kind, _codes(reads), _codes(writes)) for address, register in pairs]
    return [*found, Listed(0, "USER_REGISTER", "WORD/DINT/REAL", (3,), (6, 16))]


def controls(firmware: str, *, is_word: bool) -> list[Listed]:
    """The control registers of one word, or those of two."""
    return [one for one in listed(firmware) if one.kind in WORDS_OF and (WORDS_OF[one.kind] == 1) is is_word]
