// Takes workpieces from the infeed to the outfeed.

#lower OUT1
#ejector OUT2
#infeed OUT3
#outfeed OUT4
#isDown IN2
#isUp IN3
#isThere IN4
#isHeld IN5
#pick 50
#place 350

M1 = ON
OUTPUTS = 0
HOME M1 -100
WAITPOS
outfeed = ON

MAIN:
    PABS M1 pick
    WAITPOS
    infeed = ON
    WAIT isThere = ON
    infeed = OFF
    lower = ON
    WAIT isDown = ON
    ejector = ON
    WAIT isHeld = ON
    lower = OFF
    WAIT isUp = ON
    PABS M1 place
    WAITPOS
    lower = ON
    WAIT isDown = ON
    ejector = OFF
    WAIT isHeld = OFF
    lower = OFF
    WAIT isUp = ON
JUMP MAIN
