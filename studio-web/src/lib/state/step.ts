import type { Fields } from "../protocol/connection";
import type { SubjectEvent } from "../protocol/types";

/** The answer to a step, or to a part of one: `to_ns` is where that goes on to. */
export interface Stepped {
  events?: SubjectEvent[];
  came?: boolean;
  idle?: boolean;
  to_ns?: string;
}

/** Events of a step that are shown: the last ones. */
const MOST = 1000;

/** A whole step. The studio takes a long one in parts, between which it serves others; `goesOn` is asked after each of them. */
export async function wholeStep(
  ask: (fields: Fields<"step">) => Promise<Stepped>,
  { until, ...to }: Fields<"step">,
  goesOn: () => boolean,
): Promise<Stepped> {
  let part = await ask({ ...to, until });
  let events = part.events ?? [];
  while (part.to_ns !== undefined && goesOn()) {
    part = await ask({ to_ns: part.to_ns, until });
    events = [...events, ...(part.events ?? [])].slice(-MOST);
  }
  return { ...part, events };
}
