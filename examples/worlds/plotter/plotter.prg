// Draws an octagon with a pen on a gantry: M1 moves the pen along the beam, M2 and M3 move the ends of the beam.

#pen OUT1
#done OUT2
#alarm OUT3
#start IN4
#skewed IN5

OUTPUTS = 0
M1 = ON
M2 = ON
M3 = ON

// Each end of the beam finds its own switch: that squares the beam.
HOME M1 -20
HOME M2 -20
HOME M3 -20
WAITPOS

MAIN:
WAIT start = ON
done = OFF
MOVEPTP @corner1
WAITPOS
pen = ON
DELAY 0.1
SET n = 1
WHILE n < 9
    MOVEPTP n
    WAITPOS
    IF skewed = ON
        JUMP STOPPED
    ENDIF
    n = n + 1
ENDWHILE
pen = OFF
done = ON
JUMP MAIN

STOPPED:
pen = OFF
M1 = OFF
M2 = OFF
M3 = OFF
alarm = ON
WAIT alarm = OFF
