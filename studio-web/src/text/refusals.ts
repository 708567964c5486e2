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
  // Who may do what.
  "{name} needs the token of this studio, which is in its file of tokens":
    "{name} wymaga tokenu tego studia, który jest w jego pliku tokenów",
  "too many requests: permitted are {#rate} a second": "za dużo żądań: dozwolone {#rate} na sekundę",
  "too many messages: permitted are {#rate} a second": "za dużo wiadomości: dozwolone {#rate} na sekundę",
  "too many texts: permitted are {#most}": "za dużo tekstów: dozwolone {#most}",
  "there are {#most} viewers already, the most possible": "jest już {#most} oglądających, więcej nie można",
  "there are {#most} editors already, the most possible": "jest już {#most} edytorów, więcej nie można",
  "the viewer has gone": "oglądający odszedł",
  // Requests and their fields.
  "no command {name}{hint}; commands are {names}": "nie ma polecenia {name}{hint}; polecenia to {names}",
  "no request {name}{hint}; requests are {names}": "nie ma żądania {name}{hint}; żądania to {names}",
  "{name} is not supported here; supported are {names}": "{name} nie jest tu możliwe; możliwe są {names}",
  "step: for_ns and to_ns exclude each other": "step: for_ns i to_ns wykluczają się",
  "breakpoint: give one of line, label and value; given are {names}":
    "punkt przerwania: podaj jedno z line, label i value; podano {names}",
  "breakpoint: {one} needs {other}": "punkt przerwania: {one} wymaga {other}",
  "breakpoint: {one} takes no {other}": "punkt przerwania: {one} nie ma {other}",
  "breakpoint: {problem}": "punkt przerwania: {problem}",
  "version = {version}: this subject has version {other}": "version = {version}: tu jest wersja {other}",
  "a text of {#count} characters: permitted are at most {#most}":
    "tekst o {#count} znakach: dozwolone najwyżej {#most}",
  "{text}: a text takes neither NUL nor surrogates": "{text}: tekst nie może mieć NUL ani surogatów",
  "a text takes no surrogates": "tekst nie może mieć surogatów",
  "{place}: no field {name}{hint}; fields are {names}": "{place}: nie ma pola {name}{hint}; pola to {names}",
  "{place}: {name} is missing, expected {what}: {meaning}": "{place}: brakuje {name}, oczekiwano {what}: {meaning}",
  "{value}: expected {what}": "{value}: oczekiwano {what}",
  "a text": "tekst",
  "true or false": "true lub false",
  "a number from {#low} to {#high}": "liczby od {#low} do {#high}",
  "a whole number from {#low} to {#high}": "liczby całkowitej od {#low} do {#high}",
  "a number from {#low} to {#high}, or 'max'": "liczby od {#low} do {#high} albo 'max'",
  "a list of texts": "listy tekstów",
  "bytes as hexadecimal digits": "bajtów jako cyfr szesnastkowych",
  "characters, one byte each": "znaków jednobajtowych",
  "{text} is not an 8-bit character": "{text} nie jest znakiem 8-bitowym",
  "no {what} {name}{hint}; there are {names}": "nie ma {what} {name}{hint}; są {names}",
  "{kind} has no shape in JSON": "{kind} nie ma postaci w JSON",
  "{name}: {value}: expected a text": "{name}: {value}: oczekiwano tekstu",
  'a request is a line of JSON: {"do": NAME, "id": ANY, FIELD: VALUE, ...}':
    'żądanie to linia JSON: {"do": NAME, "id": ANY, FIELD: VALUE, ...}',
  "a request has at most {#bytes} bytes": "żądanie ma najwyżej {#bytes} bajtów",
  "the first message is hello": "pierwszą wiadomością jest hello",
  "{name}: the first request is hello": "{name}: pierwszym żądaniem jest hello",
  "a message is a text of JSON; this one is binary": "wiadomość to tekst JSON; ta jest binarna",
  "{name} is about a connection: ask it over the WebSocket": "{name} dotyczy połączenia: pytaj przez WebSocket",
  "hello: this connection has said hello already; resync asks for the state again":
    "hello: to połączenie już się przywitało; o stan pyta resync",
  'a body is an object of JSON with the fields: {"machine": "table", "axis": 1, ...}':
    'treść to obiekt JSON z polami: {"machine": "table", "axis": 1, ...}',
  "no field {name}: the address says which request it is": "nie ma pola {name}: o żądaniu mówi adres",
  "watch: there are {#most} already, which is the most": "watch: jest ich już {#most}, więcej nie można",
  "watch: more than {#most} points in all": "watch: w sumie więcej niż {#most} punktów",
  "unwatch: no watch {name}; there are {names}": "unwatch: nie ma {name}; są {names}",
  "follow: give an id, by which it is ended": "follow: podaj id, którym się je kończy",
  "follow: the id {name} is in use": "follow: id {name} jest zajęte",
  "follow: there are {#most} already, which is the most": "follow: jest ich już {#most}, więcej nie można",
  "no subscription has the id {name}": "żadna subskrypcja nie ma id {name}",
  "points: at least one is needed": "points: potrzebny jest przynajmniej jeden",
  // Machines, axes, motions.
  "there is no controller {name}{hint}: there are {names}": "nie ma sterownika {name}{hint}: są {names}",
  "no machine is called {name}{hint}; {known}": "żadna maszyna nie nazywa się {name}{hint}; {known}",
  "no device is called {name}{hint}; {known}": "żadne urządzenie nie nazywa się {name}{hint}; {known}",
  "nothing is called {name}{hint}; there are {names}, time": "nic nie nazywa się {name}{hint}; są {names}, time",
  "{name} is {title}, which cannot do {what}; it can do {known}":
    "{name} to {title}, który nie wykona {what}; wykona {known}",
  "{name} is {title}, which cannot be jogged": "{name} to {title}, nie można nim jechać ręcznie",
  "{name}: no axis {axis}: an M1486 has one, 1": "{name}: nie ma osi {axis}: M1486 ma jedną, 1",
  "{name}: no axis {axis}: a MIC488 has 1 to {#most}": "{name}: nie ma osi {axis}: MIC488 ma 1 do {#most}",
  "axis {axis}: a MIC488 has {#low} to {#high}": "oś {axis}: MIC488 ma {#low} do {#high}",
  "axis = {axis}: an M1486 has axis {#one} only": "axis = {axis}: M1486 ma tylko oś {#one}",
  "the jog has ended: {why}": "jazda ręczna skończyła się: {why}",
  "time goes too fast for a jog ({#speed} times): it is possible up to {#most} times":
    "czas biegnie za szybko na jazdę ręczną ({#speed} razy): jest możliwa do {#most} razy",
  "{#most} axes are jogged already, which is the most": "ręcznie jedzie już {#most} osi, więcej nie można",
  "lease {#number} has ended, or is another viewer's": "dzierżawa {#number} wygasła albo należy do kogoś innego",
  "{name} is not enabled: switch its drive on first": "{name} nie jest załączony: najpierw załącz napęd",
  "{name} has a position error: stop it first": "{name} ma błąd pozycji: najpierw go zatrzymaj",
  "{name} runs its program: pause or stop it before an axis is jogged":
    "{name} wykonuje program: przed jazdą ręczną wstrzymaj go albo zatrzymaj",
  "{name} waits for triggers (AXIS_CTR_MODE), so an axis cannot be jogged":
    "{name} czeka na wyzwolenie (AXIS_CTR_MODE), więc jazda ręczna nie jest możliwa",
  "velocity = {#value} {unit}/s: permitted are {#least} to {#most} {unit2}/s (VMAX), but not 0":
    "prędkość {#value} {unit}/s: dozwolone od {#least} do {#most} {unit2}/s (VMAX), oprócz 0",
  "velocity = {#value} {unit}/s: {permitted}": "prędkość {#value} {unit}/s: {permitted}",
  "velocity {#value} {unit}/s, V{#number}: {why}": "prędkość {#value} {unit}/s, V{#number}: {why}",
  "velocity = 0: the sign of the velocity is the direction; stop ends the motion":
    "velocity = 0: kierunek to znak prędkości; ruch kończy stop",
  "velocity = 0: the sign of the velocity is the direction": "velocity = 0: kierunek to znak prędkości",
  "{name}: {title} writes every command into its EEPROM, so it is not jogged":
    "{name}: {title} zapisuje każde polecenie w EEPROM, więc nie ma jazdy ręcznej",
  "the chip {what}": "układ {what}",
  "move: {#value} {unit}: permitted are {limits}": "ruch: {#value} {unit}: dozwolone {limits}",
  "{name} is on no line, so no commands can be sent to it":
    "{name} nie jest na żadnej linii, więc nie da się mu nic wysłać",
  "{name} is on no line, so nothing can be typed to it":
    "{name} nie jest na żadnej linii, więc nie da się do niego pisać",
  "{name} is not at rest ({what}): wait, or stop it": "{name} nie stoi ({what}): poczekaj albo go zatrzymaj",
  "{name} is {what}, so it receives nothing": "{name}: {what}, więc nic nie odbiera",
  "{name} has no commands": "{name} nie ma poleceń",
  "{what}: a whole number is needed": "{what}: potrzebna liczba całkowita",
  "{what}: no multiple of {#grid}, the microstep of M{#microstep}":
    "{what}: to nie wielokrotność {#grid}, mikrokroku przy M{#microstep}",
  "position {#value} {unit}: no multiple of {#grid}, the microstep of M{#microstep}":
    "pozycja {#value} {unit}: to nie wielokrotność {#grid}, mikrokroku przy M{#microstep}",
  "distance {#value} {unit}: no multiple of {#grid}, the microstep of M{#microstep}":
    "odcinek {#value} {unit}: to nie wielokrotność {#grid}, mikrokroku przy M{#microstep}",
  "{name} was stopped in a move: its counter does not show where it is (M-16)":
    "{name} zatrzymano w ruchu: licznik nie pokazuje, gdzie jest (M-16)",
  "seek {pin}: permitted are B{#low} to B{#high}, such as '-B8'":
    "szukanie {pin}: dozwolone B{#low} do B{#high}, np. '-B8'",
  // Registers and variables.
  "{text} is not a name of a value: {form}": "{text} nie jest nazwą wartości: {form}",
  "{text}: choose one of {name}[0] to {name2}[{#last}]": "{text}: wybierz {name}[0] do {name2}[{#last}]",
  "user register {#number} as {name} is outside 0 to {#last}":
    "rejestr użytkownika {#number} jako {name} jest poza 0 do {#last}",
  "user register {#number} as {name}: {name2}s begin at even registers":
    "rejestr użytkownika {#number} jako {name}: {name2} zaczyna się od parzystego rejestru",
  "{name} can only be read": "{name} jest tylko do odczytu",
  "{name} can only be written": "{name} jest tylko do zapisu",
  "{text}: {name} is one value of type {type}; name it without [ ] and :":
    "{text}: {name} to jedna wartość typu {type}; podaj nazwę bez [ ] i :",
  "{text}: permitted behind : are word, int, dint and real": "{text}: po : może być word, int, dint i real",
  "{text} is not a number, or {names}": "{text} nie jest liczbą ani {names}",
  "{text} is not a number{others}": "{text} nie jest liczbą{others}",
  "{name} = {#value}: permitted are 0 (OFF) and 1 (ON)": "{name} = {#value}: dozwolone 0 (OFF) i 1 (ON)",
  "{name}: permitted {range}": "{name}: dozwolone {range}",
  "the program has no variable {name}: there are {names}": "program nie ma zmiennej {name}: są {names}",
  "the chip has no variable {name}: there are {names}": "układ nie ma zmiennej {name}: są {names}",
  "{name} = {#value}: permitted are whole numbers from 0 to {#high}":
    "{name} = {#value}: dozwolone liczby całkowite od 0 do {#high}",
  "{name} = {#value}: permitted are {range}": "{name} = {#value}: dozwolone {range}",
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
  "{place} is in use by the program that runs or is paused: stop it first":
    "{place} jest w użyciu przez program, który działa lub jest wstrzymany: najpierw go zatrzymaj",
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
  // Time, the past, branches.
  "to_ns = {#end}: this world is at {#now} ns already": "to_ns = {#end}: ten świat jest już w {#now} ns",
  "{#most} snapshots are kept, as many as may be: drop one: {names}":
    "zachowanych jest {#most} stanów, więcej nie można: usuń jeden: {names}",
  "no snapshot is called {name}{hint}; there are {names}": "żaden stan nie nazywa się {name}{hint}; są {names}",
  "look: no past is kept here": "nie ma tu przeszłości",
  "past_events: no past is kept here": "nie ma tu przeszłości",
  "this viewer looks at the present": "ten oglądający patrzy na teraźniejszość",
  "past_events from {#begin} s to {#end} s: {span}": "zdarzenia od {#begin} s do {#end} s: {span}",
  "{name}: the past is looked at, which cannot be changed: look at the present first":
    "{name}: oglądana jest przeszłość, której nie można zmieniać: najpierw wróć do teraźniejszości",
  "{#most} viewers look back already, which is the most": "przeszłość ogląda już {#most}, więcej nie można",
  "this world keeps its memory in {place}, which cannot go back: start it without a state directory":
    "ten świat trzyma pamięć w {place}, której nie da się cofnąć: uruchom go bez katalogu stanu",
  "the trace of this world is written to a file, which cannot go back: start it without that, or with a ring":
    "ślad tego świata idzie do pliku, którego nie da się cofnąć: uruchom go bez tego albo z pierścieniem",
  "an axis is being jogged: end the jog first": "trwa jazda ręczna: najpierw ją zakończ",
  "this world does not record a session: start it with --session FILE":
    "ten świat nie nagrywa sesji: uruchom go z --session PLIK",
  // What there is beside a world.
  "nothing is recorded here: there is no world": "nic się tu nie nagrywa: nie ma świata",
  "branches are worlds: there is none here": "gałęzie to światy: tu go nie ma",
  "what is drawn is a world: there is none here": "rysuje się świat: tu go nie ma",
  "gateways and a history are beside a world: there is none here": "bramki i historia są obok świata: tu go nie ma",
  "campaigns are beside the file of a world: there is none here": "kampanie są obok pliku świata: tu go nie ma",
  "traffic is counted on lines of a world: there is no world": "ruch liczy się na liniach świata: tu go nie ma",
  "there is no motion calculator for axis {axis} of {machine}: {why}":
    "nie ma kalkulatora ruchu dla osi {axis} {machine}: {why}",
  "{name} is of the kind {kind}, which has no configuration file: it is set up by commands":
    "{name} jest rodzaju {kind}, który nie ma pliku konfiguracji: ustawia się go poleceniami",
  "{kind} is running: wait, or cancel it": "trwa {kind}: poczekaj albo to przerwij",
  "the page of the studio has not been built: 'make page' in the clone builds it; a wheel contains it":
    "strona studia nie jest zbudowana: buduje ją 'make page' w klonie; wheel ją zawiera",
  // Devices.
  "{name}: one controller at a time where there are devices": "{name}: przy urządzeniach jeden sterownik naraz",
  "{name}: no device is connected": "{name}: żadne urządzenie nie jest podłączone",
  "{title} cannot be connected: its driver is for commands only":
    "{title} nie da się podłączyć: jego sterownik programowy służy tylko poleceniom",
  "{#most} devices are connected already, which is the most":
    "podłączonych jest już {#most} urządzeń, więcej nie można",
  "name = {name}: permitted are {form}": "name = {name}: dozwolone {form}",
  "name = {name}: a machine is called that already": "name = {name}: tak nazywa się już inna maszyna",
  "{name} was not sent: {#most} commands wait already": "{name} nie wysłano: czeka już {#most} poleceń",
  "{name} was not sent: a stop was requested meanwhile": "{name} nie wysłano: w tym czasie zażądano stopu",
  "{name} was not sent: a stop is being executed; repeat it after that":
    "{name} nie wysłano: właśnie wykonywany jest stop; proszę powtórzyć po nim",
  "{name} was not sent: it has waited more than {#limit} s; repeat it":
    "{name} nie wysłano: czekało dłużej niż {#limit} s; powtórz",
  "{name} was not sent: the connection is lost ({why})": "{name} nie wysłano: połączenie jest utracone ({why})",
  "{name}: a twin can be made at rest: an axis is jogged": "{name}: bliźniaka robi się w spoczynku: trwa jazda ręczna",
  "{name}: a twin can be made at rest: {what} runs": "{name}: bliźniaka robi się w spoczynku: działa {what}",
  "{name}: a twin needs the configuration of the controller: connect it with config=FILE":
    "{name}: bliźniak wymaga konfiguracji sterownika: podłącz go z config=PLIK",
  "{name}: no twin beside an M1486, whose position is unknown while it moves (M-28)":
    "{name}: obok M1486 nie ma bliźniaka, bo w ruchu jego pozycja jest nieznana (M-28)",
  "{name} axis {axis} is jogged already": "{name}: oś {axis} już jedzie ręcznie",
  "the jog was not begun: {why}": "jazdy ręcznej nie rozpoczęto: {why}",
  "jog was not begun: a stop was requested meanwhile": "jazdy ręcznej nie rozpoczęto: w tym czasie zażądano stopu",
  "period_s = {#value}: permitted are {#low} to {#high} s": "period_s = {#value}: dozwolone {#low} do {#high} s",
  "{name} is not possible for this device ({place}); possible are {names}":
    "{name} nie jest możliwe dla tego urządzenia ({place}); możliwe są {names}",
  "no {what} is called {name}{hint}; there are {names}": "nic ({what}) nie nazywa się {name}{hint}; są {names}",
  "no point {name}{hint}; there are {names}": "nie ma punktu {name}{hint}; są {names}",
  "{name} is not a point of an M1486: there are {names}": "{name} nie jest punktem M1486: są {names}",
  "unit = {unit}: this subject is the device with address {address}":
    "unit = {unit}: to urządzenie o adresie {address}",
  "an M1486 has no command to {action} its program: only stop can be done":
    "M1486 nie ma polecenia {action} dla programu: możliwy jest tylko stop",
  "text: several devices are on {line}: it begins with the address of one of them, {addresses}, and CR":
    "tekst: na {line} jest kilka urządzeń: zaczyna się adresem jednego z nich, {addresses}, i CR",
  "text: X{selected} selects another chip: this device is {own}":
    "tekst: X{selected} wybiera inny układ: to urządzenie to {own}",
  "text: whole commands are sent to a device, each with CR behind it":
    "text: do urządzenia wysyła się całe polecenia, każde z CR na końcu",
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
  // Faults.
  "there is a fault {name} already": "usterka {name} już jest",
  "no fault {name}: set are {names}": "nie ma usterki {name}: ustawione są {names}",
  "fault {name}: choose a machine: there are {names}": "usterka {name}: wybierz maszynę: są {names}",
  "fault {name}: machine = {value}: there are {names}": "usterka {name}: machine = {value}: są {names}",
  "fault {name}: element = {value}: those that can fail are {names}":
    "usterka {name}: element = {value}: zawieść mogą {names}",
  "fault {name}: element = {value}, whose faults are {names}":
    "usterka {name}: element = {value}, jego usterki to {names}",
  "fault {name}: {key} = {value} is not a number": "usterka {name}: {key} = {value} nie jest liczbą",
  "{place}: kind = {value}: permitted are {names}": "{place}: kind = {value}: dozwolone {names}",
  "{place}: name = {value}: permitted is text that can be printed, without blanks":
    "{place}: name = {value}: dozwolony jest tekst drukowalny, bez spacji",
  "{place}: nth and every exclude each other": "{place}: nth i every wykluczają się",
  "{place}: until_s = {#end} is before the fault begins at {#begin} s":
    "{place}: until_s = {#end} to przed początkiem usterki w {#begin} s",
  "a fault is {form}, such as {example}; kinds are {names}": "usterka to {form}, np. {example}; rodzaje to {names}",
  "{place}: {name} is missing: {what}": "{place}: brakuje {name}: {what}",
  "fault {name}: {word} is not NAME=VALUE": "usterka {name}: {word} to nie NAZWA=WARTOŚĆ",
  "fault {name}: {key} is given twice": "usterka {name}: {key} podano dwa razy",
  "{place}: there is no {key}: parameters are {names}": "{place}: nie ma {key}: parametry to {names}",
  "fault bounce: pin = {pin} is an analog input, which has no switch":
    "usterka bounce: pin = {pin} to wejście analogowe, które nie ma łącznika",
  "fault {name}: axis = {axis}: permitted are 1 to {#most}": "usterka {name}: axis = {axis}: dozwolone 1 do {#most}",
  "fault {name}: pin = {pin}: name the machine as machine=NAME, and the pin alone":
    "usterka {name}: pin = {pin}: maszynę podaj jako machine=NAZWA, a pin osobno",
  "fault {name}: pin = {pin}: {machine} has {names}": "usterka {name}: pin = {pin}: {machine} ma {names}",
  "fault {name}: {machine} {problem}": "usterka {name}: {machine} {problem}",
  "fault {name}: link = {value}: there are {names}": "usterka {name}: link = {value}: są {names}",
  "fault {name} happens on {where}: {what}": "usterka {name} zdarza się na {where}: {what}",
  "fault {name}: unit = {value}: served are {names}": "usterka {name}: unit = {value}: obsługiwane są {names}",
  "fault {name}: line = {value}: there are {names}": "usterka {name}: line = {value}: są {names}",
  "{where} = {value}: permitted are {permitted}": "{where} = {value}: dozwolone {permitted}",
  "{where}: a number of more than 63 bits: permitted are {permitted}":
    "{where}: liczba o ponad 63 bitach: dozwolone {permitted}",
  // The debugger and Why?.
  "no statement is in line {line} of {name} or after it": "w linii {line} {name} ani za nią nie ma instrukcji",
  "{name} has no program: {who} has one": "{name} nie ma programu: ma go {who}",
  "{name} has no text {text}: texts are {names}": "{name} nie ma tekstu {text}: teksty to {names}",
  "no label is called {name}{hint}; there are {names}": "żadna etykieta nie nazywa się {name}{hint}; są {names}",
  "a division by zero, or a result that is too large: permitted are numbers up to {#most}":
    "dzielenie przez zero albo za duży wynik: dozwolone liczby do {#most}",
  "{name} means nothing to {machine}{hint}: its variables are {names}":
    "{name} nic nie znaczy dla {machine}{hint}: zmienne to {names}",
  "log {text}: only names of the program can be in it": "log {text}: mogą w nim być tylko nazwy z programu",
  "log {text}: a brace has no partner": "log {text}: klamra bez pary",
  "hit count {text}: expected a number from 1 on, after nothing, or one of = < <= > >= %":
    "licznik trafień {text}: oczekiwano liczby od 1, samej albo po jednym z = < <= > >= %",
  "{name}: no controller has a program whose text is known": "{name}: żaden sterownik nie ma programu o znanym tekście",
  "{name} cannot be set {#ago} s before the present: branch, so that what came later has not happened":
    "{name}: nie da się ustawić {#ago} s przed teraźniejszością: zrób gałąź, w której późniejszego jeszcze nie ma",
  "{name}: statement_time = 0: a debugger stops between statements: give them '1 us' at least":
    "{name}: statement_time = 0: debugger staje między instrukcjami: daj im przynajmniej '1 us'",
  "{name} cannot be set: what can be are variables ({names}), inputs and registers that can be written":
    "{name}: nie da się ustawić: można zmienne ({names}), wejścia i rejestry do zapisu",
  "no group of values is called {name}: there are {names}": "żadna grupa wartości nie nazywa się {name}: są {names}",
  "{name} cannot be set: it can only be read": "{name}: nie da się ustawić: jest tylko do odczytu",
  "{#most} breakpoints are set, as many as may be": "ustawionych jest {#most} punktów przerwania, więcej nie można",
  "there is no breakpoint {#number}; there are {names}": "nie ma punktu przerwania {#number}; są {names}",
  "{machine} has no program {name}; there are {names}": "{machine} nie ma programu {name}; są {names}",
  "the debugger stands at the present: there is nothing to go back to":
    "debugger stoi w teraźniejszości: nie ma do czego wracać",
  "the debugger is on its way through the past: pause it first":
    "debugger idzie przez przeszłość: najpierw go wstrzymaj",
  "the world is running: pause it first": "świat działa: najpierw go wstrzymaj",
  "without a follower a stop is not reported: follow events of kind {kind} first":
    "bez śledzenia nikt nie dowie się o zatrzymaniu: najpierw śledź zdarzenia {kind}",
  "{#most} questions wait for their answers, which is the most":
    "na odpowiedź czeka już {#most} pytań, więcej nie można",
  "{name}: nothing is known of it at {#at} s": "{name}: w {#at} s nic o tym nie wiadomo",
  "more than {#most} records and statements since {#begin} s: too many to look at":
    "od {#begin} s ponad {#most} zapisów i instrukcji: za dużo, by je przejrzeć",
  "a question is a signal, a condition, or a controller: table.OUT3, 'table.OUT3 == 0', table":
    "pytanie to sygnał, warunek albo sterownik: table.OUT3, 'table.OUT3 == 0', table",
  "{name} has executed no statement until {#at} s: ask about one of its signals":
    "{name} do {#at} s nie wykonał żadnej instrukcji: zapytaj o jeden z jego sygnałów",
  "{name} is of {names}: ask with the controller, such as {example}":
    "{name} mają {names}: zapytaj ze sterownikiem, np. {example}",
  "{name} is a variable of the program of {machine}: a question is about a signal or register":
    "{name} to zmienna programu sterownika {machine}: pytanie dotyczy sygnału albo rejestru",
  // The calculator.
  "all is given, and a time: name what is to be calculated instead, one of {names}":
    "podano wszystko i jeszcze czas: zamiast tego wskaż, co policzyć: jedno z {names}",
  "{names}: one time determines what is left out, two cannot both be wanted":
    "{names}: jeden czas wyznacza to, co pominięto, dwóch naraz żądać nie można",
  "to calculate {name} a time is needed: one of {names}": "żeby policzyć {name}, potrzebny jest czas: jeden z {names}",
  "{name} is given, so {find} follows: name what is to be calculated, or leave out the time":
    "podano {name}, więc {find} wynika: wskaż, co policzyć, albo pomiń czas",
  "{names}: a time determines one of them, give the others": "{names}: czas wyznacza jedno z nich, podaj pozostałe",
  "{names}: missing; give them, or leave one of them out and give a time ({times})":
    "{names}: brakuje; podaj je albo pomiń jedno i podaj czas ({times})",
  "{names}: missing to calculate {find}": "{names}: tego brakuje, żeby policzyć {find}",
  "{name} = {value} cannot be: with {unknown} {range} it is {possible}":
    "{name} = {value} nie jest możliwe: dla {unknown} {range} wynosi {possible}",
  "{name} = {value} cannot be: it is {other}, whatever {unknown} is":
    "{name} = {value} nie jest możliwe: wynosi {other}, jakiekolwiek byłoby {unknown}",
  "distance = {#value} {unit}: is less than the controller's step":
    "distance = {#value} {unit}: mniej niż krok sterownika",
  "no quantity {name}{hint}: quantities are {names}": "nie ma wielkości {name}{hint}: wielkości to {names}",
  "{name} cannot be calculated, it is a choice: calculated are {names}":
    "{name} nie da się policzyć, to się wybiera: liczy się {names}",
  "M{#microstep} and Q{#qualification} do not go together: with M{#m} permitted is {names}":
    "M{#microstep} i Q{#qualification} nie pasują do siebie: przy M{#m} dozwolone jest {names}",
};
