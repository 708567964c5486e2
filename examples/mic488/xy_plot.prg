// Plotter: M1 is X, M2 is Y, OUT1 lowers the pen. Draws a frame with lines, a circle in it and a rounded corner, then steps
// through a grid of crosses with relative lines whose end is calculated.

#pen OUT1
#start IN3
#homeSpeed -30
#penTime 0,1
#columns 4
#pitch 15

M1 = ON
M2 = ON
pen = OFF
AccM1 = 400
AccM2 = 400
DecM1 = 400
DecM2 = 400
HOME M1 homeSpeed
HOME M2 homeSpeed
WAITPOS

MAIN:
WAIT start = ON

// Frame
MOVELIN @corner1
WAITPOS
JUMP PEN_DOWN
MOVELIN @corner2
WAITPOS
MOVELIN @corner3
WAITPOS
MOVELIN @corner4
WAITPOS
MOVELIN @corner1
WAITPOS
JUMP PEN_UP

// Circle in the middle, clockwise, and an arc at the corner
MOVETOCIRC @circle
WAITPOS
JUMP PEN_DOWN
DOCIRC @circle
WAITPOS
JUMP PEN_UP
MOVELIN @arcStart
WAITPOS
JUMP PEN_DOWN
DOARC @arcEnd
WAITPOS
JUMP PEN_UP

// Crosses: row 0 of the table holds the line that is calculated
MOVELIN @cross
WAITPOS
SET n = 0
WHILE n < columns
    JUMP CROSS
    LinX = pitch
    LinY = 0
    LinVel = 60
    MOVELIN_REL @scratch
    WAITPOS
    n = n + 1
ENDWHILE
MOVELIN @corner1
WAITPOS
WAIT start = OFF
JUMP MAIN

CROSS:
JUMP PEN_DOWN
LinX = 4
LinY = 4
LinVel = 30
MOVELIN_REL @scratch
WAITPOS
JUMP PEN_UP
LinX = 0
LinY = -4
MOVELIN_REL @scratch
WAITPOS
JUMP PEN_DOWN
LinX = -4
LinY = 4
MOVELIN_REL @scratch
WAITPOS
JUMP PEN_UP
LinX = 0
LinY = -4
MOVELIN_REL @scratch
WAITPOS
RETURN

PEN_DOWN:
pen = ON
DELAY penTime
RETURN

PEN_UP:
pen = OFF
DELAY penTime
RETURN
