import { readFileSync } from "node:fs";
import { expect, test } from "vitest";
import { Trajectory, type Plan } from "./plan";

interface Vectors {
  plans: { name: string; plan: Plan; at: [string, number, number][] }[];
}

const file = new URL("../../../../tests/motion/plan_vectors.json", import.meta.url);
const vectors = JSON.parse(readFileSync(file, "utf-8")) as Vectors;

test("there are vectors", () => expect(vectors.plans.length).toBeGreaterThan(3));

for (const { name, plan, at } of vectors.plans) {
  test(`positions and velocities: ${name}`, () => {
    const trajectory = new Trajectory(plan);
    for (const [time_ns, position, velocity] of at) {
      const motion = trajectory.at(BigInt(time_ns));
      expect(motion.position).toBeCloseTo(position, 6);
      expect(motion.velocity).toBeCloseTo(velocity, 5);
    }
  });
}

test("it moves from its start to its end", () => {
  const trajectory = new Trajectory({
    start_ns: "1000000000",
    base: 0,
    final: 10,
    segments: [[0.5, 0, 0, 20, 0, 0, 1]],
  });
  expect(trajectory.isMoving(1_499_999_999n)).toBe(true);
  expect(trajectory.isMoving(1_500_000_000n)).toBe(false);
  expect(trajectory.at(0n)).toEqual({ position: 0, velocity: 20 });
});

test("pulses are counted when they have been reached, in the direction of the motion", () => {
  const forwards = new Trajectory({ start_ns: "0", base: 100, final: 5.5, segments: [[1, 0, 0, 5.5, 0, 0, 1]] });
  expect([0n, 500_000_000n, 999_000_000n, 2_000_000_000n].map((t) => forwards.counted(t))).toEqual([
    100, 102, 105, 105,
  ]);
  const backwards = new Trajectory({ start_ns: "0", base: 0, final: -5.5, segments: [[1, 0, 0, -5.5, 0, 0, -1]] });
  expect([500_000_000n, 2_000_000_000n].map((t) => backwards.counted(t))).toEqual([-2, -5]);
  expect(new Trajectory({ start_ns: "0", base: 7, final: 0, segments: [] }).counted(5n)).toBe(7);
});
