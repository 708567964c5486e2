/** A number as the page shows it: a true minus, so many digits after the point. */
export function shownNumber(value: number | null | undefined, decimals: number): string {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const text = value.toFixed(decimals);
  return /^-[0.]+$/.test(text) ? text.slice(1) : text.replace("-", "−");
}

/** As few digits as tell it. */
export function shortNumber(value: number | null | undefined): string {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return String(Number(value.toPrecision(7))).replace("-", "−");
}

/** All digits, from a million on in groups of three: 65535, 2 147 483 647. */
export function wholeNumber(value: number): string {
  const digits = String(value).replace("-", "−");
  return Math.abs(value) < 1e6 ? digits : digits.replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

/** What somebody typed: point or comma, either minus. Null where it is no number, and where a comma may separate thousands. */
export function readNumber(text: string): number | null {
  const plain = text.trim().replace("−", "-");
  if (hasThousands(plain) || !/^[+-]?(\d+[.,]?\d*|[.,]\d+)(e[+-]?\d+)?$/i.test(plain)) return null;
  const value = Number(plain.replace(",", "."));
  return Number.isFinite(value) ? value : null;
}

/** Whether 1,000 is 1000 or 1.0 is not clear. */
export function hasThousands(text: string): boolean {
  return /^[+−-]?[1-9]\d{0,2}(,\d{3})+$/.test(text.trim());
}

export function shownTime(time_ns: bigint, decimals = 3): string {
  const scale = 10n ** BigInt(9 - decimals);
  const parts = time_ns / scale;
  const digits = String(parts).padStart(decimals + 1, "0");
  return `${digits.slice(0, -decimals)}.${digits.slice(-decimals)}`;
}
