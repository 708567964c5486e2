// Pick and place: M1 moves the arm, M2 the gripper up and down.
// A feeder offers a part (IN5), the machine takes it, asks the next station for room (OUT3, answer on IN6)
// and lays the part down. Good parts are counted in $I10, a master sets the target count in $I0 (0: without end).

#partReady IN5
#roomFree IN6
#gripped IN7
#gripper OUT1
#busy OUT2
#askRoom OUT3
#lamp OUT8
#homeSpeed -40
#gripTime 0,2

M1 = ON
M2 = ON
OUTPUTS = 0
SET done = 0
$I10 = 0
JUMP HOMING

MAIN:
lamp = OFF
WAIT partReady = ON
busy = ON
JUMP PICK
IF gripped = OFF
    JUMP MISSED
    JUMP MAIN
ENDIF
JUMP PLACE
done = done + 1
$I10 = done
busy = OFF
IF $I0 > 0
    IF done >= $I0
        MOVEPTP @park
        WAITPOS
        END
    ENDIF
ENDIF
JUMP MAIN

// First the gripper, so that nothing is torn off on the way.
HOMING:
HOME M2 homeSpeed
WAITPOS
HOME M1 homeSpeed
WAITPOS
MOVEPTP @wait
WAITPOS
RETURN

PICK:
MOVEPTP @abovePart
WAITPOS
PABS M2 85,5
WAITPOS
gripper = ON
DELAY gripTime
MOVEPTP @lift
WAITPOS
RETURN

PLACE:
askRoom = ON
MOVEPTP @aboveStation
WAITPOS
WAIT roomFree = ON
MOVEPTP @station
WAITPOS
gripper = OFF
DELAY gripTime
askRoom = OFF
MOVEPTP @lift
WAITPOS
RETURN

// The gripper closed on nothing: show it and go back to the waiting place.
MISSED:
lamp = ON
gripper = OFF
MOVEPTP @wait
WAITPOS
DELAY 1
RETURN
