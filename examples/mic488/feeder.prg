// Feeder: M1 pulls material until a mark passes the sensor on IN1, stops over the knife and cuts.
// The sensor interrupts, so that the length does not depend on where the program is.
// $R0 length after the mark in mm, $R2 feed speed in mm/s (written by a panel), $I10 number of cuts, $I11 1 = no mark found.

#mark IN1
#enabled IN2
#knife OUT1
#fault OUT8
#knifeTime 0,15

M1 = ON
knife = OFF
$I10 = 0
$R0 = 25
$R2 = 80
SET cuts = 0

MAIN:
$I11 = 0
fault = OFF
WAIT enabled = ON
PosM1 = 0
SET seen = 0
SET markAt = 0
CFGINT_IN1 = RIS
VABS M1 $R2
TIMA1 = 0
WHILE seen = 0
    // 500 mm without a mark, or 10 s without motion: the material has run out.
    IF PosM1 > 500
        JUMP EMPTY
    ENDIF
    IF TIMA1 > 1000
        JUMP EMPTY
    ENDIF
ENDWHILE
CFGINT_IN1 = INT_OFF
SET cutAt = markAt + $R0
PABS M1 cutAt
WAITPOS
knife = ON
DELAY knifeTime
knife = OFF
WAIT mark = OFF
cuts = cuts + 1
$I10 = cuts
JUMP MAIN

EMPTY:
CFGINT_IN1 = INT_OFF
BRAKE M1
WAIT M1 = 0
$I11 = 1
fault = ON
WAIT enabled = OFF
JUMP MAIN

INT_IN1:
SET markAt = PosM1
SET seen = 1
RETURN
