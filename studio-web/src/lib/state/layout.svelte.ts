import { keep, restore } from "./kept";

export interface Pane {
  panel: string;
  /** Of the height of its column; shares of a column need not sum up to anything. */
  share: number;
}

export interface Column {
  share: number;
  panes: Pane[];
}

export const MOST_PANES = 4;
const VERSION = 1;
const LEAST_SHARE = 0.15;

function isColumns(value: unknown): value is Column[] {
  const isShare = (share: unknown) => typeof share === "number" && share > 0;
  return (
    Array.isArray(value) &&
    value.length > 0 &&
    value.every(
      (column) =>
        isShare(column?.share) &&
        Array.isArray(column.panes) &&
        column.panes.length > 0 &&
        column.panes.every((pane: Partial<Pane>) => isShare(pane?.share) && typeof pane.panel === "string"),
    )
  );
}

/** Which panels are shown and how large: one to four panes in columns. It is remembered. */
export class Layout {
  columns = $state<Column[]>([]);
  /** The pane that the next chosen panel goes to: column and place in it. */
  active = $state<[number, number]>([0, 0]);

  /** Whether anybody has chosen it, now or at an earlier time. */
  private isChosen: boolean;

  constructor(first: Column[]) {
    const kept = restore("layout", VERSION, isColumns);
    this.isChosen = kept !== null;
    this.columns = kept ?? first;
  }

  /** What is shown first, where nobody has chosen anything. */
  begin(columns: Column[]): void {
    if (!this.isChosen) this.columns = columns;
  }

  get count(): number {
    return this.columns.reduce((sum, { panes }) => sum + panes.length, 0);
  }

  get isFull(): boolean {
    return this.count >= MOST_PANES;
  }

  shows(panel: string): boolean {
    return this.columns.some(({ panes }) => panes.some((pane) => pane.panel === panel));
  }

  /** The pane with the panel becomes the active one; where there is none, the panel goes into the active one. */
  show(panel: string): void {
    for (const [column, { panes }] of this.columns.entries()) {
      const place = panes.findIndex((pane) => pane.panel === panel);
      if (place >= 0) {
        this.active = [column, place];
        return;
      }
    }
    const pane = this.columns[this.active[0]]?.panes[this.active[1]] ?? this.columns[0]?.panes[0];
    if (pane !== undefined) pane.panel = panel;
    this.keep();
  }

  openBeside(column: number, panel: string): void {
    if (this.isFull) return;
    this.columns.splice(column + 1, 0, { share: 1, panes: [{ panel, share: 1 }] });
    this.active = [column + 1, 0];
    this.keep();
  }

  openBelow(column: number, place: number, panel: string): void {
    const panes = this.columns[column]?.panes;
    if (this.isFull || panes === undefined) return;
    panes.splice(place + 1, 0, { panel, share: 1 });
    this.active = [column, place + 1];
    this.keep();
  }

  close(column: number, place: number): void {
    if (this.count === 1) return;
    this.columns[column]?.panes.splice(place, 1);
    if (this.columns[column]?.panes.length === 0) this.columns.splice(column, 1);
    this.active = [0, 0];
    this.keep();
  }

  choose(column: number, place: number, panel: string): void {
    const pane = this.columns[column]?.panes[place];
    if (pane !== undefined) pane.panel = panel;
    this.keep();
  }

  /** The border after the part `index` moves by a fraction of what both parts next to it have. */
  resize(parts: { share: number }[], index: number, fraction: number): void {
    const [before, after] = [parts[index], parts[index + 1]];
    if (before === undefined || after === undefined) return;
    const sum = before.share + after.share;
    const share = Math.min(1 - LEAST_SHARE, Math.max(LEAST_SHARE, before.share / sum + fraction));
    before.share = share * sum;
    after.share = sum - before.share;
    this.keep();
  }

  private keep(): void {
    this.isChosen = true;
    keep("layout", VERSION, this.columns);
  }
}
