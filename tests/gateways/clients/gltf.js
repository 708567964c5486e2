// The validator of glTF files, which takes requests as lines of JSON and answers each with one line.
const fs = require("node:fs");
const readline = require("node:readline");
const validator = require("gltf-validator");

async function answer({ file }) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 20 });
  return { ...issues, animations: info.animationCount };
}

readline.createInterface({ input: process.stdin }).on("line", async (line) => {
  try {
    console.log(`@${JSON.stringify({ ok: await answer(JSON.parse(line)) })}`);
  } catch (error) {
    console.log(`@${JSON.stringify({ error: String(error) })}`);
  }
});
