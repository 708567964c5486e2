/** A value in the storage of the browser, with the version of its form. What is of another version, or cannot be read, is left out. */
export function restore<T>(key: string, version: number, isWhole: (value: unknown) => value is T): T | null {
  try {
    const kept = JSON.parse(localStorage.getItem(`steptwin.${key}`) ?? "null") as {
      version?: number;
      value?: unknown;
    } | null;
    return kept?.version === version && isWhole(kept.value) ? kept.value : null;
  } catch {
    return null;
  }
}

/** Gives whether there is a storage, with room; the page works without it. */
export function keep(key: string, version: number, value: unknown): boolean {
  try {
    localStorage.setItem(`steptwin.${key}`, JSON.stringify({ version, value }));
    return true;
  } catch {
    return false;
  }
}
