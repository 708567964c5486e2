// Gives each product a label: pulls the web to the next mark.

#belt OUT1
#given OUT2
#alarm OUT3
#product IN1
#mark IN2
#speed 200
// 60 mm at 200 mm/s are 0.3 s; half a label more is 0.45 s.
#most 45

OUTPUTS = 0
M1 = ON
belt = ON

MAIN:
    WAIT product = OFF
    WAIT product = ON
    given = OFF
    TIMA1 = 0
    VABS M1 speed
    WAIT mark = OFF
    WHILE mark = OFF
        IF TIMA1 > most
            JUMP MISSING
        ENDIF
    ENDWHILE
    STOP M1
    given = ON
JUMP MAIN

MISSING:
    STOP M1
    belt = OFF
    alarm = ON
    WAIT alarm = OFF
