#there IN1
#bad IN2
#eject OUT1

MAIN:
    WAIT there = ON
    // Looks at the gauge once, at the moment at which the part comes.
    IF bad = ON
        eject = ON
    ENDIF
    WAIT there = OFF
    eject = OFF
JUMP MAIN
