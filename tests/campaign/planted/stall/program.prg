#stamp OUT1

M1 = ON
MAIN:
    PABS M1 100
    WAITPOS
    stamp = ON
    DELAY 0.1
    stamp = OFF
    PABS M1 0
    WAITPOS
JUMP MAIN
