/**
 * Polish for fixed sets of sentences that the service gives in English: kinds of faults, checks of devices. A test compares them with the
 * service (tests/studio/test_texts.py).
 */
export const MEANINGS: Readonly<Record<string, string>> = {
  "A bit of a byte arrives turned round.": "Bit bajtu dochodzi odwrócony.",
  "Bytes are lost.": "Giną bajty.",
  "A byte too much comes before a byte.": "Przed bajtem przychodzi bajt nadmiarowy.",
  "The line is silent before a byte.": "Przed bajtem linia milczy.",
  "Bytes come in pieces, as USB adapters deliver them.": "Bajty przychodzą porcjami, jak z przejściówek USB.",
  "Bytes of no meaning come before what was sent.": "Przed tym, co nadano, przychodzą bajty bez znaczenia.",
  "The answer takes longer; the ones behind it wait.": "Odpowiedź trwa dłużej; następne na nią czekają.",
  "There is no answer: the request was lost on its way, or was carried out and the answer lost.":
    "Nie ma odpowiedzi: zapytanie zginęło po drodze albo zostało wykonane, a zginęła odpowiedź.",
  "The answer is held back and comes before the next one.": "Odpowiedź jest wstrzymana i przychodzi przed następną.",
  "The answer carries the address of another unit.": "Odpowiedź ma adres innego urządzenia.",
  "The answer has a wrong CRC.": "Odpowiedź ma błędne CRC.",
  "The request comes back before its answer.": "Przed odpowiedzią wraca zapytanie (echo).",
  "The request is refused and not carried out.": "Zapytanie jest odrzucone i niewykonane.",
  "The request is refused with exception 6, device busy, and not carried out.":
    "Zapytanie jest odrzucone z wyjątkiem 6 (urządzenie zajęte) i niewykonane.",
  "The shaft is blocked: pulses go on and turn nothing.":
    "Wał jest zablokowany: impulsy idą dalej i niczego nie obracają.",
  "The shaft falls behind the pulses and stays there.": "Wał gubi kroki i już ich nie nadrabia.",
  "The encoder slips on the shaft.": "Enkoder ślizga się na wale.",
  "An input keeps a level, whatever its switch does.": "Wejście trzyma poziom, cokolwiek robi jego łącznik.",
  "A slave of the controller's own Modbus master does not answer: M_STATUS is 3.":
    "Slave własnego mastera Modbus sterownika nie odpowiada: M_STATUS wynosi 3.",
  "A switch bounces: its input changes to and fro before it settles.":
    "Drgają styki łącznika: wejście zmienia się kilka razy, zanim się ustali.",
  "The supply fails and comes back: nothing answers, drives and outputs are off, then it is as after power-on.":
    "Zasilanie zanika i wraca: nic nie odpowiada, napędy i wyjścia są wyłączone, potem jest jak po włączeniu.",
  "The supply fails while memory is being saved: what was not yet written keeps its old content.":
    "Zasilanie zanika podczas zapisu pamięci: co jeszcze nie zapisane, zachowuje starą treść.",
  "The memory is worn out: with each save one more byte, chosen by chance, keeps what it has for ever.":
    "Pamięć jest zużyta: przy każdym zapisie jeszcze jeden losowy bajt na zawsze zachowuje to, co ma.",
  "An output of an element keeps its level.": "Wyjście elementu trzyma poziom.",
  "An input of an element keeps a level, whatever its contacts or its wire do.":
    "Wejście elementu trzyma poziom, cokolwiek robią jego zestyki lub przewód.",
  "The contact NO of a relay stays closed once it is.": "Zestyk NO przekaźnika, raz zamknięty, zostaje zamknięty.",
  "The coil of a relay is interrupted.": "Cewka przekaźnika ma przerwę.",
  "A cylinder has no compressed air: a spring retracts it, without one it stands.":
    "Siłownik nie ma sprężonego powietrza: cofa go sprężyna, bez niej stoi.",
  "A cylinder stands where it is.": "Siłownik stoi tam, gdzie jest.",
  "A conveyor with a speed stands, although it is switched on.":
    "Przenośnik o podanej prędkości stoi, choć jest włączony.",
  "The feeder of a conveyor is empty or blocked: no workpieces come onto it.":
    "Podajnik przenośnika jest pusty lub zablokowany: nie przychodzą na niego detale.",
  "A suction cup does not hold a vacuum.": "Przyssawka nie trzyma podciśnienia.",
  "The jaws of a gripper let workpieces slip.": "Szczęki chwytaka nie utrzymują detali.",
  "A brake has only a share of its torque.": "Hamulec ma tylko część momentu.",
  "A brake does not let go.": "Hamulec nie zwalnia.",
  "A shaft stands while its axis turns; afterwards it goes on from where it stands.":
    "Wał stoi, choć oś się obraca; potem rusza dalej z miejsca, w którym stoi.",
  "A follower stays where it is; afterwards it is on its cam again at once.":
    "Popychacz stoi tam, gdzie jest; potem od razu znów leży na krzywce.",
  "A cam lifts its follower by a share only.": "Krzywka podnosi popychacz tylko częściowo.",
  "The belt of a carriage is slack: it swings at a lower frequency.":
    "Pasek wózka jest luźny: wózek drga z niższą częstotliwością.",
  "The wire of an analog sensor is broken: 0 V.": "Przewód czujnika analogowego jest przerwany: 0 V.",
  "An analog sensor reads too high or too low.": "Czujnik analogowy zawyża lub zaniża.",
  "A belt of a tool stands while its axis turns; afterwards it goes on from where it stands.":
    "Pasek narzędzia stoi, choć oś się obraca; potem rusza dalej z tego miejsca.",
  "The guides of a gantry have a multiple of their friction.": "Prowadnice bramy mają wielokrotność swojego tarcia.",
  "A power supply has less voltage; its controllers are off while that is not enough.":
    "Zasilacz ma obniżone napięcie; gdy jest za niskie, jego sterowniki są wyłączone.",
  "A load is a multiple of what it should be.": "Obciążenie jest wielokrotnością tego, które powinno być.",
  "Unknown function, address, quantity; wrong CRC, other unit, short frame":
    "Nieznana funkcja, adres, liczba; błędne CRC, inne urządzenie, krótka ramka",
  "A read by broadcast (a write would change other controllers, too)":
    "Odczyt rozgłoszeniowy (zapis zmieniłby też inne sterowniki)",
  "Reads of holes and of write-only registers": "Odczyt luk i rejestrów tylko do zapisu",
  "Function 16 to registers of one word, to several, and with a bad value":
    "Funkcja 16 do rejestrów jednosłowowych, do kilku i z błędną wartością",
  "Half a value of 32 bits": "Połowa wartości 32-bitowej",
  "Bad values of DATA_TYPE and M1_ACC": "Błędne wartości DATA_TYPE i M1_ACC",
  "A motion command to an axis that is off": "Polecenie ruchu dla wyłączonej osi",
  "STOP during a motion": "STOP podczas ruchu",
  "Requests behind noise and with a pause": "Zapytania po zakłóceniu i z przerwą",
  "M1_ACC with both values of DATA_TYPE": "M1_ACC przy obu wartościach DATA_TYPE",
  "What PROGRAM_CTRL reads": "Co daje odczyt PROGRAM_CTRL",
  "Units 0 and 255 on Modbus TCP, of a single controller": "Adresy 0 i 255 w Modbus TCP, jednego sterownika",
  "Impossible quantities; writes to read-only registers": "Niemożliwe liczby; zapis rejestrów tylko do odczytu",
  "Bits of M_STOP above the fourth axis": "Bity M_STOP powyżej czwartej osi",
  "The last bank, and the one after it": "Ostatni bank i następny po nim",
  "Reads in immediate succession": "Odczyty bezpośrednio po sobie",
  "M1_ACC of half a pulse with DATA_TYPE 1": "M1_ACC o wartości pół impulsu przy DATA_TYPE 1",
  "Comments and LF": "Komentarze i LF",
  "Blanks inside a command": "Odstępy wewnątrz polecenia",
  "Wrong data are dropped without an answer": "Błędne dane giną bez odpowiedzi",
  "What U15, U16 and U20 send": "Co wysyłają U15, U16 i U20",
  "The order of bits in U14, with flag 80": "Kolejność bitów w U14, przy fladze 80",
  "What bytes without a meaning upload": "Co dają bajty bez znaczenia przy odczycie pamięci",
  "U while a character is on its way": "U, gdy znak jest jeszcze w drodze",
  "A line longer than the input buffer": "Linia dłuższa niż bufor wejściowy",
  "A CR in the last three places of the input buffer": "CR na trzech ostatnich miejscach bufora wejściowego",
};
