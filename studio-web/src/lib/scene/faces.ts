import { dot, ROUND, times, type Solid, type Vector } from "./builder";
import type { Drawn } from "./strand";
import type { View } from "./view";

/** The faces of a solid about its middle: those around it, then its lower and its upper end. Corners are counterclockwise, seen from outside. */
export function facetsOf({ size, prism }: Pick<Solid, "size" | "prism">): Vector[][] {
  const axis = prism?.axis ?? 2;
  const [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
  const count = prism?.corners ?? 4;
  const first = prism === null ? Math.PI / 4 : Math.atan2(prism.towards[b] as number, prism.towards[a] as number);
  // The corners of a box are on a circle about it only where it is a square.
  const reach = prism === null ? Math.SQRT1_2 : 0.5;
  const end = (side: number) =>
    Array.from({ length: count }, (_, k): Vector => {
      const angle = first + (2 * Math.PI * k) / count;
      const wide = reach * (prism?.ends[side < 0 ? 0 : 1] ?? 1);
      const corner = [0, 0, 0];
      corner[axis] = (side * (size[axis] as number)) / 2;
      corner[a] = Math.cos(angle) * wide * (size[a] as number);
      corner[b] = Math.sin(angle) * wide * (size[b] as number);
      return corner as unknown as Vector;
    });
  const [lower, upper] = [end(-1), end(1)];
  const sides = lower.map((corner, k) => {
    const next = (k + 1) % count;
    return [corner, lower[next], upper[next], upper[k]] as Vector[];
  });
  return [...sides, lower.reverse(), upper];
}

/** What is drawn of a solid, about its middle, as the data of paths: its outline and faces by how much light they have. */
export interface Faces {
  front: string;
  side: string;
  top: string;
}

type Flat = readonly [number, number];

const pathOf = (points: readonly Flat[]) =>
  points.length ? `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z` : "";

/** By the monotone chain of Andrew, in the direction of faces that are seen: what is drawn in one path leaves no hole. */
function hullOf(points: readonly Flat[]): Flat[] {
  const sorted = [...points].sort((one, other) => one[0] - other[0] || one[1] - other[1]);
  const turns = (o: Flat, a: Flat, b: Flat) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
  const half = (list: readonly Flat[]) => {
    const chain: Flat[] = [];
    for (const point of list) {
      while (chain.length > 1 && turns(chain.at(-2) as Flat, chain.at(-1) as Flat, point) <= 1e-9) chain.pop();
      chain.push(point);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())].reverse();
}

function normalOf([a, b, c]: readonly Vector[]): Vector {
  if (a === undefined || b === undefined || c === undefined) return [0, 0, 0];
  const [u, v] = [b, c].map((end, k) => end.map((one, n) => one - ((k ? b : a)[n] as number))) as unknown as [Vector, Vector]; // prettier-ignore
  const across: Vector = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const length = Math.hypot(...across);
  return across.map((one) => one / length) as unknown as Vector;
}

/** Places, normals and triangles of a shape at a size of 1; what is round is smooth. */
export function meshOf(prism: Solid["prism"]): { places: number[]; normals: number[]; indices: number[] } {
  const facets = facetsOf({ size: [1, 1, 1], prism });
  const mesh = { places: [] as number[], normals: [] as number[], indices: [] as number[] };
  facets.forEach((facet, n) => {
    const isSmooth = prism?.corners === ROUND && n < facets.length - 2;
    const flat = normalOf(facet);
    const first = mesh.places.length / 3;
    for (const corner of facet) {
      const out = corner.map((one, k) => (k === prism?.axis ? 0 : one)) as unknown as Vector;
      mesh.places.push(...corner);
      mesh.normals.push(...(isSmooth ? times(out, 1 / Math.hypot(...out)) : flat));
    }
    for (let k = 1; k < facet.length - 1; k++) mesh.indices.push(first, first + k, first + k + 1);
  });
  return mesh;
}

const SEEN = 1e-6;

/** A solid in a view, turned by the pose at `from`. What is round is its outline and the end that is seen. `line`: its points. */
export function facesOf(
  solid: Solid,
  poses: Float64Array,
  from: number,
  { right, up, near }: View,
  line?: Drawn,
): Faces {
  const rows = [0, 3, 6].map((row) => poses.subarray(from + row, from + row + 3) as unknown as Vector) as [Vector, Vector, Vector]; // prettier-ignore
  const turned = (corner: Vector): Vector => [dot(rows[0], corner), dot(rows[1], corner), dot(rows[2], corner)];
  const flat = (corner: Vector): Flat => [dot(right, corner), -dot(up, corner)];
  const faces: Faces = { front: "", side: "", top: "" };
  if (line !== undefined) {
    const { points, count } = line;
    let next = "M";
    for (let k = 0; k < 3 * count; k += 3) {
      const point = points.subarray(k, k + 3) as unknown as Vector;
      const isBreak = Number.isNaN(point[0]);
      const [right, down] = flat(turned(point));
      if (!isBreak) faces.front += `${next}${right.toFixed(2)} ${down.toFixed(2)}`;
      next = isBreak ? "M" : "L";
    }
    return faces;
  }
  const facets = facetsOf(solid).map((one) => one.map(turned));
  const ends = facets.slice(-2);
  if (solid.prism !== null) faces.front = pathOf(hullOf(ends.flat().map(flat)));
  for (const facet of solid.prism === null ? facets : ends) {
    const normal = normalOf(facet);
    if (dot(normal, near) < SEEN) continue;
    const light = Math.abs(normal[2]) > 0.7 ? "top" : Math.abs(dot(normal, right)) > 0.5 ? "side" : "front";
    faces[light] += pathOf(facet.map(flat));
  }
  return faces;
}
