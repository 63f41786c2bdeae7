// Replays records of calls in Pyodide under Node: node replay.mjs PYODIDE CORE TESTS RECORD...
import { readFileSync } from "node:fs";

const [pyodide, core, tests, ...records] = process.argv.slice(2);
const { loadPyodide } = await import(`${pyodide}/pyodide.mjs`);
const python = await loadPyodide({ indexURL: pyodide });
const put = (name, path) => python.FS.writeFile(`/home/pyodide/${name}`, readFileSync(path));
put("_core.abi3.so", core);
for (const name of ["arrays.py", "replay.py"]) put(name, `${tests}/${name}`);
const names = records.map((record, k) => (put(`record${k}.json`, record), `record${k}.json`));
console.log(python.runPython(`
import sys
import os
os.chdir("/home/pyodide")
sys.path.insert(0, "")
from replay import main
main(${JSON.stringify(names)})
`));
