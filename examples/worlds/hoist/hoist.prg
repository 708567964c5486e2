// Serves three floors. Between two trips the brake holds the load and the drive is off.

#release OUT1
#arrived OUT2
#released IN2

SET floor = 300
M1 = ON
release = ON
WAIT released = ON
HOME M1 -40
WAITPOS

MAIN:
    PABS M1 floor
    WAITPOS
    release = OFF
    WAIT released = OFF
    DELAY 0.1
    M1 = OFF
    arrived = ON
    DELAY 4
    arrived = OFF
    M1 = ON
    release = ON
    WAIT released = ON
    IF floor = 300
        floor = 500
    ELSE
        floor = 20
    ENDIF
JUMP MAIN
