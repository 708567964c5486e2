import type { Fields, RequestName } from "../protocol/connection";
import type { Requests } from "../protocol/types";

type Ask = <N extends RequestName>(name: N, fields: Fields<N>, within_ms?: number) => Promise<Requests[N]["answer"]>;

/** One third of what a lease lasts, unless its answer says otherwise. */
const RENEW_MS = 80;

/** A jog that goes on for as long as it is held: `begin`, then `end`.
 *
 * The lease is renewed from the page itself, not from a worker: a page that hangs renews nothing, and the axis stops.
 */
export class DeadManJog {
  private lease: number | null = null;
  private isHeld = true;
  private timer: ReturnType<typeof setInterval> | undefined;

  private constructor(
    private readonly ask: Ask,
    private readonly failed: (error: unknown) => void,
  ) {}

  static begin(ask: Ask, fields: Fields<"jog">, failed: (error: unknown) => void): DeadManJog {
    const jog = new DeadManJog(ask, failed);
    ask("jog", fields).then(
      ({ lease, lasts_ms }) => jog.leased(lease, lasts_ms),
      (error: unknown) => {
        jog.isHeld = false;
        failed(error);
      },
    );
    return jog;
  }

  end(): void {
    if (!this.isHeld) return;
    this.isHeld = false;
    clearInterval(this.timer);
    if (this.lease !== null) this.letGo(this.lease);
  }

  private leased(lease: number, lasts_ms: number): void {
    this.lease = lease;
    if (!this.isHeld) {
      this.letGo(lease);
      return;
    }
    this.timer = setInterval(() => this.renew(lease), Math.min(RENEW_MS, lasts_ms / 3));
  }

  private renew(lease: number): void {
    this.ask("renew", { lease }).catch((error: unknown) => {
      if (!this.isHeld) return;
      this.isHeld = false;
      clearInterval(this.timer);
      this.failed(error);
    });
  }

  private letGo(lease: number): void {
    this.ask("let_go", { lease }).catch(this.failed);
  }
}
