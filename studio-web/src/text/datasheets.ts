/**
 * Polish for the meanings of registers, settings, commands and parameters of faults. `{n}` is the number of an axis or pin, `{text}` another
 * sentence. A test compares them with the service (tests/studio/test_texts.py).
 */
export const DATASHEETS: Readonly<Record<string, string>> = {
  // Registers of a MIC488.
  "Enable output of axis M{n}: ON switches the drive on, OFF switches it off.":
    "Wyjście zezwolenia osi M{n}: ON załącza napęd, OFF go wyłącza.",
  "Writing ON stops axis M{n} at once, without ramp.": "Zapis ON zatrzymuje oś M{n} natychmiast, bez rampy.",
  "While ON, axis M{n} moves in the positive direction at JOG_SPEED.":
    "Dopóki ON, oś M{n} jedzie w kierunku dodatnim z JOG_SPEED.",
  "While ON, axis M{n} moves in the negative direction at JOG_SPEED.":
    "Dopóki ON, oś M{n} jedzie w kierunku ujemnym z JOG_SPEED.",
  "Writing ON reads user registers 1000–1999 from non-volatile memory.":
    "Zapis ON odczytuje rejestry użytkownika 1000–1999 z pamięci nieulotnej.",
  "Writing ON saves user registers 1000–1999 to non-volatile memory.":
    "Zapis ON zapisuje rejestry użytkownika 1000–1999 w pamięci nieulotnej.",
  "Writing ON sets user registers 1000–1999 to 0.": "Zapis ON zeruje rejestry użytkownika 1000–1999.",
  "Output OUT{n}.": "Wyjście OUT{n}.",
  "Input IN{n}.": "Wejście IN{n}.",
  "Memory for the master and the program; DINT and REAL take two registers from an even address.":
    "Pamięć dla mastera i programu; DINT i REAL zajmują dwa rejestry od adresu parzystego.",
  "How REAL/DINT registers travel, as REAL in configured units or as DINT in pulses.":
    "Jak przesyłane są rejestry REAL/DINT: jako REAL w jednostkach osi albo jako DINT w impulsach.",
  "Program bank the next start runs.": "Bank programu, który wykona następny start.",
  "Position bank the next start uses.": "Bank pozycji, którego użyje następny start.",
  "Stops, starts or pauses the program; reads as the program's state.":
    "Zatrzymuje, uruchamia lub wstrzymuje program; odczyt daje stan programu.",
  "Whether a motion register acts when written (DIRECT) or waits for its trigger register (TRIGGER).":
    "Czy rejestr ruchu działa od razu po zapisie (DIRECT), czy czeka na swój rejestr wyzwalający (TRIGGER).",
  "In TRIGGER mode starts the chosen axes with their absolute velocities.":
    "W trybie TRIGGER uruchamia wybrane osie z ich prędkościami bezwzględnymi.",
  "In TRIGGER mode starts the chosen axes with their relative velocities.":
    "W trybie TRIGGER uruchamia wybrane osie z ich prędkościami względnymi.",
  "In TRIGGER mode starts the chosen axes towards their absolute positions.":
    "W trybie TRIGGER uruchamia wybrane osie do ich pozycji bezwzględnych.",
  "In TRIGGER mode starts the chosen axes by their relative positions.":
    "W trybie TRIGGER uruchamia wybrane osie o ich pozycje względne.",
  "Listed but not available in this firmware: reads 0.": "Wymieniony, ale niedostępny w tym firmware: odczyt daje 0.",
  "Status of the controller.": "Stan sterownika.",
  "Status of axis M{n}.": "Stan osi M{n}.",
  "Switches the enable outputs of the chosen axes on.": "Załącza wyjścia zezwolenia wybranych osi.",
  "Switches the enable outputs of the chosen axes off.": "Wyłącza wyjścia zezwolenia wybranych osi.",
  "Stops the chosen axes at once, without ramp.": "Zatrzymuje wybrane osie natychmiast, bez rampy.",
  "Velocity of all axes while jogging, always REAL in units; function 06 writes it as a signed 16-bit number.":
    "Prędkość ruchu ręcznego wszystkich osi, zawsze REAL w jednostkach; funkcja 06 zapisuje ją jako liczbę 16-bitową ze znakiem.",
  "Counted position of axis M{n}; a write overwrites the counter without motion.":
    "Zliczona pozycja osi M{n}; zapis zmienia licznik bez ruchu.",
  "Present velocity of axis M{n}.": "Chwilowa prędkość osi M{n}.",
  "Acceleration of axis M{n} in position mode; speeding up and slowing down in velocity mode.":
    "Przyspieszenie osi M{n} w trybie pozycji; rozpędzanie i hamowanie w trybie prędkości.",
  "Deceleration of axis M{n} in position mode.": "Hamowanie osi M{n} w trybie pozycji.",
  "Cruise velocity of axis M{n} in position mode.": "Prędkość jazdy osi M{n} w trybie pozycji.",
  "Homes axis M{n} at this velocity at once: negative towards KL, positive towards KR.":
    "Od razu bazuje oś M{n} z tą prędkością: ujemna w stronę KL, dodatnia w stronę KR.",
  "Moves axis M{n} at this velocity.": "Porusza oś M{n} z tą prędkością.",
  "Moves axis M{n} at its present velocity plus this value.":
    "Porusza oś M{n} z jej obecną prędkością plus ta wartość.",
  "Moves axis M{n} to this position.": "Przesuwa oś M{n} do tej pozycji.",
  "Moves axis M{n} to its present position plus this value.": "Przesuwa oś M{n} o tę wartość od obecnej pozycji.",
  "Counter of encoder {n} in encoder pulses.": "Licznik enkodera {n} w impulsach enkodera.",
  "Counter of encoder {n} converted into a position of its drive.":
    "Licznik enkodera {n} przeliczony na pozycję jego napędu.",
  "Soft limit of axis M{n} towards negative positions (L).": "Limit programowy osi M{n} w stronę pozycji ujemnych (L).",
  "Soft limit of axis M{n} towards positive positions (R).":
    "Limit programowy osi M{n} w stronę pozycji dodatnich (R).",
  "State of the program.": "Stan programu.",
  "Whether the drive is switched on.": "Czy napęd jest załączony.",
  "Whether a motion is being made.": "Czy trwa ruch.",
  "Counted position.": "Zliczona pozycja.",
  // Settings of a MIC488.
  "Unit of position; velocities and accelerations are in it, too.":
    "Jednostka pozycji, a także prędkości i przyspieszeń.",
  "GEAR: pulses in one unit.": "GEAR: impulsy na jedną jednostkę.",
  "Acceleration after power-on.": "Przyspieszenie po włączeniu zasilania.",
  "Deceleration after power-on.": "Hamowanie po włączeniu zasilania.",
  "Velocity of position mode after power-on, VMAX.": "Prędkość trybu pozycji po włączeniu zasilania, VMAX.",
  "Pulses in a revolution of the motor.": "Impulsy na obrót silnika.",
  "Encoder counts in a revolution of the drive, after ×4.": "Zliczenia enkodera na obrót napędu, po ×4.",
  "Encoder counter after reset.": "Licznik enkodera po resecie.",
  "HOME0 stops at the switch, HOME1 backs off, HOME2 goes on past it, HOME3 and HOME4 end at channel C of the encoder.":
    "HOME0 zatrzymuje na krańcówce, HOME1 cofa z niej, HOME2 przejeżdża ją, HOME3 i HOME4 kończą na kanale C enkodera.",
  "Which switches stop the axis.": "Które krańcówki zatrzymują oś.",
  "Input of the left switch, for homing and as limit.": "Wejście lewej krańcówki, do bazowania i jako granica.",
  "Input of the right switch, for homing and as limit.": "Wejście prawej krańcówki, do bazowania i jako granica.",
  "What the encoder is for: nothing, correction of the position, or the axis follows it.":
    "Do czego służy enkoder: do niczego, do korekcji pozycji albo oś za nim podąża.",
  "What a position error does: nothing, stop, also stop the program, also set OUT8.":
    "Co robi błąd pozycji: nic, zatrzymuje oś, także program, także ustawia OUT8.",
  "Gain of the position correction.": "Wzmocnienie korekcji pozycji.",
  "Counts by which a position may be missed.": "O ile zliczeń pozycja może się różnić.",
  "How long after a move the correction begins.": "Po jakim czasie od ruchu zaczyna się korekcja.",
  "How long a drive may be blocked before that is an error.": "Jak długo napęd może być zablokowany, zanim to błąd.",
  "Whether EN controls the drive.": "Czy EN steruje napędem.",
  "How long a level must last to be seen.": "Jak długo poziom musi trwać, aby był widziany.",
  "Which level is 1.": "Który poziom oznacza 1.",
  "Preset of CFGINT_IN: which edge interrupts the program.":
    "Wstępne ustawienie CFGINT_IN: które zbocze przerywa program.",
  "Value at 0 V.": "Wartość przy 0 V.",
  "Value at 10 V.": "Wartość przy 10 V.",
  "Rate of the serial port.": "Prędkość portu szeregowego.",
  "Slave address of both ports.": "Adres slave obu portów.",
  "Whether a program runs at power-on.": "Czy po włączeniu zasilania rusza program.",
  "Bank of the program that runs at power-on.": "Bank programu, który rusza po włączeniu zasilania.",
  "Bank of its positions.": "Bank jego pozycji.",
  "Whether stored values are kept when they are triggered.": "Czy zapamiętane wartości zostają po wyzwoleniu.",
  // Values of an M1486.
  "Where the pulses given so far have led, since power-on.": "Dokąd doprowadziły dotychczasowe impulsy, od włączenia.",
  "Commanded velocity.": "Zadana prędkość.",
  "Position counter, 24 bits.": "Licznik pozycji, 24 bity.",
  "Whether a motion, a command or a program is in progress; one that is stopped is not.":
    "Czy trwa ruch, polecenie lub program; zatrzymany nie trwa.",
  "Whether the counter shows where it is: no move was stopped before its end.":
    "Czy licznik pokazuje prawdziwą pozycję: żaden ruch nie został zatrzymany przed końcem.",
  "Whether a host may send the next line: chips not addressed take any.":
    "Czy host może wysłać następną linię: układy niezaadresowane przyjmą każdą.",
  "Internal variable, 24 bits.": "Zmienna wewnętrzna, 24 bity.",
  "General purpose {n}.": "Ogólnego przeznaczenia {n}.",
  "Position counter.": "Licznik pozycji.",
  "Remainder of the last division.": "Reszta ostatniego dzielenia.",
  "Position, low byte.": "Pozycja, młodszy bajt.",
  "Position, middle byte.": "Pozycja, środkowy bajt.",
  "Position, high byte.": "Pozycja, starszy bajt.",
  "Internal variable, low byte.": "Zmienna wewnętrzna, młodszy bajt.",
  "Internal variable, middle byte.": "Zmienna wewnętrzna, środkowy bajt.",
  "Internal variable, high byte.": "Zmienna wewnętrzna, starszy bajt.",
  "Flags 80 to 87.": "Flagi 80 do 87.",
  "Driver interface: 0 Two DACs, 1 Dual DAC, 2 Step & Direction.":
    "Interfejs sterownika mocy: 0 dwa DAC, 1 podwójny DAC, 2 Step & Direction.",
  "Production series.": "Seria produkcyjna.",
  "Functions 40 to 47.": "Funkcje 40 do 47.",
  "Functions 48 to 55.": "Funkcje 48 do 55.",
  "Functions 56 to 63.": "Funkcje 56 do 63.",
  "Type letter in ASCII.": "Litera typu w ASCII.",
  // Commands of an M1486.
  "{text} (in program order)": "{text} (w kolejności programu)",
  "{text} (when received)": "{text} (przy odbiorze)",
  "{text} (when compressed)": "{text} (przy kompresji)",
  "Gives the next command a label.": "Nadaje następnemu poleceniu etykietę.",
  "Runs the commands up to the matching E this many times.": "Wykonuje tyle razy polecenia do odpowiadającego E.",
  "Goes back to the matching L until its count is done.": "Wraca do odpowiadającego L, aż wykona zadaną liczbę razy.",
  "Jumps to the label when the line or flag has the level named.":
    "Skacze do etykiety, gdy linia lub flaga ma podany poziom.",
  "Goes on at the label.": "Idzie dalej od etykiety.",
  "Stops the motion with its ramp, and the program too while function 51 is OFF.":
    "Zatrzymuje ruch z rampą, a przy wyłączonej funkcji 51 także program.",
  "Lets a program go on that Kill has stopped.": "Pozwala iść dalej programowi, który zatrzymał Kill.",
  "Sends one byte to the host.": "Wysyła jeden bajt do hosta.",
  "Waits.": "Czeka.",
  "From here on commands are stored, not run.": "Odtąd polecenia są zapamiętywane, a nie wykonywane.",
  "Runs the commands stored since [.": "Wykonuje polecenia zapamiętane od [.",
  "Goes on at the label and comes back at the next dot.": "Idzie dalej od etykiety i wraca przy następnej kropce.",
  "Goes back to the command after the call.": "Wraca do polecenia po wywołaniu.",
  "Sets distance and negative direction of the next move.": "Ustawia drogę i kierunek ujemny następnego ruchu.",
  "Reverses the direction of the next move.": "Odwraca kierunek następnego ruchu.",
  "Sets distance and positive direction of the next move.": "Ustawia drogę i kierunek dodatni następnego ruchu.",
  "Sets distance and direction from the present position to this one.":
    "Ustawia drogę i kierunek z obecnej pozycji do tej.",
  "The next move runs in positive direction until Kill or LIMIT.":
    "Następny ruch trwa w kierunku dodatnim aż do Kill lub LIMIT.",
  "The next move runs in negative direction until Kill or LIMIT.":
    "Następny ruch trwa w kierunku ujemnym aż do Kill lub LIMIT.",
  "Sets distance and direction from the present position to 0.": "Ustawia drogę i kierunek z obecnej pozycji do 0.",
  "Gives the position counter a value.": "Nadaje wartość licznikowi pozycji.",
  "Sets the position counter to 0.": "Zeruje licznik pozycji.",
  "Sets acceleration and deceleration.": "Ustawia przyspieszenie i hamowanie.",
  "Sets the speed at which a move starts and ends.": "Ustawia prędkość, z którą ruch się zaczyna i kończy.",
  "Sets the speed from which the acceleration is parabolic; above 7000 and V there is no such part.":
    "Ustawia prędkość, od której przyspieszenie jest paraboliczne; powyżej 7000 i V nie ma takiej części.",
  "Sets the highest speed of a move.": "Ustawia największą prędkość ruchu.",
  "Makes the move specified last.": "Wykonuje ostatnio podany ruch.",
  "Moves at start/stop speed in positive direction until the line has its end level.":
    "Jedzie z prędkością start/stop w kierunku dodatnim, aż linia będzie miała poziom końcowy.",
  "Moves at start/stop speed in negative direction until the line has its end level.":
    "Jedzie z prędkością start/stop w kierunku ujemnym, aż linia będzie miała poziom końcowy.",
  "Sets an output low.": "Ustawia wyjście w stan niski.",
  "Waits until the line is high.": "Czeka, aż linia będzie w stanie wysokim.",
  "Sets an output high.": "Ustawia wyjście w stan wysoki.",
  "Waits until the line is low.": "Czeka, aż linia będzie w stanie niskim.",
  "Sets the microsteps per full step at low speed.": "Ustawia mikrokroki na pełny krok przy małej prędkości.",
  "Sets the microsteps per full step at high speed.": "Ustawia mikrokroki na pełny krok przy dużej prędkości.",
  "Chooses the waveform of the phase currents.": "Wybiera przebieg prądów faz.",
  "Sets everything to its defaults; E types erase the EEPROM too.":
    "Ustawia wszystko na wartości domyślne; typy E kasują też EEPROM.",
  "Lets only the chip with this address listen.": "Każe słuchać tylko układowi o tym adresie.",
  "Lets all chips listen.": "Każe słuchać wszystkim układom.",
  "Switches a function on.": "Włącza funkcję.",
  "Switches a function off.": "Wyłącza funkcję.",
  "Sets a user flag.": "Ustawia flagę użytkownika.",
  "Clears a user flag.": "Kasuje flagę użytkownika.",
  "Gives the internal variable a value.": "Nadaje wartość zmiennej wewnętrznej.",
  "Reads lines into the internal variable, lowest line = lowest bit.":
    "Czyta linie do zmiennej wewnętrznej, najniższa linia = najmłodszy bit.",
  "Puts the internal variable out on lines, lowest line = lowest bit.":
    "Wystawia zmienną wewnętrzną na linie, najniższa linia = najmłodszy bit.",
  "Copies the internal variable to a register.": "Kopiuje zmienną wewnętrzną do rejestru.",
  "Copies a register to the internal variable.": "Kopiuje rejestr do zmiennej wewnętrznej.",
  "Adds to the internal variable; sets flag 87 on overflow.":
    "Dodaje do zmiennej wewnętrznej; przy przepełnieniu ustawia flagę 87.",
  "Subtracts from the internal variable; sets flag 87 when that is too small.":
    "Odejmuje od zmiennej wewnętrznej; gdy ta jest za mała, ustawia flagę 87.",
  "Multiplies the internal variable.": "Mnoży zmienną wewnętrzną.",
  "Divides the internal variable; the remainder goes to register 10.":
    "Dzieli zmienną wewnętrzną; reszta trafia do rejestru 10.",
  // Parameters of faults.
  "Which bit, 0 is the lowest.": "Który bit, 0 jest najmłodszy.",
  "Towards the twin, or from it.": "Do bliźniaka albo od niego.",
  "On this link alone, such as tcp-1, pty, serial; tcp: each tcp-N.":
    "Tylko na tym łączu, na przykład tcp-1, pty, serial; tcp: każde tcp-N.",
  "On this line of a world alone.": "Tylko na tej linii świata.",
  "Only this time, counted from 1.": "Tylko ten raz, licząc od 1.",
  "Each time this number has come round.": "Za każdym razem, gdy minie tyle.",
  "How probable it is each time.": "Z jakim prawdopodobieństwem za każdym razem.",
  "It happens at most so often.": "Zdarza się najwyżej tyle razy.",
  "Not before so many seconds after the fault was set.": "Nie wcześniej niż tyle sekund po ustawieniu usterki.",
  "Not later than this.": "Nie później niż wtedy.",
  "How many.": "Ile.",
  "Which.": "Który.",
  "How long.": "Jak długo.",
  "Bytes in a piece.": "Bajty w porcji.",
  "How long after each other pieces come.": "W jakim odstępie przychodzą porcje.",
  "How much longer.": "O ile dłużej.",
  "Requests to this unit.": "Zapytania do tego adresu.",
  "Requests with this function code.": "Zapytania z tym kodem funkcji.",
  "Requests that touch these addresses.": "Zapytania, które dotyczą tych adresów.",
  "What was lost.": "Co zginęło.",
  "The exception code.": "Kod wyjątku.",
  "Which axis.": "Która oś.",
  "Which machine; for a served twin its unit.": "Który sterownik; przy pojedynczym bliźniaku jego adres.",
  "When, in seconds after the fault was set.": "Kiedy, w sekundach po ustawieniu usterki.",
  "And again and again after so many seconds.": "I znów, co tyle sekund.",
  "By how many pulses; negative: ahead.": "O ile impulsów; ujemne: do przodu.",
  "By how many counts.": "O ile zliczeń.",
  "Which input.": "Które wejście.",
  "The level; volts on analog inputs.": "Poziom; na wejściach analogowych wolty.",
  "How often it goes back.": "Ile razy się cofa.",
  "How long that takes.": "Ile to trwa.",
  "How long the supply is off.": "Jak długo nie ma zasilania.",
  "Bytes written until then.": "Bajty zapisane do tej chwili.",
  "Which element, by its name.": "Który element, według nazwy.",
  "Which output.": "Które wyjście.",
  "The level it keeps.": "Poziom, który trzyma.",
  "Of its torque.": "Jaka część momentu.",
  "Of its lift.": "Jaka część skoku.",
  "Whose belt.": "Czyj pasek.",
  "Of its frequency.": "Jaka część częstotliwości.",
  "Of its friction.": "Krotność tarcia.",
  "Of its mass, forces and torques; 0: it is missing.": "Krotność masy, sił i momentów; 0: obciążenia brak.",
  "Too high; negative: too low.": "O ile za dużo; ujemne: za mało.",
  "V that it has at most.": "Ile V ma najwyżej.",
  "Saves that go well.": "Zapisy, które się udają.",
};
