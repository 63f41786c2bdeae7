// One panel: curves of one unit above the common axis, drawn by uPlot.
const HEIGHT = 240;

// ticks in one prefix, with the digits that their distance asks for
const ticks = (unit, scale) => (u, values, axis, space, step) => {
  const factor = 10 ** scale.power;
  let digits = 0;
  const whole = d => { const scaled = Math.abs(step / factor) * 10 ** d; return Math.abs(scaled - Math.round(scaled)) < 1e-6 * scaled; };
  while (digits < 9 && !whole(digits)) digits++;
  return values.map(v => v == null ? "" : (v / factor + 0).toFixed(digits));
};
const decadeTicks = unit => (u, values) => values.map(v => v == null ? "" : si(v, unit || "1", 3).slice(0, unit ? -unit.length : -1).trim());

/*
 * spec: { curves: [{ curve, label, stroke, dash }], unit, x: { name, unit, logarithmic }, logarithmic,
 *         window(): [from, to], onWindow(from, to), onPlace(x), places(): {A, B}, marks, points, legend }
 */
function panel(box, spec) {
  const holder = el("div", { class: "plot", role: "img", "aria-label": `${spec.title}: ${spec.curves.map(c => c.label).join(", ").slice(0, 300)}` });
  box.append(holder);
  let chosen = null; // a range in y that the reader has asked for
  const yscale = { power: 0 }, xscale = { power: 0 }, style = ink();
  const axis = { stroke: style.text, grid: { stroke: style.grid, width: 1 }, ticks: { stroke: style.grid, width: 1 }, font: "12px system-ui, sans-serif" };
  const yRange = () => {
    if (chosen) return chosen;
    const [from, to] = spec.window();
    let low = Infinity, high = -Infinity;
    for (const { curve } of spec.curves) { const [a, b] = curve.range(from, to); low = Math.min(low, a); high = Math.max(high, b); }
    for (const mark of spec.marks ?? []) if (mark.y != null) { low = Math.min(low, mark.y); high = Math.max(high, mark.y); }
    if (spec.logarithmic) return [10 ** Math.floor(Math.log10(Math.max(low, 1e-30))), 10 ** Math.ceil(Math.log10(Math.max(high, 1e-30)))];
    return spec.unit === "dB" || spec.unit === "°" ? [low - 0.05 * (high - low || 1), high + 0.05 * (high - low || 1)] : padded(low, high);
  };
  const data = () => {
    const columns = Math.max(200, holder.clientWidth), [from, to] = spec.window();
    const tables = spec.curves.map(({ curve }) => curve.seen(from, to, columns));
    const [low, high] = yRange();
    spec.curves.forEach((c, k) => { c.dense = way(tables[k][1]) > (high - low) * columns / 8; });
    const same = tables.every(t => t[0].length === tables[0][0].length && spec.curves[0].curve.run === spec.curves[tables.indexOf(t)].curve.run);
    return same ? [tables[0][0], ...tables.map(t => t[1])] : uPlot.join(tables.map(unique));
  };
  // the way up and down: what fills the panel is drawn pale, so that it hides nothing
  const way = y => { let sum = 0; for (let k = 1; k < y.length; k++) sum += Math.abs(y[k] - y[k - 1]); return sum; };
  // curves with points of their own are joined over all instants: both sides of a jump differ by a hair
  const unique = ([x, y]) => {
    for (let k = 1; k < x.length; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + Math.max(Math.abs(x[k - 1]), 1e-30) * 2.3e-16;
    return [x, y];
  };
  const marks = u => {
    const pen = u.ctx, { left, top, width, height } = u.bbox, ratio = devicePixelRatio;
    const line = (x0, y0, x1, y1, stroke, dash = []) => {
      pen.save(); pen.beginPath(); pen.rect(left, top, width, height); pen.clip(); pen.beginPath();
      pen.strokeStyle = stroke; pen.lineWidth = ratio * 1.3; pen.setLineDash(dash.map(d => d * ratio));
      pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke(); pen.restore();
    };
    const X = x => u.valToPos(x, "x", true), Y = y => u.valToPos(y, "y", true);
    for (const m of spec.marks ?? []) {
      if (m.x == null) line(left, Y(m.y), left + width, Y(m.y), m.red ? style.mark : style.text, m.red ? [6, 4] : []);
      else if (m.y == null) line(X(m.x), top, X(m.x), top + height, style.text, [2, 3]);
      else line(X(m.x), Y(m.y), X(m.x), Y(m.to), style.text);
      if (m.text) {
        pen.save(); pen.textAlign = "left"; pen.fillStyle = style.text; pen.font = `${12 * ratio}px system-ui, sans-serif`;
        const gap = 6 * ratio, wide = pen.measureText(m.text).width, fits = X(m.x) + gap + wide <= left + width;
        pen.fillText(m.text, fits ? X(m.x) + gap : Math.max(left, X(m.x) - gap - wide), (Y(m.y) + Y(m.to)) / 2 + 4 * ratio); pen.restore();
      }
    }
    for (const [name, x] of Object.entries(spec.places?.() ?? {})) {
      if (x == null) continue;
      line(X(x), top, X(x), top + height, style.mark);
      pen.save(); pen.textAlign = "left"; pen.fillStyle = style.mark; pen.font = `bold ${13 * ratio}px system-ui, sans-serif`; pen.fillText(name, X(x) + 4 * ratio, top + 13 * ratio); pen.restore();
    }
  };
  const label = (name, unit, scale) => unit ? `${name} [${PLAIN.has(unit) ? "" : PREFIX[scale.power]}${unit}]` : name;
  const plot = new uPlot({
    width: holder.clientWidth || 1000, height: spec.height ?? HEIGHT, pxAlign: 0,
    legend: { show: spec.legend !== false },
    // panels share the cross-hair, not the selection: each would zoom once more
    cursor: { sync: { key: "run", filters: { pub: type => type === "mousemove" || type === "mouseleave" } }, drag: { x: true, y: true, uni: 24, setScale: false }, y: false },
    scales: {
      x: { time: false, auto: false, distr: spec.x.logarithmic ? 3 : 1, range: () => spec.window() },
      y: { auto: true, distr: spec.logarithmic ? 3 : 1, range: yRange },
    },
    axes: [
      { ...axis, space: 70, size: 34, labelSize: 16, labelFont: axis.font, label: () => label(spec.x.name, spec.x.unit, xscale), values: spec.x.logarithmic ? decadeTicks(spec.x.unit) : ticks(spec.x.unit, xscale) },
      { ...axis, space: 28, size: 62, labelSize: 20, labelFont: axis.font, label: () => label(spec.title, spec.unit, yscale), values: spec.logarithmic ? decadeTicks(spec.unit) : ticks(spec.unit, yscale) },
    ],
    series: [
      { label: spec.x.name || "x", value: (u, v) => si(v, spec.x.unit, 6) },
      ...spec.curves.map(c => ({
        label: c.label, stroke: () => c.dense && spec.curves.length > 1 ? pale(c.stroke) : c.stroke, width: 1.5, pxAlign: 0, spanGaps: true, dash: c.dash, points: { show: !!spec.points, size: 7 },
        value: (u, v) => si(v, spec.unit, 5),
      })),
    ],
    hooks: {
      drawAxes: [marks],
      setScale: [(u, key) => {
        const s = u.scales[key], target = key === "x" ? xscale : yscale, unit = key === "x" ? spec.x.unit : spec.unit;
        target.power = PLAIN.has(unit) || (key === "x" ? spec.x.logarithmic : spec.logarithmic) ? 0 : powerOf(Math.max(Math.abs(s.min), Math.abs(s.max)));
      }],
      setSelect: [u => {
        const { left, top, width, height } = u.select;
        if (width <= 2 && height <= 2) return;
        if (height > 2 && height < u.over.clientHeight - 1) chosen = [u.posToVal(top + height, "y"), u.posToVal(top, "y")];
        if (width > 2 && width < u.over.clientWidth - 1) spec.onWindow(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
        else refreshed();
        u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
    },
  }, data(), holder);
  const refresh = () => {
    plot.setData(data(), false);
    plot.batch(() => {
      const [min, max] = spec.window(), [low, high] = yRange();
      plot.setScale("x", { min, max });
      plot.setScale("y", { min: low, max: high });
    });
    plot.redraw(true, true);
  };
  const refreshed = () => { refresh(); spec.onRange?.(); };
  plot.over.addEventListener("wheel", e => {
    e.preventDefault();
    const factor = e.deltaY + e.deltaX < 0 ? 0.8 : 1.25;
    if (e.shiftKey) {
      const at = plot.posToVal(e.offsetY, "y"), [low, high] = yRange();
      chosen = [at - (at - low) * factor, at + (high - at) * factor];
      refreshed();
    } else spec.zoom?.(factor, plot.posToVal(e.offsetX, "x"));
  }, { passive: false });
  let pressed = null;
  plot.over.addEventListener("mousedown", e => { pressed = [e.clientX, e.clientY]; });
  plot.over.addEventListener("mouseup", e => {
    if (pressed && Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) < 3) {
      spec.onPlace?.(plot.posToVal(e.clientX - plot.over.getBoundingClientRect().left, "x"), e.shiftKey);
    }
    pressed = null;
  });
  plot.over.addEventListener("dblclick", () => { chosen = null; spec.all?.(); });
  return {
    plot, refresh,
    reset: () => { chosen = null; },
    zoomY: factor => { const [low, high] = yRange(), m = (low + high) / 2; chosen = [m - (m - low) * factor, m + (high - m) * factor]; refreshed(); },
    resize: () => plot.setSize({ width: holder.clientWidth, height: spec.height ?? HEIGHT }),
    drawn: () => [[Math.min(...plot.data[0]), Math.max(...plot.data[0]), plot.data[0].length], ...plot.data.slice(1).map(d => { const v = d.filter(y => y != null); return [Math.min(...v), Math.max(...v), v.length]; }), [plot.scales.y.min, plot.scales.y.max]],
  };
}
