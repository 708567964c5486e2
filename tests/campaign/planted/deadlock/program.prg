#start IN1
#other IN2
#ask OUT1
#works OUT2

MAIN:
    WAIT start = ON
    ask = ON
    // The other machine needs so long to see it.
    DELAY 0.05
    WAIT other = OFF
    works = ON
    DELAY 0.3
    works = OFF
    ask = OFF
    WAIT start = OFF
JUMP MAIN
