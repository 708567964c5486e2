// Where a program can wait for ever.
M1 = ON
n = 0
flag = 0
HOME M1 -5
WAITPOS
POLL:
IF IN1 = ON
    JUMP WORK
ENDIF
IF $R4 > 2
    JUMP WORK
ENDIF
JUMP POLL
WORK:
WHILE flag = 0
    n = n + 1
ENDWHILE
WHILE n < 10
    n = n + 1
ENDWHILE
WHILE n > 3
    OUT1 = ON
ENDWHILE
WHILE IN3 = OFF
    n = n + 1
    IF n > 100
       JUMP POLL
    ENDIF
ENDWHILE
WHILE PosM1 < 3
    OUT2 = ON
ENDWHILE
JUMP POLL
INT_IN2:
flag = 1
RETURN
