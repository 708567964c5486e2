// Stacks boxes on a pallet. Where the motors lose their power their places are lost, too: each motion is repeated after homing.

#cup OUT1
#unbrake OUT2
#full OUT3
#holdBelt OUT4
#nextPallet OUT8
#isThere IN4
#isHeld IN5
#hasPower IN6
#start IN7
#hasPallet IN8
#homeSpeed -150

// In mm. Home is above the box that waits on the belt, so high that a box in the cup passes over it.
#top 0
#atBelt 109
#atPallet 259
#firstX 300
#firstY 160
#pitchX 130
#pitchY 110
#boxHeight 80
#columns 3
#rows 2
#boxes 12

OUTPUTS = 0
SET isLost = ON
CFGINT_IN6 = FALL
SET n = 0

MAIN:
nextPallet = ON
n = 0
WHILE n < boxes
    SET x = 0
    SET y = 0
    SET z = top
    JUMP GO
    WAIT isThere = ON
    z = atBelt
    JUMP GO
    cup = ON
    WAIT isHeld = ON
    holdBelt = ON
    z = top
    JUMP GO
    holdBelt = OFF
    WAIT hasPallet = ON
    nextPallet = OFF
    JUMP PLACE_OF_N
    JUMP GO
    z = atPallet - lift
    JUMP GO
    cup = OFF
    n = n + 1
    WAIT isHeld = OFF
    z = top
    JUMP GO
ENDWHILE

// The pallet leaves when its stop lets it go.
full = ON
WAIT hasPallet = OFF
full = OFF
JUMP MAIN

// The place of box n, cell by cell and layer by layer.
PLACE_OF_N:
    SET column = n % columns
    SET left = n - column
    left = left / columns
    SET row = left % rows
    SET layer = left - row
    layer = layer / rows
    x = column * pitchX
    x = x + firstX
    y = row * pitchY
    y = y + firstY
    SET lift = layer * boxHeight
RETURN

// Goes to x and y, then to z.
GO:
    SET isDone = OFF
    WHILE isDone = OFF
        IF isLost = ON
            JUMP HOMING
        ENDIF
        PABS M1 x
        PABS M2 y
        WAITPOS
        PABS M3 z
        WAITPOS
        IF isLost = OFF
            isDone = ON
        ENDIF
    ENDWHILE
RETURN

HOMING:
    WHILE isLost = ON
        isLost = OFF
        WAIT hasPower = ON
        WAIT start = ON
        M1 = ON
        M2 = ON
        M3 = ON
    ENDWHILE
    unbrake = ON
    DELAY 0,1
    HOME M3 homeSpeed
    WAITPOS
    HOME M1 homeSpeed
    HOME M2 homeSpeed
    WAITPOS
RETURN

INT_IN6:
    isLost = ON
    STOP M1
    STOP M2
    STOP M3
    M1 = OFF
    M2 = OFF
    M3 = OFF
    unbrake = OFF
RETURN
