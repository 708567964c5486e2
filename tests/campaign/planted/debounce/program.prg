#part IN1
#count OUT1

M1 = ON
PABS M1 40
MAIN:
    WAIT part = ON
    count = ON
    WAIT part = OFF
    count = OFF
JUMP MAIN
