// The axes and pins of all controllers of a debug session, from requests of the Debug Adapter Protocol.

import type { DebugProtocol } from "@vscode/debugprotocol";

/** A request of the protocol: the body of its response. */
export type Request = (command: string, args: object) => Thenable<any>;

export interface Value {
  readonly name: string;
  readonly text: string;
  readonly settable: boolean;
  /** Of the group, for setVariable. */
  readonly reference: number;
}

export interface Group {
  readonly controller: string;
  readonly name: string;
  readonly values: readonly Value[];
}

const SHOWN = ["Axes", "Pins"];

export async function readGroups(request: Request): Promise<Group[]> {
  const { threads } = (await request("threads", {})) as DebugProtocol.ThreadsResponse["body"];
  const found = await Promise.all(threads.map((thread) => readThread(request, thread)));
  return found.flat();
}

async function readThread(request: Request, thread: DebugProtocol.Thread): Promise<Group[]> {
  const stack = (await request("stackTrace", {
    threadId: thread.id,
    levels: 1,
  })) as DebugProtocol.StackTraceResponse["body"];
  const frame = stack.stackFrames[0];
  if (frame === undefined) return [];
  const { scopes } = (await request("scopes", { frameId: frame.id })) as DebugProtocol.ScopesResponse["body"];
  const shown = scopes.filter((scope) => SHOWN.includes(scope.name));
  return Promise.all(shown.map((scope) => readScope(request, thread.name, scope)));
}

async function readScope(request: Request, controller: string, scope: DebugProtocol.Scope): Promise<Group> {
  const reference = scope.variablesReference;
  const { variables } = (await request("variables", {
    variablesReference: reference,
  })) as DebugProtocol.VariablesResponse["body"];
  const values = variables.map((one) => ({
    name: one.name,
    text: one.value,
    settable: !one.presentationHint?.attributes?.includes("readOnly"),
    reference,
  }));
  return { controller, name: scope.name, values };
}
