#part IN1
#count OUT1

M1 = ON
PABS M1 40
MAIN:
    WAIT part = ON
    DELAY 0.1
    IF part = ON
        count = ON
        WAIT part = OFF
        DELAY 0.1
        count = OFF
    ENDIF
JUMP MAIN
