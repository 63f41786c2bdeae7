// Tables and the pictures that are not over the axis: who conducts, spectra, losses, measures.
function table(head, rows, numeric = []) {
  const body = el("tbody");
  const size = cell => { const text = String(cell?.dataset?.value ?? cell); return parsed(text); };
  const fill = list => body.replaceChildren(...list.map(r => el("tr", {}, r.map((c, k) => el("td", { class: numeric.includes(k) ? "n" : null }, c instanceof Node ? c : String(c))))));
  let order = 0, column = -1;
  const sort = k => {
    order = column === k ? -order || 1 : 1; column = k;
    fill([...rows].sort((a, b) => order * (numeric.includes(k) ? size(a[k]) - size(b[k]) : String(a[k]).localeCompare(String(b[k])))));
  };
  fill(rows);
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, head.map((h, k) => el("th", { scope: "col" }, el("button", { onclick: () => sort(k) }, h))))), body));
}

// who conducts when: the shade of a pixel is the part of its time for which the element is on
function modeStrip(run, box, [low, high], plot) {
  const { elements, left_out } = run.modes;
  if (!elements.length && !left_out) return;
  if (!box.firstChild) {
    box.append(el("h2", {}, "Who conducts when"));
    const grid = el("div", { class: "strip" });
    elements.forEach(m => {
      m.times = decode(m.changes, Float64Array);
      grid.append(el("span", { title: m.element }, m.element), el("canvas", { role: "img", height: 14, "aria-label": `${m.element}: ${m.times.length} changes` }));
    });
    box.append(grid);
    if (left_out) box.append(el("p", { class: "hint" }, `${left_out} more elements change too often to be kept here`));
  }
  // instants below those of the curves; a strip has a border of one pixel
  const grid = box.querySelector(".strip"), curves = plot?.getBoundingClientRect();
  if (curves?.width) grid.style.gridTemplateColumns = `${curves.left - grid.getBoundingClientRect().left - 1}px ${curves.width + 2}px`;
  box.querySelectorAll("canvas").forEach((canvas, k) => {
    const m = elements[k], width = (canvas.width = Math.max(100, canvas.clientWidth)), pen = canvas.getContext("2d");
    pen.fillStyle = colour(k);
    const share = new Float64Array(width), scale = width / (high - low);
    let index = lower(m.times, low), on = m.on !== (index % 2 === 1), from = low;
    for (; from < high; index++, on = !on) {
      const to = index < m.times.length ? Math.min(m.times[index], high) : high;
      if (on) {
        const a = (from - low) * scale, b = (to - low) * scale;
        for (let x = Math.floor(a); x < Math.min(width, Math.ceil(b)); x++) share[x] += Math.min(b, x + 1) - Math.max(a, x);
      }
      from = to;
    }
    share.forEach((s, x) => { if (s > 0) { pen.globalAlpha = Math.min(1, s); pen.fillRect(x, 0, 1, 14); } });
  });
}

// bars of a table's numbers
const bar = (value, most, text) => el("span", { class: "bar", "data-value": text }, el("i", { style: `width:${most > 0 ? Math.max(0, 100 * Math.abs(value) / most).toFixed(1) : 0}%`, class: value < 0 ? "out" : null }), el("b", {}, text));

function spectrumOf(s) {
  const most = Math.max(...s.amplitudes), floor = 1e-12 * s.rms;
  const lines = s.amplitudes.map((a, k) => [k + 1, a, s.phases[k]]).filter(([, a]) => a > floor).sort((p, q) => q[1] - p[1]);
  const zero = s.amplitudes.length - lines.length;
  const note = `mean ${si(Math.abs(s.mean) > floor ? s.mean : 0, s.unit, 6)}, RMS ${si(s.rms, s.unit, 6)}${s.distortion == null ? "" : `, THD ${+(100 * s.distortion).toPrecision(4)} %`}${zero ? `; ${zero} other harmonics are zero to rounding` : ""}`;
  const decibels = a => 20 * Math.log10(a / most);
  // lines over the order, in decibels below the largest: 100 dB high
  const width = 900, height = 180, count = s.amplitudes.length, x = k => 40 + (width - 50) * k / (count + 0.5);
  const NS = "http://www.w3.org/2000/svg", svg = document.createElementNS(NS, "svg");
  const draw = (tag, attributes, text) => { const n = document.createElementNS(NS, tag); for (const [k, v] of Object.entries(attributes)) n.setAttribute(k, v); if (text) n.textContent = text; svg.append(n); return n; };
  svg.setAttribute("viewBox", `0 0 ${width} ${height + 24}`); svg.setAttribute("class", "spectrum"); svg.setAttribute("role", "img"); svg.setAttribute("aria-label", `harmonics of ${s.signal}`);
  for (let d = 0; d >= -100; d -= 20) { const y = 8 - d * (height - 16) / 100; draw("line", { x1: 40, x2: width, y1: y, y2: y, class: "grid" }); draw("text", { x: 36, y: y + 4, "text-anchor": "end" }, `${d}`); }
  lines.forEach(([k, a, phase]) => {
    const y = 8 - Math.max(-100, decibels(a)) * (height - 16) / 100;
    const line = draw("line", { x1: x(k), x2: x(k), y1: height - 8, y2: y, class: "stem" });
    const title = document.createElementNS(NS, "title");
    title.textContent = `${k}: ${si(k * s.frequency, "Hz")}, ${si(a, s.unit)}, ${phase.toFixed(1)}°`;
    line.append(title);
  });
  const every = Math.max(1, Math.ceil(count / 16));
  for (let k = every; k <= count; k += every) draw("text", { x: x(k), y: height + 16, "text-anchor": "middle" }, si(k * s.frequency, "Hz", 3));
  return [el("h2", {}, `Harmonics of ${s.signal}`), el("p", {}, note), svg, el("p", { class: "hint" }, "dB below the largest line"), table(["order", "frequency", "amplitude", "phase"],
    lines.slice(0, 30).map(([k, a, p]) => [k, si(k * s.frequency, "Hz", 6), bar(a, most, si(a, s.unit, 6)), `${p.toFixed(2)}°`]), [0, 1, 2, 3]),
  lines.length > 30 ? el("p", { class: "hint" }, `and ${lines.length - 30} smaller ones`) : null];
}

function lossesOf(t) {
  const spent = t.rows.filter(([, power, , switching]) => power > 0 || switching > 0), most = Math.max(...spent.map(r => r[1] + r[3]));
  const note = `delivered ${si(t.delivered, "W", 6)}, useful ${si(t.useful, "W", 6)}, lost ${si(t.lost, "W", 6)}${t.switching ? `, in switching ${si(t.switching, "W", 6)}` : ""}${t.efficiency == null ? "" : `, efficiency ${(100 * t.efficiency).toFixed(2)} %`}`;
  const hot = t.rows.some(r => r[4] != null), switched = t.rows.some(r => r[3]);
  const head = ["element", "average power", "RMS current", ...(switched ? ["switching"] : []), ...(hot ? ["junction"] : [])];
  const seen = t.rows.filter(r => Math.abs(r[1]) > 1e-12 * Math.max(...t.rows.map(q => Math.abs(q[1]))) || r[3]);
  return [el("h2", {}, "Losses"), el("p", {}, note), table(head, seen.map(([name, power, rms, switching, junction]) =>
    [name, bar(power, most, si(power, "W")), si(rms, "A"), ...(switched ? [si(switching, "W")] : []), ...(hot ? [si(junction, "°C", 4)] : [])]), head.map((_, k) => k).slice(1))];
}

// measures of a family over the parameter, a curve for each combination of the others
function measuresOf(group, box) {
  const names = [...new Set(group.runs.flatMap(r => Object.keys(r.measures)))].filter(n => group.runs.some(r => r.measures[n] != null));
  if (!names.length || group.runs.length < 2) return;
  box.append(el("h2", {}, "Measures of all runs"));
  const counts = group.parameters.map(p => new Set(group.runs.map(r => r.parameters[p])).size);
  const last = group.parameters[counts.indexOf(Math.max(...counts))];
  if (last != null && Math.max(...counts) > 2) {
    const xs = group.runs.map(r => r.parameters[last]), range = [Math.min(...xs), Math.max(...xs)], logarithmic = isDecades(xs);
    const plots = el("div", { class: "small" });
    let panels = [];
    const build = () => {
      plots.replaceChildren();
      panels = [];
      for (const name of names) {
        const sets = new Map();
        group.runs.forEach(r => {
          if (r.measures[name] == null) return;
          const key = group.parameters.filter(p => p !== last).map(p => `${p} = ${si(r.parameters[p])}`).join(", ");
          sets.set(key, [...(sets.get(key) ?? []), [r.parameters[last], r.measures[name]]]);
        });
        const list = [...sets].map(([label, points], k) => {
          points.sort((a, b) => a[0] - b[0]);
          const run = { axis: Float64Array.from(points, p => p[0]) }, curve = new Curve(run, { name, unit: "" });
          curve.decoded = Float64Array.from(points, p => p[1]);
          return { curve, label: label || name, stroke: sets.size > LIGHT.length ? shade(k / sets.size) : colour(k) };
        });
        panels.push(panel(plots, { curves: list, title: name, unit: "", x: { name: last, unit: "", logarithmic }, window: () => range, onWindow: () => {}, points: true, legend: sets.size > 1, height: 200 }));
      }
    };
    box.append(plots);
    new ResizeObserver(() => panels.forEach(p => p.resize())).observe(plots);
    redrawn.add(build);
    build();
  }
  box.append(table(["run", ...names], group.runs.map(r => [r.label, ...names.map(n => r.measures[n] == null ? "–" : plain(r.measures[n]))]), names.map((_, k) => k + 1)));
}
