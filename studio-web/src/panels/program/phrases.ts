/** Words of the editor in Polish; in English they are as they are. */
const POLISH: Readonly<Record<string, string>> = {
  "New name": "Nowa nazwa",
  rename: "zmień",
  "Rename request failed": "Nie można zmienić nazwy",
  "Formatting request failed": "Nie można sformatować",
  "Find definition failed": "Nie znaleziono definicji",
  "Control character": "Znak sterujący",
  Find: "Szukaj",
  Replace: "Zamień",
  next: "następny",
  previous: "poprzedni",
  all: "wszystkie",
  "match case": "wielkość liter",
  "by word": "całe słowa",
  regexp: "wyrażenie",
  replace: "zamień",
  "replace all": "zamień wszystkie",
  close: "zamknij",
  "Go to line": "Idź do wiersza",
  go: "idź",
  Diagnostics: "Uwagi",
  "No diagnostics": "Brak uwag",
  Completions: "Uzupełnienia",
};

export const phrases = (language: string): Record<string, string> => (language === "pl" ? { ...POLISH } : {});
