// Numbers, colours and elements of the page: what the other scripts share.
const PREFIX = { "-18": "a", "-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", "0": "", "3": "k", "6": "M", "9": "G", "12": "T" };
const powerOf = size => size > 0 && isFinite(size) ? Math.max(-18, Math.min(12, 3 * Math.floor(Math.log10(size) / 3 + 1e-9))) : 0;
// units that take no prefix
const PLAIN = new Set(["", "°", "dB", "°C"]);

const el = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else if (value !== false && value != null) node.setAttribute(key, value === true ? "" : value);
  }
  for (const child of children.flat()) if (child != null) node.append(child);
  return node;
};

const si = (value, unit = "", digits = 5) => {
  if (value == null || !isFinite(value)) return "–";
  if (value === 0 || PLAIN.has(unit)) return `${+value.toPrecision(digits)} ${unit}`.trim();
  const power = powerOf(Math.abs(+value.toPrecision(digits))); // 0.9999999 is 1
  return `${+(value / 10 ** power).toPrecision(digits)} ${PREFIX[power]}${unit}`;
};
// a number without a unit
const plain = (v, digits = 7) => Math.abs(v) < 1e-3 && v !== 0 ? (+v.toPrecision(digits)).toExponential() : String(+v.toPrecision(digits));
// what a person writes: 1.2m, 4.9e-3, 30 µs
const parsed = text => {
  const match = /^\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(meg|[afpnuµmkMGT]?)/i.exec(text);
  if (!match) return NaN;
  const letter = match[2].toLowerCase() === "meg" ? "M" : match[2] === "u" ? "µ" : match[2] === "K" ? "k" : match[2];
  const power = Object.keys(PREFIX).find(key => PREFIX[key] === letter);
  return parseFloat(match[1]) * 10 ** Number(power ?? 0);
};

const decode = (text, type) => {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new type(bytes.buffer);
};

// dark as the reader's system, light on paper
let printing = false;
const isDark = () => !printing && matchMedia("(prefers-color-scheme: dark)").matches;
const redrawn = new Set();
const redraw = () => redrawn.forEach(f => f());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
addEventListener("beforeprint", () => { printing = true; redraw(); });
addEventListener("afterprint", () => { printing = false; redraw(); });

// distinguishable with colour-blind eyes (after Okabe and Ito), lighter on a dark ground
const LIGHT = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#8C564B"];
const NIGHT = ["#56B4E9", "#E69F00", "#2BD4A4", "#E58FC0", "#F0E442", "#6FA8FF", "#C0C0C0", "#D39B7F"];
const colour = k => (isDark() ? NIGHT : LIGHT)[k % LIGHT.length];
const ink = () => isDark() ? { text: "#9da7b3", grid: "#30363d", mark: "#ff7b72" } : { text: "#57606a", grid: "#e6e9ec", mark: "#cf222e" };
const pale = c => c.startsWith("rgb") ? c.replace(")", " / 0.3)").replaceAll(",", " ") : `${c}4d`;
// the colour map of the pictures, at five places of it
const VIRIDIS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
const shade = part => {
  const low = isDark() ? 0.3 : 0, high = isDark() ? 1 : 0.9;
  const x = 4 * (low + (high - low) * Math.max(0, Math.min(1, part))), k = Math.min(3, Math.floor(x));
  return `rgb(${VIRIDIS[k].map((c, j) => Math.round(c + (x - k) * (VIRIDIS[k + 1][j] - c))).join(",")})`;
};
const isDecades = values => Math.min(...values) > 0 && Math.max(...values) > 30 * Math.min(...values);
// where each value lies between the lowest and the highest, on decades if they spread over them
const parts = values => {
  const f = isDecades(values) ? Math.log : x => x;
  const low = f(Math.min(...values)), high = f(Math.max(...values));
  return values.map(v => high > low ? (f(v) - low) / (high - low) : 0.5);
};
