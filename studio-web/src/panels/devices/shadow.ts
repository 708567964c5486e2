/** How positions of a device and of its twin are drawn. */

export type Sample = readonly (number | null)[];

export interface Curves {
  device: string;
  twin: string;
  /** Device minus twin. */
  difference: string;
  positions: readonly [number, number];
  /** Largest difference, at least as large as the tolerance at rest. */
  most: number;
}

const bounds = (values: readonly number[]): [number, number] => {
  const low = Math.min(...values);
  const high = Math.max(...values);
  const room = Math.max((high - low) * 0.05, 1e-3);
  return [low - room, high + room];
};

/** Points of three polylines in a box of `width`, of which positions have the height `height` and differences that of `below`. */
export function curvesOf(
  samples: readonly Sample[],
  [begin, end]: readonly [number, number],
  width: number,
  height: number,
  below: number,
): Curves {
  const known = samples.map(([at, device, twin, tolerance]) => ({
    at: at ?? 0,
    device: device ?? 0,
    twin: twin ?? 0,
    tolerance: tolerance ?? null,
  }));
  const positions = bounds(known.flatMap(({ device, twin }) => [device, twin]));
  const compared = known.filter(({ tolerance }) => tolerance !== null);
  const most = Math.max(1e-3, ...compared.map(({ device, twin }) => Math.abs(device - twin)));
  const x = (at: number) => ((at - begin) / (end - begin)) * width;
  const y = (position: number) => (1 - (position - positions[0]) / (positions[1] - positions[0])) * height;
  const line = (points: readonly (readonly [number, number])[]) =>
    points.map(([px, py]) => `${px.toFixed(1)},${py.toFixed(1)}`).join(" ");
  return {
    device: line(known.map((one) => [x(one.at), y(one.device)])),
    twin: line(known.map((one) => [x(one.at), y(one.twin)])),
    difference: line(
      compared.map((one) => [x(one.at), below / 2 - ((one.device - one.twin) / most) * (below / 2 - 2)]),
    ),
    positions,
    most,
  };
}
