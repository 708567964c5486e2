import type { Sentence } from "../protocol/types";
import type { Studio } from "./studio.svelte";

/** Of a kind of faults. */
export interface FaultParameter {
  name: string;
  meaning: string;
  permitted: string;
  messages?: { permitted?: Sentence };
  default: string;
  words: string[];
  required: boolean;
}
/** A kind of faults that can be set. */
export interface FaultKind {
  name: string;
  layer: "bytes" | "frames" | "protocol" | "physics" | "element";
  occasion: string;
  meaning: string;
  lines: string[];
  /** Kinds of elements that it can happen to. */
  elements: string[];
  parameters: FaultParameter[];
}

/** A fault that is set: its name, and its text such as `stuck pin=IN3 value=1`. */
export interface ActiveFault {
  name: string;
  fault: string;
  seen: number;
  acted: number;
}

const READ_MS = 1000;

/** The faults that are set, read once a second for as long as a panel shows them. */
export class ActiveFaults {
  list = $state.raw<readonly ActiveFault[]>([]);

  constructor(private readonly studio: Studio) {}

  /** Gives what ends it. */
  subscribe(): () => void {
    if (!this.studio.may("faults")) return () => undefined;
    void this.read();
    const timer = setInterval(() => void this.read(), READ_MS);
    return () => clearInterval(timer);
  }

  async read(): Promise<void> {
    try {
      this.list = (await this.studio.ask("faults", {})) as ActiveFault[];
    } catch {
      // The connection says what is wrong with it.
    }
  }
}

/** What a fault was given: `stuck pin=IN3 value=1` is kind stuck with pin and value. */
export function readFault(text: string): { kind: string; given: Readonly<Record<string, string>> } {
  const [kind = "", ...rest] = text.split(" ");
  return { kind, given: Object.fromEntries(rest.map((part) => part.split("=", 2) as [string, string])) };
}
