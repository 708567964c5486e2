// The demo machine takes workpieces off one conveyor with a suction cup and puts them on another.

#ejector OUT1
#busy OUT2
#infeed OUT3
#isHeld IN10
#isThere IN11
#up 5
#down 45

M1 = ON
M2 = ON
M3 = ON
OUTPUTS = 0

// z first, so that nothing is touched on the way
HOME M3 -15
WAITPOS
HOME M1 -60
HOME M2 -60
WAITPOS
SET done = 0

MAIN:
    infeed = ON
    PABS M1 30
    PABS M2 130
    WAIT isThere = ON
    infeed = OFF
    WAITPOS
    busy = ON
    JUMP LOWER
    ejector = ON
    WAIT isHeld = ON
    JUMP RAISE
    PABS M1 210
    PABS M2 40
    WAITPOS
    JUMP LOWER
    ejector = OFF
    WAIT isHeld = OFF
    JUMP RAISE
    busy = OFF
    done = done + 1
JUMP MAIN

LOWER:
PABS M3 down
WAITPOS
RETURN

RAISE:
PABS M3 up
WAITPOS
RETURN
