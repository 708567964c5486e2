import type { Connection, Model } from "../../lib/state/model";

/** One end of a connection, as the card of the other end shows it. */
export interface End {
  /** `x.switch1`, `cup.held`, `stop`. */
  name: string;
  inverted: boolean;
  delay_ns: number;
}

export interface ConnectedTerminal {
  /** With its owner: `table.IN1`. */
  terminal: string;
  /** Without: `IN1`. */
  short: string;
  ends: readonly End[];
  /** `parallel` or `series` where several contacts share an input. */
  join: string | null;
}

/** A controller or an element with the terminals that are connected to something. */
export interface Node {
  name: string;
  kind: string;
  inputs: readonly ConnectedTerminal[];
  outputs: readonly ConnectedTerminal[];
}

const byNumber = new Intl.Collator("en", { numeric: true });
const ownerOf = (terminal: string) => terminal.slice(0, terminal.indexOf("."));
const shortOf = (terminal: string) => terminal.slice(terminal.indexOf(".") + 1);

function connected(connections: readonly Connection[], side: "source" | "target"): ConnectedTerminal[] {
  const other = side === "source" ? "target" : "source";
  const found = new Map<string, { ends: End[]; join: string | null }>();
  for (const one of connections) {
    const terminal = one[side];
    const at = found.get(terminal) ?? { ends: [], join: side === "target" ? one.join : null };
    at.ends.push({ name: one[other], inverted: one.inverted, delay_ns: one.delay_ns });
    found.set(terminal, at);
  }
  return [...found]
    .map(([terminal, at]) => ({ terminal, short: shortOf(terminal), ...at }))
    .sort((a, b) => byNumber.compare(a.short, b.short));
}

/** Controllers first, then elements, each with its inputs and outputs: IN2 before IN10. */
export function nodesOf({ controllers, elements, connections }: Model): Node[] {
  const owners = [
    ...controllers.map(({ name, sheet }) => ({ name, kind: sheet.title })),
    ...elements.map(({ name, kind }) => ({ name, kind })),
  ];
  return owners
    .map(({ name, kind }) => ({
      name,
      kind,
      inputs: connected(
        connections.filter(({ target }) => ownerOf(target) === name),
        "target",
      ),
      outputs: connected(
        connections.filter(({ source }) => ownerOf(source) === name && shortOf(source) !== ""),
        "source",
      ),
    }))
    .filter(({ inputs, outputs }) => inputs.length + outputs.length > 0);
}

/** What drives an input, or what an output drives. */
export function endsOf(connections: readonly Connection[], pin: string): string[] {
  return connections.flatMap(({ source, target }) => (target === pin ? [source] : source === pin ? [target] : []));
}
