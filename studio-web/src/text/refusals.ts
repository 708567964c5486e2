/**
 * Polish for what the service refuses, and why. `{name}` stands for any text, `{#name}` for a number. A test compares them with the messages in the
 * sources (tests/studio/test_texts.py).
 */
export const REFUSALS: Readonly<Record<string, string>> = {
  " (did you mean {name}?)": " (czy miało być {name}?)",
  "internal error, please report it: {what}": "błąd wewnętrzny, prosimy go zgłosić: {what}",
  // Of the page itself.
  "the studio is not connected": "studio nie jest połączone",
  "{name}: no answer within {#seconds} s": "{name}: brak odpowiedzi przez {#seconds} s",
  "the connection was lost before the answer came; whether it was done is not known":
    "połączenie zerwało się przed odpowiedzią; nie wiadomo, czy to wykonano",
  // Requests and their fields.
  "breakpoint: give one of line, label and value; given are {names}":
    "punkt przerwania: podaj jedno z line, label i value; podano {names}",
  "a text": "tekst",
  "true or false": "true lub false",
  "a number from {#low} to {#high}": "liczby od {#low} do {#high}",
  "a whole number from {#low} to {#high}": "liczby całkowitej od {#low} do {#high}",
  "a number from {#low} to {#high}, or 'max'": "liczby od {#low} do {#high} albo 'max'",
  "a list of texts": "listy tekstów",
  "bytes as hexadecimal digits": "bajtów jako cyfr szesnastkowych",
  "characters, one byte each": "znaków jednobajtowych",
  "{kind} has no shape in JSON": "{kind} nie ma postaci w JSON",
  'a request is a line of JSON: {"do": NAME, "id": ANY, FIELD: VALUE, ...}':
    'żądanie to linia JSON: {"do": NAME, "id": ANY, FIELD: VALUE, ...}',
  // Machines, axes, motions.
  "no machine is called {name}{hint}; {known}": "żadna maszyna nie nazywa się {name}{hint}; {known}",
  "no device is called {name}{hint}; {known}": "żadne urządzenie nie nazywa się {name}{hint}; {known}",
  "{name} is not enabled: switch its drive on first": "{name} nie jest załączony: najpierw załącz napęd",
  "{what}: a whole number is needed": "{what}: potrzebna liczba całkowita",
  "the chip {what}": "układ {what}",
  // Registers and variables.
  "{text} is not a name of a value: {form}": "{text} nie jest nazwą wartości: {form}",
  "{text}: choose one of {name}[0] to {name2}[{#last}]": "{text}: wybierz {name}[0] do {name2}[{#last}]",
  "user register {#number} as {name} is outside 0 to {#last}":
    "rejestr użytkownika {#number} jako {name} jest poza 0 do {#last}",
  "user register {#number} as {name}: {name2}s begin at even registers":
    "rejestr użytkownika {#number} jako {name}: {name2} zaczyna się od parzystego rejestru",
  "{name} can only be read": "{name} jest tylko do odczytu",
  "{text}: {name} is one value of type {type}; name it without [ ] and :":
    "{text}: {name} to jedna wartość typu {type}; podaj nazwę bez [ ] i :",
  "{text}: permitted behind : are word, int, dint and real": "{text}: po : może być word, int, dint i real",
  "{text} is not a number, or {names}": "{text} nie jest liczbą ani {names}",
  "{text} is not a number{others}": "{text} nie jest liczbą{others}",
  "{name} = {#value}: permitted are 0 (OFF) and 1 (ON)": "{name} = {#value}: dozwolone 0 (OFF) i 1 (ON)",
  "{name}: permitted {range}": "{name}: dozwolone {range}",
  "the program has no variable {name}: there are {names}": "program nie ma zmiennej {name}: są {names}",
  "{name} = {value}: a digital input is 0 or 1": "{name} = {value}: wejście cyfrowe ma 0 lub 1",
  "{name} = {#value} V: an analog input takes 0 to 10 V": "{name} = {#value} V: wejście analogowe ma 0 do 10 V",
  "no input pin {name}: inputs are IN1 to IN{#inputs} and AIN1 to AIN{#analog}":
    "nie ma wejścia {name}: wejścia to IN1 do IN{#inputs} i AIN1 do AIN{#analog}",
  "no axis M{#axis}: axes are M1 to M{#most}": "nie ma osi M{#axis}: osie to M1 do M{#most}",
  "M{#axis}: {#counts} encoder counts at once: permitted {range}":
    "M{#axis}: {#counts} zliczeń enkodera naraz: dozwolone {range}",
  "M{#axis}: {#counts} encoder counts per {#pulses} pulses: counts must not be 0, pulses 1 or more":
    "M{#axis}: {#counts} zliczeń enkodera na {#pulses} impulsów: zliczeń nie może być 0, impulsów 1 lub więcej",
  "more than {#most} events of one MIC488 at {#at} ns": "więcej niż {#most} zdarzeń jednego MIC488 w {#at} ns",
  "the stored user registers of firmware {name} take {#size} bytes, not {#found}":
    "zapisane rejestry użytkownika firmware {name} zajmują {#size} bajtów, nie {#found}",
  "{#value} does not fit a DINT: permitted {range}": "{#value} nie mieści się w DINT: dozwolone {range}",
  "NaN is no DINT": "NaN to nie DINT",
  "NaN is no REAL of this device": "NaN to nie REAL tego urządzenia",
  "{#value} does not fit a REAL: permitted {range}": "{#value} nie mieści się w REAL: dozwolone {range}",
  // Programs of the controllers.
  "program bank {#bank} is in use: stop the program first":
    "bank programu {#bank} jest w użyciu: najpierw zatrzymaj program",
  "position bank {#bank} is in use: stop the program first":
    "bank pozycji {#bank} jest w użyciu: najpierw zatrzymaj program",
  "{keyword} {text}: the position table has rows 0…{#last}": "{keyword} {text}: tabela pozycji ma wiersze 0…{#last}",
  "PULSE(OUT{#output}, …): permitted are 0.001 s and more": "PULSE(OUT{#output}, …): dozwolone 0.001 s i więcej",
  "{name} cannot run: {why}": "{name} nie może działać: {why}",
  "{name}: {lines}, firmware {firmware} holds {#most}": "{name}: {lines}, firmware {firmware} mieści {#most}",
  "{#count} positions: a bank holds {#most}": "pozycji {#count}: bank mieści {#most}",
  "program bank {#bank}: permitted are {range}": "bank programu {#bank}: dozwolone {range}",
  "position bank {#bank}: permitted are {range}": "bank pozycji {#bank}: dozwolone {range}",
  "{kind} bank {#bank}: permitted are {range}": "bank {kind} {#bank}: dozwolone {range}",
  // Chips.
  "more than {#levels} loops inside one another": "więcej niż {#levels} pętle jedna w drugiej",
  "E outside a loop": "E poza pętlą",
  "the beginning of the loop has been overwritten": "początek pętli został nadpisany",
  "a subroutine inside a subroutine": "podprogram w podprogramie",
  "a dot outside a subroutine": "kropka poza podprogramem",
  "the command after the call has been overwritten": "polecenie po wywołaniu zostało nadpisane",
  "{#number} is not an operand register, and function 58 is ON: permitted are 1 to 8":
    "{#number} nie jest rejestrem argumentu, a funkcja 58 jest włączona: dozwolone 1 do 8",
  "{#number} names no lines, and function 46 is ON: first line and count, such as 14, up to line 21":
    "{#number} nie oznacza linii, a funkcja 46 jest włączona: pierwsza linia i liczba linii, np. 14, do linii 21",
  "division by 0": "dzielenie przez 0",
  "{#variable} / {#operand}: at most {#most} can be divided, except by 2, 4, 8, 16, 32, 64":
    "{#variable} / {#operand}: dzielić można najwyżej {#most}, chyba że przez 2, 4, 8, 16, 32, 64",
  "{#number} is not a multiple of {#grid} minimum microsteps (M{#microstep})":
    "{#number} nie jest wielokrotnością {#grid} min. mikrokroków (M{#microstep})",
  "X{#argument} names no chip: permitted are {permitted}, or G for all":
    "X{#argument} nie oznacza układu: dozwolone {permitted} lub G dla wszystkich",
  "{text} is not a command": "{text} nie jest poleceniem",
  "the distance {#distance} is not a multiple of {#grid} (M{#microstep})":
    "odcinek {#distance} nie jest wielokrotnością {#grid} (M{#microstep})",
  "no {what} is called {name}{hint}; there are {names}": "nic ({what}) nie nazywa się {name}{hint}; są {names}",
  "{name} = {#value}: permitted are {range}": "{name} = {#value}: dozwolone {range}",
  // Modbus.
  "function {function} refused with exception {code} ({name}): {detail}":
    "funkcja {function} odrzucona z wyjątkiem {code} ({name}): {detail}",
  "function {function} refused with exception {code} ({name})":
    "funkcja {function} odrzucona z wyjątkiem {code} ({name})",
  "illegal function": "niedozwolona funkcja",
  "illegal data address": "niedozwolony adres",
  "illegal data value": "niedozwolona wartość",
  "device failure": "awaria urządzenia",
  acknowledge: "potwierdzenie",
  "device busy": "urządzenie zajęte",
  "memory parity error": "błąd parzystości pamięci",
  "gateway path unavailable": "bramka bez drogi",
  "gateway target failed to respond": "cel bramki nie odpowiada",
  "quantity {#count} is outside 1 to {#most}": "liczba {#count} jest poza 1 do {#most}",
  "coil value {value} is neither FF00 nor 0000": "wartość cewki {value} to ani FF00, ani 0000",
  "byte count {#bytes} does not match {#count} registers":
    "liczba bajtów {#bytes} nie zgadza się z {#count} rejestrami",
  "the PDU has {#length} bytes instead of {wanted}": "PDU ma {#length} bajtów zamiast {wanted}",
  // Others.
  "{name} has no program: {who} has one": "{name} nie ma programu: ma go {who}",
  "{name} can only be written": "{name} jest tylko do zapisu",
};
