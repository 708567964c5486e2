// Commands are found as the system finds them.

import assert from "node:assert/strict";
import { basename, dirname } from "node:path";
import { test } from "node:test";
import { load } from "./load.mjs";

const { isFound } = await load("src/found.ts");

test("a path", () => {
  assert.ok(isFound(process.execPath));
  assert.ok(!isFound(`${process.execPath}-that-is-not-there`));
});

test("a name in PATH", () => {
  process.env.PATH = "/nowhere";
  assert.ok(!isFound(basename(process.execPath)));
  process.env.PATH = ["/nowhere", dirname(process.execPath)].join(process.platform === "win32" ? ";" : ":");
  assert.ok(isFound(basename(process.execPath)));
  assert.ok(!isFound("a-command-that-is-not-there"));
});
