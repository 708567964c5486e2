#stamp OUT1

M1 = ON
PABS M1 100
WAITPOS
stamp = ON
DELAY 0.5
stamp = OFF
