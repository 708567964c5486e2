// Gate: M1 opens it when somebody is at IN5 and shuts it five seconds after the way is free (IN6). OUT1 is the warning lamp.
// Uses only what is known of the compiled image, so it can be built for the vendor's tool.

#call IN5
#free IN6
#lamp OUT1

M1 = ON
HOME M1 -20
WAITPOS

MAIN:
WAIT call = ON
lamp = ON
MOVEPTP @open
WAITPOS
lamp = OFF
WAIT free = ON
DELAY 5
lamp = ON
MOVEPTP @shut
WAITPOS
lamp = OFF
JUMP MAIN
