/**
 * Phase currents of a two-phase stepper motor over its electrical angle, in % of their greatest value: the shapes that
 * `steptwin.motion.waveforms` defines, by the argument of the command N. Four full steps are one period.
 */
export const PERIOD = 256;

type Shape = (quarter: number, sine: number) => number;

/** Of the first quarter: the fraction of a quarter gone, and its sine. */
const SHAPES: readonly Shape[] = [
  (_, sine) => sine,
  (quarter) => Math.min(2 * quarter, 1),
  (_, sine) => sine ** 1.2,
  (_, sine) => sine ** 1.5,
  (quarter) => quarter,
  (_, sine) => sine ** 0.8,
  (_, sine) => sine ** 0.6,
];

/** Of phase 1 or 2 at `theta` (minimum microsteps from power-on); NaN for a characteristic that does not exist. */
export function phaseCurrent(characteristic: number, phase: 1 | 2, theta: number): number {
  const shape = SHAPES[characteristic - 1];
  if (shape === undefined) return NaN;
  const angle = theta - (phase === 2 ? PERIOD / 4 : 0);
  const turned = (((angle % PERIOD) + PERIOD) % PERIOD) / (PERIOD / 4);
  const half = turned % 2;
  const quarter = half > 1 ? 2 - half : half;
  const size = 100 * shape(quarter, Math.sin((quarter * Math.PI) / 2));
  return turned < 2 ? size : -size;
}
