// The curves of an analysis: which signals and runs are drawn, the window, and two cursors.
function explorer(group, box, onRun) {
  const runs = group.runs.filter(r => r.curves);
  if (!runs.length) return;
  const family = runs.length > 1, logarithmic = group.logarithmic;
  const curves = runs.map(run => run.curves.signals.map(s => new Curve(run, s)));
  const names = [...new Set(curves[0].map(c => c.name))];
  const chosen = new Set(group.shown.filter(n => names.includes(n)));
  if (!chosen.size) names.slice(0, 4).forEach(n => chosen.add(n));
  const active = new Set(runs.map((_, k) => k));
  const values = group.parameters.length === 1 ? runs.map(r => r.parameters[group.parameters[0]]) : runs.map((_, k) => k + 1);
  const place = parts(values);
  const full = [Math.min(...runs.map((_, k) => curves[k][0].axis[0])), Math.max(...runs.map((_, k) => curves[k][0].axis.at(-1)))];
  const asked = location.hash.slice(1).split(",").map(Number); // page.html#FROM,TO opens at that window
  let span = asked.length === 2 && asked.every(isFinite) ? asked : [...full], panels = [], next = "A";
  const cursors = { A: null, B: null };
  const plots = el("div", { class: "plots" }), strips = el("div"), table_ = el("div", { class: "scroll", "aria-live": "polite" });
  const range = el("span", { role: "status", "aria-live": "polite" }), drawn = el("output", { hidden: true });

  // a window in the coordinate that the axis draws
  const up = logarithmic ? Math.log : x => x, down = logarithmic ? Math.exp : x => x;
  const setWindow = (low, high) => {
    const [a, b] = full.map(up), width = Math.max(up(high) - up(low), (b - a) * 1e-9);
    const start = Math.max(a, Math.min(up(low), b - width));
    span = [down(start), down(Math.min(b, start + width))];
    if (start === a && start + width >= b) span = [...full];
    refresh();
  };
  const middle = () => down((up(span[0]) + up(span[1])) / 2);
  const zoom = (factor, at = middle()) => setWindow(down(up(at) - (up(at) - up(span[0])) * factor), down(up(at) + (up(span[1]) - up(at)) * factor));
  const move = part => { const d = part * (up(span[1]) - up(span[0])); setWindow(down(up(span[0]) + d), down(up(span[1]) + d)); };
  const all = () => { panels.forEach(p => p.reset()); setWindow(...full); };

  const members = () => runs.flatMap((run, k) => active.has(k) ? curves[k].filter(c => chosen.has(c.name)) : []);
  const setCursor = (name, x) => {
    cursors[name] = x == null || !isFinite(x) ? null : Math.max(full[0], Math.min(full[1], x));
    fields[name].value = cursors[name] == null ? "" : si(cursors[name], group.axis_unit, 7);
    panels.forEach(p => p.plot.redraw(false, true));
    readings();
  };
  const readings = () => {
    const { A, B } = cursors;
    if (A == null && B == null) return table_.replaceChildren();
    const both = A != null && B != null, dx = both ? B - A : 0, head = ["signal"];
    if (A != null) head.push("at A");
    if (B != null) head.push("at B");
    if (both) head.push("B − A", "slope", "mean", "RMS", "lowest", "highest");
    const rows = members().slice(0, 60).map(c => {
      const row = [family ? `${c.name} ${c.run.label}` : c.name], u = c.unit;
      if (A != null) row.push(si(c.at(A), u, 6));
      if (B != null) row.push(si(c.at(B), u, 6));
      if (both) {
        const [mean, rms] = c.averages(Math.min(A, B), Math.max(A, B)), [low, high] = c.range(Math.min(A, B), Math.max(A, B));
        row.push(si(c.at(B) - c.at(A), u), dx ? si((c.at(B) - c.at(A)) / dx, `${u}/${group.axis_unit || "1"}`) : "–", si(mean, u), si(rms, u), si(low, u), si(high, u));
      }
      return row;
    });
    const distance = both ? el("p", { class: "distance" }, `B − A = ${si(dx, group.axis_unit, 6)}${group.axis === "time" && dx ? `, 1/|B − A| = ${si(Math.abs(1 / dx), "Hz", 6)}` : ""}`) : null;
    table_.replaceChildren(...[distance, table(head, rows, head.map((_, k) => k).slice(1))].filter(Boolean));
  };

  const note = () => { drawn.textContent = JSON.stringify(panels.map(p => p.drawn())); };
  // uPlot lays panels out in a microtask, after which their places are known
  const align = () => { if (!family) queueMicrotask(() => modeStrip(runs[0], strips, span, panels[0]?.plot.over)); };
  const refresh = () => {
    panels.forEach(p => p.refresh());
    note();
    range.textContent = `${si(span[0], group.axis_unit)} to ${si(span[1], group.axis_unit)}`;
    align();
  };
  const build = () => {
    panels.forEach(p => p.plot.destroy());
    panels = [];
    plots.replaceChildren();
    const shown = curves[0].filter(c => chosen.has(c.name));
    const add = (list, title, unit, extra = {}) => {
      const log = unit.endsWith("/√Hz");
      panels.push(panel(plots, {
        curves: list, title, unit, x: { name: group.axis, unit: group.axis_unit, logarithmic }, logarithmic: log,
        window: () => span, onRange: note, onWindow: setWindow, zoom, all, places: () => cursors, legend: !family,
        onPlace: (x, shift) => { const name = shift ? "B" : next; setCursor(name, x); next = name === "A" ? "B" : "A"; }, ...extra,
      }));
    };
    const title = { V: "voltage", A: "current", W: "power", dB: "magnitude", "°": "phase", "°C": "temperature" };
    for (const unit of [...new Set(shown.map(c => c.unit))].sort((a, b) => ORDER.indexOf(a) - ORDER.indexOf(b))) {
      const mine = shown.filter(c => c.unit === unit), extra = { marks: marksOf(group, runs, unit) };
      if (family) for (const one of mine) {
        const list = runs.flatMap((run, k) => active.has(k) ? curves[k].filter(c => c.name === one.name && c.unit === unit).map(curve => ({ curve, label: run.label, stroke: shade(place[k]) })) : []);
        if (list.length) add(list, title[unit] && PLAIN.has(unit) ? `${one.name} ${title[unit]}` : one.name, unit, extra);
      } else for (const part of PLAIN.has(unit) || !title[unit] ? [mine] : grouped(mine, ...full)) {
        add(part.map((curve, k) => ({ curve, label: curve.name, stroke: colour(k), dash: k >= LIGHT.length ? [6, 4] : undefined })), title[unit] ?? (unit ? "density" : "value"), unit, extra);
      }
    }
    refresh();
    readings();
  };

  const boxes = names.map(name => el("label", { "data-name": name }, el("input", { type: "checkbox", checked: chosen.has(name), onchange: e => {
    if (e.target.checked) chosen.add(name); else chosen.delete(name);
    build();
  } }), ` ${name}`));
  const filter = (items, text) => items.forEach(item => { item.hidden = !item.textContent.toLowerCase().includes(text.trim().toLowerCase()); });
  const search = el("input", { type: "search", placeholder: "find a signal (/)", "aria-label": "find a signal", oninput: e => filter(boxes, e.target.value) });
  const fields = Object.fromEntries(["A", "B"].map(name => [name, el("input", { size: 11, "aria-label": `cursor ${name}`, placeholder: group.axis_unit || group.axis, onchange: e => setCursor(name, parsed(e.target.value)) })]));
  const keys = {
    ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2), "0": all,
    ArrowUp: () => panels.forEach(p => p.zoomY(0.7)), ArrowDown: () => panels.forEach(p => p.zoomY(1 / 0.7)),
    a: () => setCursor("A", cursors.A ?? middle()), b: () => setCursor("B", cursors.B ?? middle()),
    "[": () => setCursor("A", (cursors.A ?? middle()) - (span[1] - span[0]) / 100), "]": () => setCursor("A", (cursors.A ?? middle()) + (span[1] - span[0]) / 100),
    "{": () => setCursor("B", (cursors.B ?? middle()) - (span[1] - span[0]) / 100), "}": () => setCursor("B", (cursors.B ?? middle()) + (span[1] - span[0]) / 100),
    Escape: () => { setCursor("A", null); setCursor("B", null); next = "A"; }, "/": () => search.focus(),
  };
  const area = el("div", { tabindex: 0, class: "area", "aria-label": "curves: arrow keys move and stretch, plus and minus zoom, 0 shows all, a and b set cursors, brackets move them, Escape removes them, slash finds a signal", onkeydown: e => {
    if (keys[e.key] && e.target === area) { e.preventDefault(); keys[e.key](); }
  } }, plots);
  const button = (text, label, onclick) => el("button", { onclick, "aria-label": label, title: label }, text);
  const thin = runs.some(r => r.curves.thinned), left = runs[0].curves.left_out;
  box.append(el("h2", {}, group.axis === "frequency" ? "Over the frequency" : group.axis === "time" ? "Waveforms" : `Over ${group.axis}`));
  if (names.length > 1) box.append(el("div", { class: "tools" }, names.length > 8 ? search : null), el("div", { class: "signals", role: "group", "aria-label": "signals" }, boxes));
  if (family) {
    const buttons = runs.map((run, k) => el("button", { "aria-pressed": "true", class: "run", onclick: e => {
      if (e.shiftKey || e.ctrlKey) { active.clear(); active.add(k); } else if (active.has(k)) active.delete(k); else active.add(k);
      onRun(k); press(); build();
    } }, el("i", { "data-run": k }), run.label));
    const press = () => buttons.forEach((b, k) => { b.setAttribute("aria-pressed", active.has(k)); b.firstChild.style.background = shade(place[k]); });
    box.append(el("div", { class: "tools" }, el("input", { type: "search", "aria-label": "filter runs", placeholder: "filter runs", oninput: e => {
      active.clear();
      runs.forEach((r, k) => { if (r.label.toLowerCase().includes(e.target.value.trim().toLowerCase())) active.add(k); });
      press(); build();
    } }), button("all runs", "show all runs", () => { runs.forEach((_, k) => active.add(k)); press(); build(); }), el("span", {}, "click: hide or show; shift-click: this one alone")),
      el("div", { class: "legend", role: "group", "aria-label": "runs" }, buttons));
    press();
    redrawn.add(press);
  }
  box.append(el("div", { class: "tools" }, button("◀", "earlier", () => move(-0.5)), button("+", "zoom in", () => zoom(0.5)), button("−", "zoom out", () => zoom(2)), button("▶", "later", () => move(0.5)), button("all", "show all", all), range,
    el("span", { class: "cursors" }, el("label", {}, "A ", fields.A), el("label", {}, "B ", fields.B), button("×", "remove both cursors", keys.Escape)),
    thin ? el("span", {}, "(thinned: every extreme and average is kept)") : null,
    left ? el("span", {}, `(${left} more signals with --signals)`) : null),
    area, table_, strips, drawn,
    el("p", { class: "hint" }, "Click sets the cursors A and B. Drag or scroll to zoom, with shift in height; double click shows all."));
  new ResizeObserver(() => { panels.forEach(p => p.resize()); align(); }).observe(plots);
  redrawn.add(build);
  build();
}

const ORDER = ["dB", "°", "V", "A", "W", "°C", ""];
// levels, crossovers and margins of a loop gain
function marksOf(group, runs, unit) {
  const loop = runs.length === 1 ? runs[0].loop : null;
  if (group.analysis !== "loop" && !loop) return [];
  const marks = unit === "dB" ? [{ y: 0 }] : [];
  if (!loop) return unit === "°" ? [...marks, { y: -180, red: true }] : marks;
  const levels = new Set([...loop.crossovers.map(([, margin, phase]) => Math.round(phase - margin)), ...loop.reversals.map(([, , phase]) => Math.round(phase))]);
  if (unit === "°") (levels.size ? levels : new Set([-180])).forEach(y => marks.push({ y, red: true }));
  for (const [x, margin, phase] of loop.crossovers) {
    marks.push({ x });
    if (unit === "°") marks.push({ x, y: phase - margin, to: phase, text: `phase margin ${+margin.toPrecision(4)}°` });
  }
  for (const [x, margin] of loop.reversals) {
    marks.push({ x });
    if (unit === "dB") marks.push({ x, y: -margin, to: 0, text: `gain margin ${+margin.toPrecision(4)} dB` });
  }
  return marks;
}
