// The demo machine takes parts on one side of the table and lays them down in a row on the other.

#gripper OUT1
#busy OUT2
#up 5
#down 45
#gripTime 0,3
#pitch 30

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

MAIN:
SET place = 0
WHILE place < 5
    busy = ON
    PABS M1 30
    PABS M2 130
    WAITPOS
    JUMP LOWER
    gripper = ON
    DELAY gripTime
    JUMP RAISE
    SET target = place * pitch
    target = target + 90
    PABS M1 target
    PABS M2 40
    WAITPOS
    JUMP LOWER
    gripper = OFF
    DELAY gripTime
    JUMP RAISE
    busy = OFF
    place = place + 1
    DELAY 1
ENDWHILE
JUMP MAIN

LOWER:
PABS M3 down
WAITPOS
RETURN

RAISE:
PABS M3 up
WAITPOS
RETURN
