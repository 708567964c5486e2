// `steptwin dap` with the debug client of VS Code's own tests, and what the extension makes of its answers.
// STEPTWIN is the command, FOLDER the folder of a running twin called "two" and of its program m.prg.

import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
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
  const names = groups.map(({ controller, name }) => `${controller} ${name}`);
  assert.deepEqual(names, ["m Axes", "m Pins", "c Axes", "c Pins"]);
  const value = (name) => groups[1].values.find((one) => one.name === name);
  assert.equal(value("OUT1").text, "1");
  assert.equal(groups[0].values.find((one) => one.name === "M1.position").settable, false);
  const pin = value("IN5");
  assert.deepEqual([pin.text, pin.settable], ["0", true]);
  await request("setVariable", { variablesReference: pin.reference, name: "IN5", value: "1" });
  assert.equal((await readGroups(request))[1].values.find((one) => one.name === "IN5").text, "1");
});

const WBC = "n = 0\nMAIN:\n    n = n + 1\n    JUMP COUNT\nJUMP MAIN\nCOUNT:\n    OUT1 = ON\nRETURN\n";
const CHIP = "[\n@1\n+1\n'2\nJ1\n@2\n+2\n.\n]\n";
const PROGRAMS = [
  ["good.prg", WBC, true],
  ["broken.prg", "n = = 0\nJUP MAIN\n\u0000", false],
  ["half.prg", WBC.slice(0, WBC.indexOf("COUNT:") - 4), false],
  ["empty.prg", "", true],
  ["good.m1486", CHIP, true],
  ["broken.m1486", "[\nQQ\nJ99\n", false],
  ["half.m1486", CHIP.slice(0, CHIP.length / 2), false],
];
/** Every request that the adapter knows, apart from those that begin and end a session. */
const REQUESTS = (path) => [
  ["setBreakpoints", { source: { path }, breakpoints: [{ line: 3 }, { line: 2, condition: "n >" }, { line: 999 }] }],
  ["setBreakpoints", { source: { path }, breakpoints: [] }],
  ["setFunctionBreakpoints", { breakpoints: [{ name: "COUNT" }, { name: "@2" }, { name: "" }] }],
  ["setFunctionBreakpoints", { breakpoints: [] }],
  ["dataBreakpointInfo", { name: "n", variablesReference: 1001 }],
  ["setDataBreakpoints", { breakpoints: [{ dataId: "nothing" }] }],
  ["setDataBreakpoints", { breakpoints: [] }],
  ["setExceptionBreakpoints", { filters: ["program-error", "wrong-data", "position-error", "limit"] }],
  ["breakpointLocations", { source: { path }, line: 1, endLine: 9 }],
  ["loadedSources", {}],
  ["source", { source: { path }, sourceReference: 0 }],
  ["threads", {}],
  ["stackTrace", { threadId: 1 }],
  ["scopes", { frameId: 1000 }],
  ...[1001, 1002, 1003, 1004, 1005, 1006, 7].map((reference) => ["variables", { variablesReference: reference }]),
  ["evaluate", { expression: "1 + 1", frameId: 1000 }],
  ["evaluate", { expression: "why", frameId: 1000, context: "repl" }],
  ["evaluate", { expression: "branch", frameId: 1000, context: "repl" }],
  ["setVariable", { variablesReference: 1003, name: "IN1", value: "1" }],
  ["setExpression", { expression: "n", value: "2 *", frameId: 1000 }],
];

for (const [name, text, isGood] of PROGRAMS)
  test(`every request about ${name} is answered, or refused with a reason`, async () => {
    const path = join(FOLDER, name);
    writeFileSync(path, text);
    const answered = (command, args) =>
      client.customRequest(command, args).then(
        () => true,
        ({ message }) => (assert.ok(message), false),
      );
    await client.initializeRequest();
    assert.equal(await answered("launch", { program: path, stopOnEntry: true }), isGood);
    if (isGood && text) {
      const entry = client.waitForEvent("stopped");
      assert.ok(await answered("configurationDone", {}));
      assert.equal((await entry).body.reason, "entry");
    }
    for (const [command, args] of REQUESTS(path)) await answered(command, args);
    for (const command of ["next", "stepIn", "stepBack", "stepOut", "reverseContinue", "continue", "restart"]) {
      const stopped =
        isGood && text ? Promise.race([client.waitForEvent("stopped"), client.waitForEvent("terminated")]) : null;
      const isDone = await answered(command, { threadId: 1 });
      if (text) assert.equal(isDone, isGood, command);
      if (command === "continue" || command === "stepOut") await answered("pause", { threadId: 1 });
      await stopped;
    }
    assert.equal(await answered("threads", {}), isGood);
  });
