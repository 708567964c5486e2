#stamp OUT1
#alarm OUT2
#place IN1

M1 = ON
MAIN:
    PABS M1 100
    WAITPOS
    DELAY 0.02
    IF place = OFF
        alarm = ON
        WAIT alarm = OFF
    ENDIF
    stamp = ON
    DELAY 0.1
    stamp = OFF
    PABS M1 0
    WAITPOS
JUMP MAIN
