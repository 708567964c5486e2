// One stroke for each time both hands come: the hands are released before the next one.

#ask OUT1
#hands IN1
#down IN2
#up IN3

MAIN:
    WAIT hands = OFF
    WAIT up = ON
    ask = ON
    WAIT hands = ON
    WHILE hands = ON
        IF down = ON
            ask = OFF
        ENDIF
    ENDWHILE
    ask = OFF
JUMP MAIN
