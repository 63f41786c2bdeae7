// Draws the report from the JSON in the page. Nothing is computed here but what a screen needs.
const data = JSON.parse(document.getElementById("data").textContent);
const root = document.getElementById("report");
const WORDS = { holds: "Certificate holds", fails: "Certificate FAILS", partial: "Interrupted", none: "Not certified", response: "Response" };

const verdictOf = group => {
  const states = group.runs.map(r => r.verdict.state), worst = ["fails", "partial", "none", "response", "holds"].find(s => states.includes(s));
  const run = group.runs[states.indexOf(worst)], count = states.filter(s => s === worst).length;
  const which = group.runs.length > 1 ? ` (${count} of ${group.runs.length} runs${worst === "fails" ? `: ${group.runs.filter(r => r.verdict.state === worst).slice(0, 4).map(r => r.label).join("; ")}` : ""})` : "";
  return el("div", { class: `verdict ${worst}` }, el("b", {}, WORDS[worst] + which), " ", run.verdict.text);
};

// what belongs to one run: below the curves of the family
function details(run, box) {
  box.replaceChildren();
  const add = (title, ...content) => box.append(el("h2", {}, title), ...content);
  if (run.loop) {
    const { crossovers, reversals } = run.loop;
    add("Margins", table(["", "frequency", "margin"], [
      ...crossovers.map(([f, m]) => ["phase margin, at |T| = 1", si(f, "Hz", 6), `${+m.toPrecision(4)}°`]),
      ...reversals.map(([f, m]) => ["gain margin, at −180°", si(f, "Hz", 6), `${+m.toPrecision(4)} dB`]),
      ...(crossovers.length ? [] : [["no crossover within these frequencies", "–", "–"]]),
    ], [1, 2]));
  }
  if (run.values.length) add("Operating point", table(["signal", "value"], run.values, [1]));
  const measures = Object.entries(run.measures);
  if (measures.length) add("Measures", table(["name", "value"], measures.map(([k, v]) => [k, v == null ? "not found" : plain(v)]), [1]));
  run.spectra.forEach(s => box.append(...spectrumOf(s).filter(Boolean)));
  if (run.losses) box.append(...lossesOf(run.losses));
  if (run.periodic) add("Periodic steady state", el("p", {}, `period ${run.periodic.period}, ${run.periodic.verdict}`), run.periodic.multipliers.length ? table(["Floquet multiplier, real", "imaginary", "magnitude"], run.periodic.multipliers, [0, 1, 2]) : "");
  if (run.sensitivities.length) add("Sensitivities", table(["of", "to", "change for 1 %"], run.sensitivities.map(([a, b, v]) => [a, b, si(v)]), [2]));
  if (run.jumps.length) add("Jumps and impulses", table(["time", "energy before", "after", "lost", "what"], run.jumps.map(j => [j.time, j.before, j.after, j.lost, j.what])));
  if (run.energy.length) add("Energy", table(["", "energy"], run.energy, [1]));
  add("How it was solved", el("pre", { tabindex: 0 }, run.summary));
  if (run.warnings.length) add("Warnings of the run", el("pre", { tabindex: 0 }, run.warnings.join("\n")));
}

function show(index) {
  const group = data.groups[index], below = el("div");
  redrawn.clear();
  page.replaceChildren(verdictOf(group));
  tabs.querySelectorAll("button").forEach((b, k) => b.setAttribute("aria-selected", k === index));
  group.runs.forEach(r => r.curves?.signals.forEach(s => { if (s.name === "inoise") s.unit = `${data.input}/√Hz`; }));
  const pick = group.runs.length > 1 ? el("select", { "aria-label": "run", onchange: e => details(group.runs[e.target.value], below) }, group.runs.map((r, k) => el("option", { value: k }, r.label))) : null;
  explorer(group, page, k => { if (pick) { pick.value = k; details(group.runs[k], below); } });
  measuresOf(group, page);
  if (pick) page.append(el("p", { class: "tools" }, "Details of the run ", pick));
  page.append(below);
  details(group.runs[0], below);
}

const tabs = el("nav", { role: "tablist", "aria-label": "analyses" }, data.groups.length > 1
  ? data.groups.map((g, k) => el("button", { role: "tab", onclick: () => show(k), onkeydown: e => {
    const to = { ArrowRight: k + 1, ArrowLeft: k - 1 }[e.key];
    if (to != null && tabs.children[to]) { tabs.children[to].focus(); show(to); }
  } }, g.label)) : []);
const page = el("section");
root.replaceChildren(el("h1", {}, data.title), tabs, page, el("h2", {}, `The deck, ${data.file}`));
if (data.warnings.length) root.append(el("pre", { tabindex: 0 }, data.warnings.join("\n")));
root.append(el("pre", { tabindex: 0 }, data.deck), el("footer", {}, document.querySelector("meta[name=generator]").content));
show(Math.max(0, data.groups.findIndex(g => g.label !== "op"))); // an operating point is seldom why one looks
