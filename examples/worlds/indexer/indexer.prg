// Indexes from nest to nest. A table that stands beside its nest is searched for once, then it is an alarm.

#lock OUT1
#alarm OUT2
#inNest IN2
#isLocked IN3
#isFree IN4

OUTPUTS = 0
M1 = ON
WAIT isFree = ON
HOME M1 -60
WAITPOS
// Home is the end of its cam.
SET nest = 0

MAIN:
    nest = nest + 45
    PABS M1 nest
    WAITPOS
    IF inNest = OFF
        PREL M1 0,4
        WAITPOS
    ENDIF
    IF inNest = OFF
        JUMP STOPPED
    ENDIF
    lock = ON
    WAIT isLocked = ON
    DELAY 0.2
    lock = OFF
    WAIT isFree = ON
JUMP MAIN

STOPPED:
    alarm = ON
    WAIT alarm = OFF
