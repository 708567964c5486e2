/** Position and velocity from a plan, as docs/control.md has the formulas. */

export interface Plan {
  start_ns: string;
  base: number;
  final: number;
  segments: readonly unknown[];
}

/** Pulses and pulses/s. */
export interface Motion {
  position: number;
  velocity: number;
}

/** [end, anchor, c0, c1, c2, c3, direction]; the end in seconds after the start, null where there is none. */
type Polynomial = readonly [number | null, number, number, number, number, number, number];

interface Arc {
  end_s: number | null;
  way: Polynomial;
  /** Centre and radius in pulses, angle and turn in quarter turns. */
  course: readonly [number, number, number, number];
  direction: number;
}

type Segment = Polynomial | Arc;

const QUARTER = Math.PI / 2;
const isArc = (segment: Segment): segment is Arc => !Array.isArray(segment);
/** Numbers that are whole but for their rounding count as whole. */
const ROUNDING = 1e-6;
const whole = (segment: Segment, position: number): number => {
  const isForward = (isArc(segment) ? segment.direction : segment[6]) > 0;
  return isForward ? Math.floor(position + ROUNDING) : Math.ceil(position - ROUNDING);
};
const endOf = (segment: Segment): number | null => (isArc(segment) ? segment.end_s : segment[0]);

/** Numbers are read one by one: a pattern would make a list of them for each picture. */
function along(its: Polynomial, t: number): Motion {
  const u = t - its[1];
  return {
    position: its[2] + u * (its[3] + u * (its[4] + u * its[5])),
    velocity: its[3] + u * (2 * its[4] + u * 3 * its[5]),
  };
}

function onArc({ way, course: [centre, radius, angle, turn] }: Arc, t: number): Motion {
  const w = along(way, t);
  const phi = (angle + turn * w.position) * QUARTER;
  return {
    position: centre + radius * Math.cos(phi),
    velocity: -radius * Math.sin(phi) * turn * QUARTER * w.velocity,
  };
}

/** A plan made ready to be asked very often. */
export class Trajectory {
  readonly start_ns: bigint;
  /** Ends of its segments, in seconds after the start. */
  get corners_s(): readonly number[] {
    return [0, ...this.segments.map(endOf).filter((end) => end !== null)];
  }
  /** When it stands again; null where it never does. */
  readonly end_ns: bigint | null;
  private readonly segments: readonly Segment[];

  // Thousands are kept: nothing else of the plan is.
  private readonly base: number;
  private readonly final: number;

  constructor(plan: Plan) {
    this.start_ns = BigInt(plan.start_ns);
    this.base = plan.base;
    this.final = plan.final;
    this.segments = plan.segments as readonly Segment[];
    const last = this.segments.at(-1);
    const end = last === undefined ? 0 : endOf(last);
    this.end_ns = end === null ? null : this.start_ns + BigInt(Math.ceil(end * 1e9));
  }

  at(now_ns: bigint): Motion {
    return this.atSeconds(Number(now_ns - this.start_ns) / 1e9);
  }

  /** `t` in seconds after the start; before it, as at the start. */
  atSeconds(t: number): Motion {
    const { base, final } = this;
    const from = Math.max(t, 0);
    for (const segment of this.segments) {
      const end = endOf(segment);
      if (end !== null && from >= end) continue;
      const motion = isArc(segment) ? onArc(segment, from) : along(segment, from);
      return { position: base + motion.position, velocity: motion.velocity };
    }
    return { position: base + final, velocity: 0 };
  }

  /** Pulses given until then, as the controller counts them: the last whole one that has been reached. */
  counted(now_ns: bigint): number {
    const t = Math.max(Number(now_ns - this.start_ns) / 1e9, 0);
    const index = this.segments.findIndex((segment) => (endOf(segment) ?? Infinity) > t);
    if (index >= 0) return this.base + whole(this.segments[index] as Segment, this.atSeconds(t).position - this.base);
    const last = this.segments.at(-1);
    return this.base + (last === undefined ? Math.round(this.final) : whole(last, this.final));
  }

  isMoving(now_ns: bigint): boolean {
    return this.segments.length > 0 && (this.end_ns === null || now_ns < this.end_ns);
  }
}
