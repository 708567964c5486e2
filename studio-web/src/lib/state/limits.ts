import { t } from "../../text";
import type { Point } from "./model";
import { hasThousands, readNumber, shortNumber, wholeNumber } from "./numbers";

export type Limits = NonNullable<Point["limits"]>;

export function rangeWords({ low, high, is_low_excluded }: Limits): string {
  if (low !== null && high !== null) return t("rangeBetween", { low: limit(low), high: limit(high) });
  if (low !== null) return t(is_low_excluded ? "rangeAbove" : "rangeFrom", { low: limit(low) });
  return high === null ? "" : t("rangeTo", { high: limit(high) });
}

/** Whole numbers with all their digits: the last one is permitted, the next one is not. */
const limit = (value: number): string => (Number.isSafeInteger(value) ? wholeNumber(value) : shortNumber(value));

export function isWithin(value: number, { low, high, is_low_excluded }: Limits): boolean {
  if (low !== null && (is_low_excluded ? value <= low : value < low)) return false;
  return high === null || value <= high;
}

/** Why a text is not a number; one whose comma may separate thousands with what to write. */
export function whyNoNumber(text: string): string {
  const plain = text.trim();
  if (!hasThousands(plain)) return t("notANumber", { text: plain || "“”" });
  return t("thousands", {
    text: plain,
    whole: plain.replaceAll(",", ""),
    fraction: plain.replace(",", ".").replaceAll(",", ""),
  });
}

/** The number in a text, or why it cannot be taken. */
export function checkedNumber(text: string, limits: Limits | null): { value: number } | { wrong: string } {
  const value = readNumber(text);
  if (value === null) return { wrong: whyNoNumber(text) };
  if (limits !== null && !isWithin(value, limits)) {
    return { wrong: t("outOfRange", { value: shortNumber(value), range: rangeWords(limits) }) };
  }
  return { value };
}
