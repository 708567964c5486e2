// `steptwin dap` with the debug client of VS Code's own tests, and what the extension makes of its answers.
// STEPTWIN is the command, FOLDER the folder of a running twin called "two" and of its program m.prg.

import assert from "node:assert/strict";
import { join } from "node:path";
import { afterEach, beforeEach, test } from "node:test";
import { DebugClient } from "@vscode/debugadapter-testsupport";
import { load } from "./load.mjs";

const { STEPTWIN, FOLDER } = process.env;
const program = join(FOLDER, "m.prg");
const { readGroups } = await load("src/groups.ts");

let client;

beforeEach(async () => {
  client = new DebugClient(STEPTWIN, "dap", "steptwin");
  client.defaultTimeout = 100_000;
  await client.start();
});

afterEach(() => client.stop());

const request = async (command, args) => (await client.customRequest(command, args)).body;

/** Sends a request that has the program go on, and expects it to stop there. */
const goes = (name, reason, line) =>
  Promise.all([
    client[`${name}Request`]({ threadId: 1 }),
    client.assertStoppedLocation(reason, { path: program, line }),
  ]);

test("a program: breakpoint, steps forwards and backwards, values", async () => {
  await client.hitBreakpoint({ program }, { path: program, line: 8 });
  await goes("next", "step", 9);
  await goes("stepBack", "breakpoint", 8);
  await goes("stepBack", "step", 4);
  await goes("reverseContinue", "pause", 1);
  await goes("continue", "breakpoint", 8);
  await goes("stepOut", "step", 5);
  assert.equal((await request("evaluate", { expression: "n + 1", frameId: 1000 })).result, "2");
});

test("a stop on entry, and the end of the session", async () => {
  await Promise.all([
    client.launch({ program, stopOnEntry: true }),
    client.configurationSequence(),
    client.assertStoppedLocation("entry", { path: program, line: 1 }),
  ]);
  await Promise.all([client.waitForEvent("terminated"), client.terminateRequest({})]);
});

test("a twin that runs", async () => {
  await Promise.all([
    client.initializeRequest().then(() => client.attachRequest({ twin: "two" })),
    client
      .waitForEvent("initialized")
      .then(() => client.setBreakpointsRequest({ source: { path: program }, breakpoints: [{ line: 8 }] }))
      .then(({ body }) => assert.ok(body.breakpoints[0].verified))
      .then(() => client.configurationDoneRequest()),
    client.assertStoppedLocation("breakpoint", { path: program, line: 8 }),
  ]);
  await goes("next", "step", 9);
  await goes("stepBack", "breakpoint", 8);
  await goes("continue", "breakpoint", 8);
});

test("the groups of the view of axes and pins", async () => {
  const stopped = client.assertStoppedLocation("breakpoint", { path: program, line: 9 });
  await Promise.all([client.hitBreakpoint({ world: join(FOLDER, "two.toml") }, { path: program, line: 9 }), stopped]);
  const groups = await readGroups(request);
  const names = groups.map(({ machine, name }) => `${machine} ${name}`);
  assert.deepEqual(names, ["m Axes", "m Pins", "c Axes", "c Pins"]);
  const value = (name) => groups[1].values.find((one) => one.name === name);
  assert.equal(value("OUT1").text, "1");
  assert.equal(groups[0].values.find((one) => one.name === "M1.position").settable, false);
  const pin = value("IN5");
  assert.deepEqual([pin.text, pin.settable], ["0", true]);
  await request("setVariable", { variablesReference: pin.reference, name: "IN5", value: "1" });
  assert.equal((await readGroups(request))[1].values.find((one) => one.name === "IN5").text, "1");
});
