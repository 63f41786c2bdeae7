"use strict";
// Draws the report from the JSON in the page. Nothing is computed here but what a screen needs.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.getElementById("report");
  const DARK = matchMedia("(prefers-color-scheme: dark)").matches;
  // distinguishable with colour-blind eyes (after Okabe and Ito), lighter on a dark ground
  const COLOURS = DARK
    ? ["#56B4E9", "#E69F00", "#2BD4A4", "#E58FC0", "#F0E442", "#6FA8FF", "#C0C0C0", "#D39B7F"]
    : ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#8C564B"];
  const PREFIX = { "-18": "a", "-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", "0": "", "3": "k", "6": "M", "9": "G", "12": "T" };

  const el = (tag, attributes = {}, ...children) => {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value !== false && value != null) node.setAttribute(key, value === true ? "" : value);
    }
    for (const child of children.flat()) node.append(child);
    return node;
  };
  const si = (value, unit, digits = 5) => {
    if (value == null || !isFinite(value)) return "–";
    if (value === 0 || !unit) return `${+value.toPrecision(digits)} ${unit}`.trim();
    const power = Math.max(-18, Math.min(12, 3 * Math.floor(Math.log10(Math.abs(value)) / 3 + 1e-9)));
    return `${+(value / 10 ** power).toPrecision(digits)} ${PREFIX[power]}${unit}`;
  };
  const decode = (text, type) => {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
    return new type(bytes.buffer);
  };

  // first index with axis[k] >= x
  const lower = (axis, x) => {
    let a = 0, b = axis.length;
    while (a < b) { const m = (a + b) >> 1; if (axis[m] < x) a = m + 1; else b = m; }
    return a;
  };
  // the part of the axis that is seen, with lowest and highest of each signal for every pixel column
  const visible = (axis, rows, low, high, columns) => {
    const a = Math.max(0, lower(axis, low) - 1), b = Math.min(axis.length, lower(axis, high) + 2);
    const count = b - a;
    if (count <= 4 * columns) return [Array.from(axis.subarray(a, b)), ...rows.map(r => Array.from(r.subarray(a, b)))];
    const size = Math.ceil(count / columns), x = [], ys = rows.map(() => []);
    for (let k = a; k < b; k += size) {
      const end = Math.min(k + size, b);
      x.push(axis[k], axis[end - 1]);
      rows.forEach((row, j) => {
        let lo = row[k], hi = row[k];
        for (let i = k + 1; i < end; i++) { if (row[i] < lo) lo = row[i]; else if (row[i] > hi) hi = row[i]; }
        if (row[end - 1] >= row[k]) ys[j].push(lo, hi); else ys[j].push(hi, lo);
      });
    }
    return [x, ...ys];
  };

  function waveforms(run, box) {
    const w = run.waveforms;
    if (!w) return;
    const axis = decode(w.axis, Float64Array);
    const signals = w.signals.map(s => ({ ...s, values: null }));
    w.signals.forEach((s, k) => { signals[k].text = s.values; });
    const rowOf = s => (s.values ??= decode(s.text, Float32Array));
    const chosen = new Set(run.shown.filter(n => signals.some(s => s.name === n)));
    const full = [axis[0], axis[axis.length - 1]];
    const asked = location.hash.slice(1).split(",").map(Number); // page.html#FROM,TO opens at that window
    let window_ = asked.length === 2 && asked.every(isFinite) ? asked : [...full], charts = [];
    const plots = el("div", { class: "plots" }), strips = el("div");
    const range = el("span", { role: "status", "aria-live": "polite" }), drawn = el("output", { hidden: true });

    const setWindow = (low, high) => {
      const span = Math.max(high - low, (full[1] - full[0]) * 1e-9);
      low = Math.max(full[0], Math.min(low, full[1] - span));
      window_ = [low, Math.min(full[1], low + span)];
      refresh();
    };
    const zoom = (factor, at = (window_[0] + window_[1]) / 2) =>
      setWindow(at - (at - window_[0]) * factor, at + (window_[1] - at) * factor);
    const move = part => { const d = part * (window_[1] - window_[0]); setWindow(window_[0] + d, window_[1] + d); };

    const refresh = () => {
      for (const c of charts) {
        c.plot.setData(visible(axis, c.rows, window_[0], window_[1], Math.max(200, plots.clientWidth)), false);
        c.plot.setScale("x", { min: window_[0], max: window_[1] });
        c.plot.redraw(true, true);
      }
      drawn.textContent = JSON.stringify(charts.map(c => c.plot.data.map(d => [Math.min(...d), Math.max(...d), d.length])));
      range.textContent = `${si(window_[0], run.axis_unit)} to ${si(window_[1], run.axis_unit)}`;
      modeStrip(run, strips, window_);
    };
    const build = () => {
      charts.forEach(c => c.plot.destroy());
      charts = [];
      plots.replaceChildren();
      const dark = DARK;
      const ink = dark ? "#9da7b3" : "#57606a", grid = dark ? "#30363d" : "#e6e9ec";
      for (const unit of ["V", "A", "W", ""]) {
        const members = signals.filter(s => s.unit === unit && chosen.has(s.name));
        if (!members.length) continue;
        const rows = members.map(rowOf);
        const holder = el("div", { class: "plot", role: "img", "aria-label": `waveforms of ${members.map(m => m.name).join(", ")}` });
        plots.append(holder);
        const axes = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 } };
        const plot = new uPlot({
          width: plots.clientWidth || 1000, height: 260,
          cursor: { sync: { key: "run" }, drag: { x: true, y: false, setScale: false }, y: false },
          scales: { x: { time: false, auto: false, range: () => window_ } },
          axes: [
            { ...axes, values: (u, ticks) => ticks.map(v => si(v, run.axis_unit, 6)) },
            { ...axes, size: 78, values: (u, ticks) => ticks.map(v => si(v, unit, 4)) },
          ],
          series: [
            { label: run.axis || "x", value: (u, v) => si(v, run.axis_unit, 9) },
            ...members.map((m, k) => ({
              label: m.name, stroke: COLOURS[k % COLOURS.length], width: 1.4, points: { show: false },
              dash: k >= COLOURS.length ? [6, 4] : undefined, value: (u, v) => si(v, unit, 7),
            })),
          ],
          hooks: { setSelect: [u => {
            if (u.select.width > 2) setWindow(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
            u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          }] },
        }, visible(axis, rows, ...window_, 1000), holder);
        plot.over.addEventListener("wheel", e => {
          e.preventDefault();
          zoom(e.deltaY < 0 ? 0.8 : 1.25, plot.posToVal(e.offsetX, "x"));
        }, { passive: false });
        plot.over.addEventListener("dblclick", () => setWindow(...full));
        charts.push({ plot, rows });
      }
      refresh();
    };
    const boxes = el("div", { class: "signals", role: "group", "aria-label": "signals" }, signals.map(s =>
      el("label", {}, el("input", { type: "checkbox", checked: chosen.has(s.name), onchange: e => {
        if (e.target.checked) chosen.add(s.name); else chosen.delete(s.name);
        build();
      } }), ` ${s.name}`)));
    const area = el("div", { tabindex: 0, "aria-label": "waveforms: arrow keys move, plus and minus zoom, 0 shows all", onkeydown: e => {
      const keys = { ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2), "+": () => zoom(0.5), "=": () => zoom(0.5), "-": () => zoom(2), "0": () => setWindow(...full) };
      if (keys[e.key] && e.target === area) { e.preventDefault(); keys[e.key](); }
    } }, plots);
    box.append(el("h2", {}, "Waveforms"), boxes,
      el("div", { class: "tools" },
        el("button", { onclick: () => move(-0.5), "aria-label": "earlier" }, "◀"),
        el("button", { onclick: () => zoom(0.5), "aria-label": "zoom in" }, "+"),
        el("button", { onclick: () => zoom(2), "aria-label": "zoom out" }, "−"),
        el("button", { onclick: () => move(0.5), "aria-label": "later" }, "▶"),
        el("button", { onclick: () => setWindow(...full) }, "all"), range,
        w.thinned ? el("span", {}, "(thinned: every extreme is kept)") : ""),
      area, strips, drawn);
    new ResizeObserver(() => charts.forEach(c => c.plot.setSize({ width: plots.clientWidth, height: 260 }))).observe(plots);
    build();
  }

  // who conducts when: the shade of a pixel is the part of its time for which the element is on
  function modeStrip(run, box, [low, high]) {
    if (!run.modes.length) return;
    if (!box.firstChild) {
      box.append(el("h2", {}, "Who conducts when"));
      const grid = el("div", { class: "strip" });
      run.modes.forEach(m => {
        m.times = decode(m.changes, Float64Array);
        grid.append(el("span", {}, m.element), el("canvas", { role: "img", height: 14, "aria-label": `${m.element}: ${m.times.length} changes` }));
      });
      box.append(grid);
    }
    box.querySelectorAll("canvas").forEach((canvas, k) => {
      const m = run.modes[k], width = (canvas.width = Math.max(100, canvas.clientWidth)), pen = canvas.getContext("2d");
      pen.fillStyle = COLOURS[k % COLOURS.length];
      const shade = new Float64Array(width), scale = width / (high - low);
      let index = lower(m.times, low), on = m.on !== (index % 2 === 1), from = low;
      for (; from < high; index++, on = !on) {
        const to = index < m.times.length ? Math.min(m.times[index], high) : high;
        if (on) {
          const a = (from - low) * scale, b = (to - low) * scale;
          for (let x = Math.floor(a); x < Math.min(width, Math.ceil(b)); x++) shade[x] += Math.min(b, x + 1) - Math.max(a, x);
        }
        from = to;
      }
      shade.forEach((s, x) => { if (s > 0) { pen.globalAlpha = Math.min(1, s); pen.fillRect(x, 0, 1, 14); } });
    });
  }

  function table(head, rows, numeric = []) {
    const body = el("tbody");
    const fill = list => body.replaceChildren(...list.map(r => el("tr", {}, r.map((c, k) => el("td", { class: numeric.includes(k) ? "n" : null }, String(c))))));
    let order = 0, column = -1;
    const sort = k => {
      order = column === k ? -order || 1 : 1; column = k;
      fill([...rows].sort((a, b) => order * (numeric.includes(k) ? parseFloat(a[k]) - parseFloat(b[k]) : String(a[k]).localeCompare(String(b[k])))));
    };
    fill(rows);
    return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, head.map((h, k) => el("th", { scope: "col" }, el("button", { onclick: () => sort(k) }, h))))), body));
  }

  function show(index) {
    const run = data.runs[index];
    page.replaceChildren();
    tabs.querySelectorAll("button").forEach((b, k) => b.setAttribute("aria-selected", k === index));
    const words = { holds: "Certificate holds", fails: "Certificate FAILS", partial: "Interrupted", none: "Not certified" };
    page.append(el("div", { class: `verdict ${run.verdict.state}` }, el("b", {}, words[run.verdict.state]), " ", run.verdict.text));
    waveforms(run, page);
    if (Object.keys(run.values).length) page.append(el("h2", {}, "Operating point"), table(["signal", "value"], Object.entries(run.values)));
    const measures = Object.entries(run.measures);
    if (measures.length) page.append(el("h2", {}, "Measures"), table(["name", "value"], measures.map(([k, v]) => [k, v == null ? "not found" : v]), [1]));
    if (run.jumps.length) page.append(el("h2", {}, "Jumps and impulses"), table(["time", "energy before", "after", "lost", "what"], run.jumps.map(j => [j.time, j.before, j.after, j.lost, j.what])));
    if (run.energy.length) page.append(el("h2", {}, "Energy"), table(["", "energy"], run.energy, [1]));
    page.append(el("h2", {}, "How it was solved"), el("pre", { tabindex: 0 }, run.summary));
    if (run.warnings.length) page.append(el("h2", {}, "Warnings of the run"), el("pre", { tabindex: 0 }, run.warnings.join("\n")));
  }

  const tabs = el("nav", { role: "tablist", "aria-label": "runs" }, data.runs.length > 1
    ? data.runs.map((r, k) => el("button", { role: "tab", onclick: () => show(k) }, r.label)) : []);
  const page = el("section");
  root.replaceChildren(el("h1", {}, data.title), tabs, page);
  // measures of all runs side by side, where there are several
  const names = [...new Set(data.runs.flatMap(r => Object.keys(r.measures)))];
  if (data.runs.length > 1 && names.length) {
    root.append(el("h2", {}, "Measures of all runs"), table(["run", ...names], data.runs.map(r => [r.label, ...names.map(n => r.measures[n] ?? "–")]), names.map((_, k) => k + 1)));
  }
  root.append(el("h2", {}, `The deck, ${data.file}`));
  if (data.warnings.length) root.append(el("pre", { tabindex: 0 }, data.warnings.join("\n")));
  root.append(el("pre", { tabindex: 0 }, data.deck), el("footer", {}, document.querySelector("meta[name=generator]").content));
  show(0);
})();
