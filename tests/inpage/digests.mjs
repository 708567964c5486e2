// Runs worlds in Python inside WebAssembly: a list of worlds on standard input, a list of digests on standard output.
import { readFileSync } from "node:fs";
import { gunzipSync } from "node:zlib";

const [folder] = process.argv.slice(2);
const worlds = readFileSync(0, "utf-8");
const { loadPyodide } = await import(`${folder}/pyodide.mjs`);
const python = await loadPyodide({ indexURL: `${folder}/` });
python.FS.writeFile("/steptwin.zip", gunzipSync(readFileSync(`${folder}/steptwin.modules`)));
const run = python.runPython(`
import base64, json, sys
sys.path.append("/steptwin.zip")
from steptwin.files.world import World

def run(given):
    found = {}
    for world in json.loads(given):
        files = {name: base64.b64decode(content) for name, content in world["files"].items()}
        made = World.from_toml(world["text"], files, name=world["name"])
        made.run(for_=world["seconds"])
        found[world["name"]] = made.trace.digest()
    return json.dumps(found)

run`);
process.stdout.write(run(worlds));
