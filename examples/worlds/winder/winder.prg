// Winds a cable in layers. The dancer switches the reel on and off; the traverse follows the encoder on the reel, 8 mm for each turn, so
// that it lays on while the reel runs up and coasts, too.

#reel OUT1
#feed OUT2
#full OUT3
#fresh OUT4
#slack IN2
#tight IN3
#long IN4
#start IN5

OUTPUTS = 0
M1 = ON
HOME M1 -40
WAITPOS
full = ON

BEGIN:
    PABS M1 0
    WAITPOS
    WAIT start = ON
    fresh = ON              // a new reel: no layers, no cable
    DELAY 0.1
    fresh = OFF
    ENC1 = 0
    there = 0
    full = OFF
    feed = ON

WIND:
    IF slack = ON
        reel = ON
    ENDIF
    IF tight = ON
        reel = OFF
    ENDIF
    IF long = ON
        JUMP STOPPED
    ENDIF
    FOLLOW:
    p = ENC1 / 50          // 400 counts for a turn
    p = p - there
    IF p > 320             // to and fro
        there = there + 320
        p = p - 320
    ENDIF
    IF p > 160
        p = 320 - p
    ENDIF
    PABS M1 p
    IF full = OFF
        JUMP WIND
    ENDIF
    IF TIMA1 < 300
        JUMP FOLLOW
    ENDIF
JUMP BEGIN

STOPPED:                    // the reel coasts
    feed = OFF
    reel = OFF
    full = ON
    TIMA1 = 0
JUMP FOLLOW
