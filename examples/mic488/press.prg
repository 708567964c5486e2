// Press: M1 drives the ram with an encoder. It presses to a depth while the encoder is compared with the commanded position;
// a part that is too hard or missing shows in the lag. Two-hand start on IN1 and IN2, light curtain on IN4 (1 = free).

#left IN1
#right IN2
#curtain IN4
#good OUT1
#bad OUT2
#ready OUT3
#approach 60
#pressing 8
#depth 42,5
#touch 30
#safe 0,5
#mostLag 0,4

M1 = ON
SET pieces = 0
SET rejects = 0
HOME M1 -20
WAITPOS
ENC1 = 0
CFGINT_IN4 = FALL

MAIN:
ready = ON
// Both hands, and not one of them tied down: both must have been off.
WAIT left = OFF
WAIT right = OFF
WAIT left = ON
TIMA1 = 0
WAIT right = ON
IF TIMA1 > 50
    JUMP MAIN
ENDIF
ready = OFF
good = OFF
bad = OFF
VmaxM1 = approach
PABS M1 touch
WAITPOS
VmaxM1 = pressing
SET worst = 0
PABS M1 depth
WHILE StatM1 = M_POS_SEARCH
    SET lag = PosM1 - XENC1
    worst = max(worst, lag)
    IF worst > mostLag
        BRAKE M1
    ENDIF
ENDWHILE
$R20 = worst
IF StatM1 = M_POS_ERROR
    JUMP REJECT
ELSE
    IF worst > mostLag
        JUMP REJECT
    ELSE
        good = ON
        pieces = pieces + 1
        $I0 = pieces
    ENDIF
ENDIF
JUMP BACK
JUMP MAIN

REJECT:
bad = ON
rejects = rejects + 1
$I1 = rejects
RETURN

BACK:
VmaxM1 = approach
PABS M1 0
WAITPOS
RETURN

// The light curtain is broken. With the ram up nobody is in danger; otherwise stop at once, wait until the curtain is free,
// bring the ram back and leave the cycle for good.
INT_IN4:
IF PosM1 <= safe
    RETURN
ENDIF
STOP M1
ready = OFF
bad = ON
WAIT curtain = ON
JUMP BACK
JUMP MAIN
