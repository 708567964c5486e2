#stamp OUT1
#alarm OUT2
#limit IN2
#place IN3

M1 = ON
PABS M1 100
WAITPOS
IF limit = ON
    JUMP MISSED
ENDIF
IF place = OFF
    JUMP MISSED
ENDIF
stamp = ON
DELAY 0.5
stamp = OFF
END

MISSED:
    alarm = ON
    WAIT alarm = OFF
