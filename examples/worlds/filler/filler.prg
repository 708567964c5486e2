// Fills bottles by weight on a rotary table of eight nests. A transfer brings an empty bottle from the infeed and takes a full one to the
// outfeed at once. A bottle that is too light or too heavy is remembered, and pushed off the outfeed when its encoder says that it is there.

#across OUT1
#down OUT2
#jaws OUT3
#valve OUT4
#reject OUT5
#belt OUT6
#isAcross IN2
#isBack IN3
#isDown IN4
#isUp IN5
#waits IN6
#present IN7

OUTPUTS = 0
pending = 0
bad = 0
next = 0
last = 0
CFGINT_TICK = HIGH
M1 = ON
belt = ON
HOME M1 -30
WAITPOS
SET angle = 0

MAIN:
    WAIT waits = ON
    down = ON
    WAIT isDown = ON
    jaws = ON
    DELAY 0.3
    down = OFF
    WAIT isUp = ON
    across = ON
    WAIT isAcross = ON
    down = ON
    WAIT isDown = ON
    jaws = OFF
    DELAY 0.3
    IF last = 1
        due = ENC1 + 2300      // 230 mm to the pusher
        pending = 1
    ENDIF
    down = OFF
    WAIT isUp = ON
    across = OFF
    WAIT isBack = ON

    angle = angle + 45
    PABS M1 angle
    WAITPOS
    last = next
    next = bad
    bad = 0
    DELAY 0.1
    IF present = ON
        TIMA1 = 0
        valve = ON
        FILL:
        IF AIN1 < 8.55         // 537 g: what comes while the valve closes is still to be added
            IF TIMA1 < 320     // 3.2 s: more than it ever takes
                JUMP FILL
            ENDIF
        ENDIF
        valve = OFF
        DELAY 0.4
        IF AIN1 < 8.5
            bad = 1
        ENDIF
        IF AIN1 > 9
            bad = 1
        ENDIF
    ENDIF
JUMP MAIN

INT_TICK:
    IF pending = 2
        IF TIMA2 > 60
            reject = OFF
            pending = 0
        ENDIF
    ENDIF
    IF pending = 1
        IF ENC1 > due
            reject = ON
            TIMA2 = 0
            pending = 2
        ENDIF
    ENDIF
RETURN
