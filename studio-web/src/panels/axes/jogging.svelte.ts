import { DeadManJog } from "../../lib/state/jog";
import { keep, restore } from "../../lib/state/kept";
import type { AxisModel } from "../../lib/state/model";
import type { Studio } from "../../lib/state/studio.svelte";
import type { Watch } from "../../lib/state/watch.svelte";

const VERSION = 1;
const FIRST_PERCENT = 25;
/** Where no point has the greatest velocity of an axis. [pulses/s] */
const USUAL_PULSES = 64_000;

const isPercent = (value: unknown): value is number => typeof value === "number" && value >= 1 && value <= 100;
const isTexts = (value: unknown): value is Record<string, string> =>
  typeof value === "object" && value !== null && Object.values(value).every((text) => typeof text === "string");

/** Jogs of the page: one for each axis at most, all at the chosen speed. */
export class Jogging {
  percent = $state(restore("jog.percent", VERSION, isPercent) ?? FIRST_PERCENT);
  /** Full velocities that were typed, by axis. */
  full = $state<Record<string, string>>(restore("jog.full", VERSION, isTexts) ?? {});
  private readonly held = new Map<string, DeadManJog>();
  /** Greatest velocities, by axis, as they were before a jog. */
  private readonly greatest = new Map<string, number>();

  constructor(
    private readonly studio: Studio,
    private readonly watch: () => Watch | null,
  ) {}

  choosePercent(percent: number): void {
    this.percent = percent;
    keep("jog.percent", VERSION, percent);
  }

  chooseFull(axis: AxisModel, text: string): void {
    this.full[axis.id] = text;
    keep("jog.full", VERSION, this.full);
  }

  /** Velocity at 100 %: what was typed, else the greatest of the axis. [units/s] */
  fullOf(axis: AxisModel): number {
    const typed = Number(this.full[axis.id]);
    if (typed > 0) return typed;
    const usual = this.greatestOf(axis) ?? USUAL_PULSES / (axis.pulses_per_unit ?? 1);
    return Math.min(usual, axis.velocities?.high ?? Infinity);
  }

  /** A jog of anybody sets the register of the greatest velocity to its own, until the axis stands again. */
  private greatestOf(axis: AxisModel): number | null {
    const found = this.watch()?.get(axis.fastest) ?? null;
    const isJogged = this.studio.leases.some(
      (lease) => lease.controller === axis.controller && lease.axis === axis.number,
    );
    const before = this.greatest.get(axis.id) ?? null;
    if (before !== null && (isJogged || this.studio.axis(axis).isMoving(this.studio.now()) === true)) return before;
    if (found !== null) this.greatest.set(axis.id, found);
    return found;
  }

  /** `isOver` is called when the jog is refused, or ends otherwise than by `end`. */
  begin(axis: AxisModel, sign: number, isOver: () => void, percent = this.percent): void {
    this.end(axis);
    const velocity = (sign * this.fullOf(axis) * percent) / 100;
    const fields = { controller: axis.controller, axis: axis.number, velocity };
    const jog: DeadManJog = DeadManJog.begin(
      (name, given, within) => this.studio.ask(name, given, within),
      fields,
      (error) => {
        isOver();
        this.failed(axis, jog, error);
      },
    );
    this.held.set(axis.id, jog);
  }

  end(axis: AxisModel): void {
    this.held.get(axis.id)?.end();
    this.held.delete(axis.id);
  }

  endAll(): void {
    for (const jog of this.held.values()) jog.end();
    this.held.clear();
  }

  /** An answer may come late: the axis may have another jog by now, which has to be ended when it is let go. */
  private failed(axis: AxisModel, jog: DeadManJog, error: unknown): void {
    if (this.held.get(axis.id) === jog) this.held.delete(axis.id);
    this.studio.report(error);
  }
}
