import type { Studio } from "../../lib/state/studio.svelte";
import type { Requests } from "../../lib/protocol/types";

export type WorkState = NonNullable<Requests["work"]["answer"]>;

/** While something runs it is asked for so often. [ms] */
const PERIOD_MS = 300;

/** What another viewer has followed up with something else runs no more. */
const ended = (state: WorkState | null): WorkState | null => state && { ...state, is_running: false };

/** The last search and the last checks, of any viewer; one at a time. */
export class Work {
  scan = $state.raw<WorkState | null>(null);
  checks = $state.raw<WorkState | null>(null);
  private timer: ReturnType<typeof setTimeout> | undefined;
  private isClosed = false;

  constructor(private readonly studio: Studio) {}

  get isRunning(): boolean {
    return (this.scan?.is_running ?? false) || (this.checks?.is_running ?? false);
  }

  async read(): Promise<void> {
    clearTimeout(this.timer);
    try {
      const found = await this.studio.ask("work", {});
      this.scan = found?.work === "scan" ? found : ended(this.scan);
      this.checks = found?.work === "verify" ? found : ended(this.checks);
    } catch (error) {
      this.studio.report(error);
      return;
    }
    if (this.isRunning && !this.isClosed) this.timer = setTimeout(() => void this.read(), PERIOD_MS);
  }

  async begin(begun: Promise<unknown>): Promise<void> {
    try {
      await begun;
    } catch (error) {
      this.studio.report(error);
      return;
    }
    await this.read();
  }

  close(): void {
    this.isClosed = true;
    clearTimeout(this.timer);
  }
}
