// Python in a worker: it is loaded with the first run, and ends when the page stops it.

import { loadPyodide } from "./pyodide/pyodide.mjs";

let ready = null;
const stage = text => postMessage({ stage: text });

async function load({ packages, wheels }) {
  stage("Loading Python …");
  const pyodide = await loadPyodide({
    indexURL: new URL("pyodide/", import.meta.url).href,
    packageBaseUrl: packages,
  });
  for (const wheel of wheels) {
    const answer = await fetch(new URL(wheel, import.meta.url));
    pyodide.unpackArchive(await answer.arrayBuffer(), "wheel");
  }
  await need(pyodide, "numpy");
  const own = await fetch(new URL("run.py", import.meta.url));
  return [pyodide, pyodide.runPython(`${await own.text()}\nrun`)];
}

async function need(pyodide, name) {
  stage(`Loading ${name} from Pyodide's server …`);
  const problems = [];
  await pyodide.loadPackage(name, { errorCallback: text => problems.push(text) });
  if (!(name in pyodide.loadedPackages)) throw new Error(`${name} could not be loaded. ${problems.join(" ")}`);
}

/** Run a deck, once more if it turns out to need a package that is loaded for few decks. */
async function run({ text, name }) {
  const [pyodide, simulate] = await ready;
  for (;;) {
    stage("Running …");
    const begin = performance.now();
    const { page, messages, missing } = JSON.parse(simulate(text, name));
    if (!missing) return postMessage({ page, messages, seconds: (performance.now() - begin) / 1e3 });
    await need(pyodide, missing);
  }
}

onmessage = async ({ data }) => {
  try {
    if (data.runtime) ready = load(data.runtime);
    else await run(data);
  } catch (error) {
    postMessage({ failed: String(error.message ?? error) });
  }
};
