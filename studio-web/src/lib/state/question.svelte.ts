import { saidOf } from "../protocol/connection";
import type { Sentence } from "../protocol/types";
import type { Said } from "../../text";
import type { Ask } from "./watch.svelte";

interface Link {
  time_ns: string;
  subject: string;
  text: string;
  messages?: { text?: Sentence };
}

/** What is asked beside the chain: all of it, or also the run without each of its roots. */
type More = { all?: true; try_without?: true };

/** As `why` answers (docs/why.md). */
export interface Answer {
  question: string;
  at_ns: string;
  state: string;
  messages?: { state?: Sentence };
  since_ns: string | null;
  links: readonly Link[];
  complete: boolean;
  known_from_ns: string;
  cut: boolean;
  /** The run again without each root: a link with what would be then. */
  trials: readonly (Link & {
    effect: "otherwise" | "other time" | "same" | "unknown";
    without: string;
    messages?: { without?: Sentence };
  })[];
}

const ANSWER_MS = 60_000;

/** The question that is asked on this page, from whatever panel: a signal, a condition, or a controller whose program waits. */
export class Question {
  asked = $state.raw<string | null>(null);
  /** That of an earlier question until the next answer. */
  answer = $state.raw<Answer | null>(null);
  problem = $state.raw<Said | null>(null);
  isAsking = $state(false);
  private number = 0;

  /** `moment`: the one that is looked at; null: the present. */
  constructor(
    private readonly request: Ask,
    private readonly moment: () => bigint | null,
  ) {}

  /** Without a moment it is asked about the one that the page shows. */
  async ask(question: string, at = this.moment(), more: More = {}): Promise<void> {
    const number = ++this.number;
    this.asked = question;
    this.isAsking = true;
    try {
      const fields = { question, ...(at === null ? {} : { at_ns: String(at) }), ...more };
      const answer = (await this.request("why", fields, ANSWER_MS)) as Answer;
      if (number !== this.number) return;
      this.answer = answer;
      this.problem = null;
    } catch (error) {
      if (number !== this.number) return;
      this.answer = null;
      this.problem = saidOf(error);
    }
    this.isAsking = false;
  }

  /** The same question, of the moment that was answered. */
  askMore(more: More): void {
    if (this.answer !== null) void this.ask(this.answer.question, BigInt(this.answer.at_ns), more);
  }

  close(): void {
    this.number++;
    this.asked = this.answer = this.problem = null;
    this.isAsking = false;
  }
}
