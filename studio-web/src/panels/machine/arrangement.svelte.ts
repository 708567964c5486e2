/** Upper left corners by name, in pixels from that of the panel. */
export type Places = Readonly<Record<string, readonly [number, number]>>;

/** Places are multiples of it. [px] */
export const GRID = 10;
const MOST_PX = 20_000;
const MOST_UNDONE = 100;

const onGrid = (px: number) => Math.min(MOST_PX, Math.max(0, Math.round(px / GRID) * GRID));

/** Where things are drawn. Empty: they are arranged by themselves. */
export class Arrangement {
  places = $state.raw<Places>({});
  /** Whether it differs from what is kept in the description. */
  isChanged = $state(false);
  private before = $state.raw<readonly Places[]>([]);

  get isByHand(): boolean {
    return Object.keys(this.places).length > 0;
  }

  get canUndo(): boolean {
    return this.before.length > 0;
  }

  /** What the description has; not in the place of changes that are not saved. */
  take(places: Readonly<Record<string, readonly number[]>>): void {
    if (this.isChanged) return;
    this.places = Object.fromEntries(Object.entries(places).map(([name, [x = 0, y = 0]]) => [name, [x, y]]));
  }

  /** What is drawn stays where it is, for what has no place yet. */
  fix(measured: Places): void {
    const rounded = Object.entries(measured).map(([name, [x, y]]) => [name, [onGrid(x), onGrid(y)]] as const);
    this.places = { ...Object.fromEntries(rounded), ...this.places };
  }

  /** Before a move: undo comes back to here. */
  remember(): void {
    this.before = [...this.before, this.places].slice(-MOST_UNDONE);
  }

  put(name: string, x: number, y: number): void {
    this.places = { ...this.places, [name]: [onGrid(x), onGrid(y)] };
    this.isChanged = true;
  }

  shift(name: string, dx: number, dy: number): void {
    const [x, y] = this.places[name] ?? [0, 0];
    this.put(name, x + dx, y + dy);
  }

  undo(): void {
    const last = this.before.at(-1);
    if (last === undefined) return;
    this.before = this.before.slice(0, -1);
    this.places = last;
    this.isChanged = true;
  }

  /** By itself again. */
  clear(): void {
    this.remember();
    this.places = {};
    this.isChanged = true;
  }

  saved(): void {
    this.isChanged = false;
  }
}

/** Of this page: it outlives the panel. */
export const arrangement = new Arrangement();
