// Curves of a run: decoded when they are first drawn, the part that is seen, and averages.

// first index with axis[k] >= x
const lower = (axis, x) => {
  let a = 0, b = axis.length;
  while (a < b) { const m = (a + b) >> 1; if (axis[m] < x) a = m + 1; else b = m; }
  return a;
};

class Curve {
  constructor(run, signal) {
    Object.assign(this, { run, name: signal.name, unit: signal.unit, text: signal });
  }
  get axis() { return (this.run.axis ??= decode(this.run.curves.axis, Float64Array)); }
  get values() { return (this.decoded ??= decode(this.text.values, Float32Array)); }

  // lowest and highest between two places
  range(from, to) {
    const a = Math.max(0, lower(this.axis, from) - 1), b = Math.min(this.axis.length, lower(this.axis, to) + 1);
    let low = Infinity, high = -Infinity;
    for (let k = a; k < b; k++) { const y = this.values[k]; if (y < low) low = y; if (y > high) high = y; }
    return [low, high];
  }
  at(x) {
    const k = lower(this.axis, x), last = this.axis.length - 1;
    if (k <= 0) return this.values[0];
    if (k > last) return this.values[last];
    const span = this.axis[k] - this.axis[k - 1];
    return span > 0 ? this.values[k - 1] + (this.values[k] - this.values[k - 1]) * (x - this.axis[k - 1]) / span : this.values[k];
  }
  // mean and root of the mean square between two places: of the lines between the points, or, of a
  // thinned curve, from the averages of its cells
  averages(from, to) {
    if (!(to > from)) return [this.at(from), Math.abs(this.at(from))];
    let sum = 0, square = 0;
    if (this.text.mean) {
      this.mean ??= decode(this.text.mean, Float32Array);
      this.square ??= decode(this.text.square, Float32Array);
      const end = this.axis[this.axis.length - 1];
      for (let c = 0; c < this.mean.length; c++) {
        const a = Math.max(from, this.axis[2 * c]), b = Math.min(to, 2 * c + 2 < this.axis.length ? this.axis[2 * c + 2] : end);
        if (b > a) { sum += (b - a) * this.mean[c]; square += (b - a) * this.square[c]; }
      }
    } else {
      const first = lower(this.axis, from), last = lower(this.axis, to);
      let x = from, y = this.at(from);
      for (let k = first; k <= last; k++) {
        const u = k < last ? this.axis[k] : to, v = k < last ? this.values[k] : this.at(to);
        if (u > x) { sum += (u - x) * (y + v) / 2; square += (u - x) * (y * y + y * v + v * v) / 3; }
        x = u; y = v;
      }
    }
    return [sum / (to - from), Math.sqrt(square / (to - from))];
  }
  // the points between two places, or lowest and highest of each of so many columns
  seen(from, to, columns) {
    const a = Math.max(0, lower(this.axis, from) - 1), b = Math.min(this.axis.length, lower(this.axis, to) + 2);
    if (b - a <= 4 * columns) return [Array.from(this.axis.subarray(a, b)), Array.from(this.values.subarray(a, b))];
    const size = Math.ceil((b - a) / columns), x = [], y = [];
    for (let k = a; k < b; k += size) {
      const end = Math.min(k + size, b);
      let low = this.values[k], high = low;
      for (let i = k + 1; i < end; i++) { const v = this.values[i]; if (v < low) low = v; else if (v > high) high = v; }
      x.push(this.axis[k], this.axis[end - 1]);
      if (this.values[end - 1] >= this.values[k]) y.push(low, high); else y.push(high, low);
    }
    return [x, y];
  }
}

// signals of one unit in groups in which each can be seen to move, as in the program's pictures
const SCALE = 25;
const grouped = (curves, from, to) => {
  const groups = [];
  const items = curves.map(curve => { const [low, high] = curve.range(from, to); return { curve, low, high, swing: high - low }; });
  const still = item => !(item.swing > 1e-6 * Math.max(Math.abs(item.low), Math.abs(item.high)));
  for (const item of [...items].sort((a, b) => b.swing - a.swing)) {
    const home = groups.find(group => {
      const low = Math.min(...group.map(i => i.low)), high = Math.max(...group.map(i => i.high));
      if (still(item)) return low <= item.low && item.high <= high;
      const least = Math.min(item.swing, ...group.filter(i => !still(i)).map(i => i.swing));
      return least * SCALE >= Math.max(high, item.high) - Math.min(low, item.low);
    });
    if (home) home.push(item); else if (groups.length < 3) groups.push([item]); else groups[2].push(item);
  }
  return groups.map(group => curves.filter(c => group.some(i => i.curve === c)));
};
// the range of a panel: zero is part of it where that hides nothing
const padded = (low, high) => {
  if (!(high >= low)) return [0, 1];
  const peak = Math.max(Math.abs(low), Math.abs(high));
  if (high - low <= 1e-7 * peak || peak === 0) { const m = 0.1 * peak || 1; return [low - m, high + m]; }
  if (high - low > 0.4 * peak) { low = Math.min(low, 0); high = Math.max(high, 0); }
  const margin = 0.05 * (high - low);
  return [low - margin, high + margin];
};
