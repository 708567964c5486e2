import type { Requests } from "../protocol/types";
import type { Ask } from "./watch.svelte";

export type PastEvents = Requests["past_events"]["answer"];

const KINDS = ["plan", "coordinate", "edge", "status", "note", "report", "button", "input", "fault"] as const;
/** Asked for at once. [ns of virtual time] */
const PART_NS = 20_000_000_000n;
const ANSWER_MS = 60_000;

/** What happened before the page was opened: asked for in parts, backwards, as far as somebody wants to see it. */
export class EarlierEvents {
  /** All from here on is known; null where nothing earlier can be had. */
  private known_ns = $state.raw<bigint | null>(null);
  private isAsking = false;
  private waiting: (() => void)[] = [];

  /** `put` is given each part, the later ones first: it replaces what is known of its time. */
  constructor(
    private readonly ask: Ask,
    private readonly put: (part: PastEvents) => void,
  ) {}

  /** The page knows what happens from now on. */
  begin(now_ns: bigint): void {
    this.known_ns = now_ns;
  }

  /** Whether there is more to ask for. */
  get isOver(): boolean {
    return this.known_ns === null || this.known_ns === 0n;
  }

  /** The part before what is known. */
  more(): Promise<void> {
    return new Promise((came) => {
      if (this.isOver) came();
      else this.waiting.push(came);
      if (this.known_ns !== null && !this.isOver && !this.isAsking) void this.read(this.known_ns);
    });
  }

  /** `came` is called when more is known. */
  want(from_ns: bigint, came: () => void): void {
    if (this.known_ns === null || from_ns >= this.known_ns || this.known_ns === 0n || this.isAsking) return;
    this.waiting.push(came);
    void this.read(this.known_ns);
  }

  private async read(until_ns: bigint): Promise<void> {
    this.isAsking = true;
    const from_ns = until_ns > PART_NS ? until_ns - PART_NS : 0n;
    try {
      const moments = { from_ns: String(from_ns), to_ns: String(until_ns) };
      const part = await this.ask("past_events", { ...moments, kinds: [...KINDS] }, ANSWER_MS);
      if (this.known_ns === until_ns) {
        this.put(part);
        const known = BigInt(part.from_ns);
        this.known_ns = known < until_ns ? known : null;
      }
    } catch {
      if (this.known_ns === until_ns) this.known_ns = null; // until the whole state has come again
    }
    this.isAsking = false;
    for (const came of this.waiting.splice(0)) came();
  }
}
