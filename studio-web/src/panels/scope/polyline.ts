import type { Columns } from "./columns";

/** What a line may leave out: nobody sees it. [pixels] */
const TOLERANCE = 0.2;

interface Pen {
  moveTo(x: number, y: number): void;
  lineTo(x: number, y: number): void;
}

/**
 * Draws columns as a line with as few corners as it needs: a corner costs far more to draw than to leave out. Each column is one pixel wide,
 * the first begins at `left`. A point is left out where the line between its neighbours passes it closer than the tolerance, measured upright.
 */
export function trace(columns: Columns, left: number, y: (value: number) => number, pen: Pen): void {
  const line = new Line(pen);
  for (let column = 0; column < columns.width; column++) {
    const first = columns.first[column] as number;
    if (Number.isNaN(first)) {
      line.end();
      continue;
    }
    const [low, high, last] = [columns.low, columns.high, columns.last].map((values) => values[column]) as [
      number,
      number,
      number,
    ];
    const x = left + column;
    line.to(x, y(first));
    if (low < Math.min(first, last)) line.to(x + 0.5, y(low));
    if (high > Math.max(first, last)) line.to(x + 0.5, y(high));
    if (last !== first) line.to(x + 1, y(last));
  }
  line.end();
}

/** Keeps the point that was drawn last, the newest one, and the slopes with which all between them are close enough. */
class Line {
  private isDown = false;
  private isPending = false;
  private from: readonly [number, number] = [0, 0];
  private newest: readonly [number, number] = [0, 0];
  private least = -Infinity;
  private most = Infinity;

  constructor(private readonly pen: Pen) {}

  to(x: number, y: number): void {
    if (!this.isDown) {
      this.pen.moveTo(x, y);
      this.isDown = true;
      this.start(x, y);
      return;
    }
    if (this.isPending && !this.fits(x, y)) {
      this.pen.lineTo(...this.newest);
      this.start(...this.newest);
    }
    this.take(x, y);
  }

  end(): void {
    if (this.isPending) this.pen.lineTo(...this.newest);
    this.isDown = this.isPending = false;
  }

  private start(x: number, y: number): void {
    this.from = [x, y];
    [this.least, this.most] = [-Infinity, Infinity];
    this.isPending = false;
  }

  /** Whether a line to this point passes all that were left out closely enough. Upright lines are always corners. */
  private fits(x: number, y: number): boolean {
    const along = x - this.from[0];
    if (!(along > 0) || !(this.newest[0] > this.from[0])) return false;
    const slope = (y - this.from[1]) / along;
    return slope >= this.least && slope <= this.most;
  }

  private take(x: number, y: number): void {
    const along = x - this.from[0];
    if (along > 0) {
      this.least = Math.max(this.least, (y - TOLERANCE - this.from[1]) / along);
      this.most = Math.min(this.most, (y + TOLERANCE - this.from[1]) / along);
    }
    this.newest = [x, y];
    this.isPending = true;
  }
}
