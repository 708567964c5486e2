import { expect, test } from "vitest";
import { PERIOD, phaseCurrent } from "./waveforms";

test("currents are those of the chip, but for its rounding to 127 steps", () => {
  // From steptwin.motion.waveforms.currents(characteristic, 24), both phases.
  const of24: readonly [number, number][] = [
    [71, -106], [95, -127], [63, -102], [53, -96], [48, -79], [79, -110], [89, -114],
  ]; // prettier-ignore
  for (const [index, phases] of of24.entries()) {
    const found = ([1, 2] as const).map((phase) => Math.round((phaseCurrent(index + 1, phase, 24) * 127) / 100));
    expect([index + 1, ...found]).toEqual([index + 1, ...phases]);
    expect(phaseCurrent(index + 1, 1, 24 - 3 * PERIOD)).toBeCloseTo(phaseCurrent(index + 1, 1, 24), 9);
  }
  expect(phaseCurrent(0, 1, 5)).toBeNaN();
});
