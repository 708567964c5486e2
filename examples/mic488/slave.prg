// Serves user registers to a master and moves nothing: inputs and positions are shown, outputs are set, a write is answered.
// $I100 command (1 count, 2 clear, 3 sum), $I101 answer, $D102 counter, $R104 and $R106 operands, $R108 result,
// $D110 inputs as bits, $I112 outputs to set, $R114 position of M1, $I120 seconds since the start.
// A master waits for 0 in $I100 before the next command; other writes may come at any time and clear none.

#count 1
#clear 2
#sum 3

SET counter = 0
TIMB1 = 0
CFGINT_MODBUS = INT_HIGH

MAIN:
$D110 = INPUTS
$R114 = PosM1
$I120 = TIMB1
DELAY 0,05
JUMP MAIN

INT_MODBUS:
OUTPUTS = $I112
IF $I100 > 0
    IF $I100 = count
        counter = counter + 1
    ENDIF
    IF $I100 = clear
        counter = 0
    ENDIF
    IF $I100 = sum
        $R108 = $R104 + $R106
    ENDIF
    $D102 = counter
    $I101 = $I100
    $I100 = 0
ENDIF
RETURN
