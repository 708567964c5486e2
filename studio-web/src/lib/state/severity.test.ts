import { expect, test } from "vitest";
import type { SubjectEvent } from "../protocol/types";
import type { ControllerModel } from "./model";
import { severityOf, stopsMotor } from "./severity";

const MACHINE = {
  sheet: {
    events: [
      { code: "limit", severity: "warning", stops_motor: true },
      { code: "homed", severity: "information" },
    ],
  },
} as unknown as ControllerModel;
const event = (kind: string, code = "") => ({ kind, code }) as SubjectEvent;

test("events are as grave as their data sheet has them", () => {
  expect(severityOf(event("status", "limit"), MACHINE)).toBe("warning");
  expect(severityOf(event("status", "homed"), MACHINE)).toBe("information");
  expect(severityOf(event("status", "limit"), undefined)).toBe("information");
  expect([stopsMotor(event("status", "limit"), MACHINE), stopsMotor(event("status", "other"), MACHINE)]).toEqual([
    true,
    null,
  ]);
});

test("what belongs to no controller", () => {
  expect(severityOf(event("fault"), MACHINE)).toBe("warning");
  expect(severityOf(event("report", "overdue"), undefined)).toBe("alarm");
  expect(severityOf(event("note"), MACHINE)).toBe("information");
});
