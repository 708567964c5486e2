/** Hands over what has come in batches: the next one only when the last has been taken.
 *
 * A page that is slow thus gets fewer, larger batches. Beyond `bound` messages the oldest are dropped; the gap in their
 * numbers makes the page ask for the whole state again.
 */
export class Batches<T> {
  private waiting: T[] = [];
  private isTaken = true;

  constructor(
    private readonly hand: (batch: T[]) => void,
    private readonly bound: number,
  ) {}

  add(message: T): void {
    this.waiting.push(message);
    if (this.waiting.length > this.bound) this.waiting.splice(0, this.waiting.length - this.bound);
    this.flush();
  }

  taken(): void {
    this.isTaken = true;
    this.flush();
  }

  private flush(): void {
    if (!this.isTaken || this.waiting.length === 0) return;
    this.isTaken = false;
    const batch = this.waiting;
    this.waiting = [];
    this.hand(batch);
  }
}
