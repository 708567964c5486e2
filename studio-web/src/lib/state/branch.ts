/** The world that a branch comes from, its number, and the moment in seconds at which it begins. */
export interface Branch {
  name: string;
  number: string;
  time: string;
}

/** The name of a branch says what it is (live/studio/branches.py); null for any other world. */
export function branchOf(name: string): Branch | null {
  const [, of, number, time] = /^(.+), branch (\d+) from ([\d.]+) s$/.exec(name) ?? [];
  return of === undefined || number === undefined || time === undefined ? null : { name: of, number, time };
}
