import { expect, test } from "vitest";
import type { Fields } from "../protocol/connection";
import type { SubjectEvent } from "../protocol/types";
import { wholeStep, type Stepped } from "./step";

const event = (number: number) => ({ number }) as unknown as SubjectEvent;

/** A studio that takes a second in each part of a step to ten. */
function studio() {
  const asked: Fields<"step">[] = [];
  const ask = async (fields: Fields<"step">): Promise<Stepped> => {
    asked.push(fields);
    const events = [event(asked.length)];
    return asked.length < 10 ? { events, to_ns: "10000000000" } : { events, came: fields.until !== undefined };
  };
  return { asked, ask };
}

test("a step goes to its end, however many parts it has", async () => {
  const { asked, ask } = studio();
  const { events, came } = await wholeStep(ask, { for_ns: "10000000000", until: "table.M1_POS > 3" }, () => true);
  expect(came).toBe(true);
  expect(events).toHaveLength(10);
  expect(asked[0]).toEqual({ for_ns: "10000000000", until: "table.M1_POS > 3" });
  expect(asked[9]).toEqual({ to_ns: "10000000000", until: "table.M1_POS > 3" });
});

test("it ends after a part where something else is wanted of time", async () => {
  const { asked, ask } = studio();
  const { events, came } = await wholeStep(ask, { for_ns: "10000000000" }, () => asked.length < 3);
  expect(came).toBeUndefined();
  expect(events).toHaveLength(3);
});
