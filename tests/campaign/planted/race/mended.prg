#there IN1
#bad IN2
#eject OUT1

MAIN:
    WAIT there = ON
    WHILE there = ON
        IF bad = ON
            eject = ON
        ENDIF
    ENDWHILE
    eject = OFF
JUMP MAIN
