// Makes what the studio inside a page needs beside its page: `node scripts/site.mjs MODULES.json FOLDER`. Pyodide, whose own Python
// compiles the modules, and the whole state at the beginning, which the page shows before Python is there.
import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";
import { loadPyodide } from "pyodide";

const [modules, folder] = process.argv.slice(2);
const { archives, world, licences } = JSON.parse(readFileSync(modules, "utf-8"));
const installed = new URL("../node_modules/pyodide/", import.meta.url);

mkdirSync(`${folder}/python`, { recursive: true });
for (const name of ["pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm"])
  copyFileSync(new URL(name, installed), `${folder}/python/${name}`);
writeFileSync(`${folder}/python/licences.txt`, licences);
// Of the packages that Pyodide has besides none is used.
const lock = JSON.parse(readFileSync(new URL("pyodide-lock.json", installed), "utf-8"));
writeFileSync(`${folder}/python/pyodide-lock.json`, JSON.stringify({ ...lock, packages: {} }));

// Without the columns of each instruction the archives are a quarter smaller; tracebacks still have the lines.
const python = await loadPyodide({ args: ["-X", "no_debug_ranges"] });
python.FS.writeFile("/home/pyodide/archives.py", readFileSync(new URL("archives.py", import.meta.url)));
const { pack, archive_of, library } = python.pyimport("archives");
const own = {};

for (const [archive, files] of Object.entries(archives)) {
  const sources = Object.fromEntries(Object.entries(files).map(([name, path]) => [name, readFileSync(path, "utf-8")]));
  Object.assign(own, sources);
  const packed = pack(python.toPy(sources)).toJs();
  writeFileSync(`${folder}/python/${archive}.modules`, packed);
  if (archive !== "steptwin") continue;
  python.FS.writeFile("/steptwin.zip", gunzipSync(packed));
  python.runPython('import sys; sys.path.append("/steptwin.zip")');
}
// Pyodide reads this one itself.
writeFileSync(`${folder}/python/python_stdlib.zip`, archive_of(library(python.toPy(own))).toJs());

// The same way as in the page (src/site/python.worker.ts), with one request.
const messages = [];
const page = {
  opened: () => undefined,
  send: (_number, text) => messages.push(JSON.parse(text)),
  closed: () => undefined,
  failed: (text) => {
    throw new Error(text);
  },
};
const files = Object.fromEntries(
  Object.entries(world.files).map(([name, path]) => [name, new Uint8Array(readFileSync(path))]),
);
const text = readFileSync(world.path, "utf-8");
const { PageTwin } = python.pyimport("steptwin.inpage.host");
const twin = PageTwin(page, world.name, text, python.toPy(files));
twin.connections.open(1);
twin.connections.receive(
  1,
  JSON.stringify({ do: "hello", version: python.pyimport("steptwin.subject.commands").VERSION, id: 1 }),
);
while (!messages.some((message) => "hello" in message)) await new Promise((done) => setTimeout(done, 20));
const { hello } = messages.find((message) => "hello" in message);
mkdirSync(`${folder}/world`, { recursive: true });
writeFileSync(`${folder}/world/${world.name}.hello.json`, JSON.stringify(hello));
writeFileSync(`${folder}/world/${world.name}.toml`, text);
writeFileSync(`${folder}/world/${world.name}.campaign.toml`, readFileSync(world.campaign));
for (const [name, bytes] of Object.entries(files)) writeFileSync(`${folder}/world/${name}`, bytes);
writeFileSync(`${folder}/world/${world.name}.json`, JSON.stringify({ files: Object.keys(files) }));
// Last: it says that all is there.
writeFileSync(`${folder}/service.js`, service());
process.exit(0);

/** The service worker, with the digests of all files. The page itself has the address of the folder. */
function service() {
  const names = readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((one) => one.isFile())
    .map((one) => `${one.parentPath}/${one.name}`.slice(folder.length + 1))
    .filter((name) => name !== "service.js")
    .sort();
  const digest = (bytes) => createHash("sha256").update(bytes).digest("base64");
  const found = names.map((name) => [
    name === "index.html" ? "./" : name,
    `sha256-${digest(readFileSync(`${folder}/${name}`))}`,
  ]);
  const given = JSON.stringify(Object.fromEntries(found));
  const code = readFileSync(new URL("../src/site/service.js", import.meta.url), "utf-8");
  return `const VERSION = ${JSON.stringify(digest(given))};\nconst FILES = ${given};\n${code}`;
}
