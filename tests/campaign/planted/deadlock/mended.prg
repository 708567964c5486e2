#start IN1
#other IN2
#second IN3
#ask OUT1
#works OUT2

MAIN:
    WAIT start = ON
AGAIN:
    ask = ON
    DELAY 0.05
    // Looked at once: who does not see the other one here was seen by it.
    IF other = ON
        IF second = ON
            ask = OFF
        ENDIF
        WAIT other = OFF
        IF ask = OFF
            JUMP AGAIN
        ENDIF
    ENDIF
    works = ON
    DELAY 0.3
    works = OFF
    ask = OFF
    WAIT start = OFF
JUMP MAIN
