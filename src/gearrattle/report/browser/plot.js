// needs: host, numerals
// Figures on canvas: a chart of report/plots/chart.py, with panels, zoom, a cursor and a readout, light or dark.
// Drag to zoom (a flat box: across only), double click or 0 to reset, arrows move the cursor, + and - zoom, shift pans;
// an entry of the legend hides what it explains.

const { element } = host;
const { numeral, raised } = numerals;
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';
const SMALL = FONT.replace("12px", "11px");
const BOLD = `600 ${FONT}`;
const MUTED = "#5d6b7a";
const NO_VALUE = "#6f7a86"; // of report/plots/palette.py: cells without a value, hatched on the background
const HATCH = 6; // px across between two strokes of hatching
const SHADES = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];
const MARKS = 0.22; // of what is drawn: room above and below for the marks of impacts
const LEAST_BOX = 8; // px: less is a click
const DASHES = { dashed: [5, 3], dotted: [2, 2] }; // px on and off, as in report/plots/shapes.py

// ---- ticks and colours

// Round values between two limits: some three of them or more.
function ticksOf(low, high, most) {
  const ticks = ticksAt(low, high, most);
  return ticks.length < 3 ? ticksAt(low, high, 2.2 * most) : ticks;
}

function ticksAt(low, high, most) {
  const raw = (high - low) / Math.max(1, most);
  const size = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((factor) => factor * size).find((candidate) => candidate >= raw);
  const first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first;
  return Array.from({ length: Math.max(0, count + 1) }, (_, k) => (first + k) * step)
    .map((value) => [Math.abs(value) < 1e-12 * step ? 0 : value, numeral(Number(value.toPrecision(12)), 8)]);
}

function decadesOf(low, high) {
  const first = Math.ceil(low - 1e-9), last = Math.floor(high + 1e-9);
  const every = Math.max(1, Math.ceil((last - first) / 7));
  const ticks = [];
  for (let k = first; k <= last; k += every) ticks.push([k, Math.abs(k) <= 3 ? numeral(10 ** k) : raised(k)]);
  return ticks.length > 1 ? ticks : ticksOf(low, high, 4).map(([value]) => [value, numeral(10 ** value, 3)]);
}

function channels(colour) {
  const full = colour.length === 4 ? [...colour.slice(1)].map((c) => c + c).join("") : colour.slice(1);
  return [0, 2, 4].map((k) => parseInt(full.slice(k, k + 2), 16));
}

function luminance(rgb) {
  const [r, g, b] = rgb.map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}

function contrast(one, other) {
  const [a, b] = [luminance(one), luminance(other)].sort((x, y) => y - x);
  return (a + 0.05) / (b + 0.05);
}

function shade(share) {
  const position = Math.min(1, Math.max(0, share)) * (SHADES.length - 1);
  const k = Math.min(SHADES.length - 2, Math.floor(position)), part = position - k;
  const [a, b] = [channels(SHADES[k]), channels(SHADES[k + 1])];
  return a.map((value, c) => Math.round(value + part * (b[c] - value)));
}

// Colours of the element's place, from custom properties; a chart's own colours are kept legible on its paper.
function themeOf(el) {
  const css = getComputedStyle(el);
  const read = (name, fallback) => {
    const value = css.getPropertyValue(name).trim();
    return /^#([0-9a-f]{3}|[0-9a-f]{6})$/i.test(value) ? value : fallback;
  };
  const theme = {
    paper: read("--panel", "#ffffff"), ink: read("--ink", "#17212b"), muted: read("--muted", "#5d6b7a"),
    line: read("--line", "#dfe4ea"), accent: read("--accent", "#0b5c8f"),
  };
  const named = { "#17212b": theme.ink, "#5d6b7a": theme.muted, "#dfe4ea": theme.line, "#ffffff": theme.paper, "#0b5c8f": theme.accent };
  const made = new Map();
  theme.colour = (colour) => {
    if (named[colour]) return named[colour];
    if (!/^#[0-9a-f]{6}$/i.test(colour)) return theme.ink;
    if (!made.has(colour)) made.set(colour, legible(colour, theme));
    return made.get(colour);
  };
  // Areas keep their colours: what they mean is told by a scale of them.
  theme.area = (colour) => named[colour] ?? colour;
  return theme;
}

function legible(colour, theme) {
  const paper = channels(theme.paper), ink = channels(theme.ink);
  let mixed = channels(colour);
  for (let k = 0; k < 8 && contrast(mixed, paper) < 3; k++) mixed = mixed.map((c, i) => Math.round(c + 0.2 * (ink[i] - c)));
  return `#${mixed.map((c) => c.toString(16).padStart(2, "0")).join("")}`;
}

// ---- data

function decoded(value) {
  if (Array.isArray(value)) return value.map(decoded);
  if (value === null || typeof value !== "object" || ArrayBuffer.isView(value)) return value;
  if (value.f8 ?? value.f4) {
    const bytes = Uint8Array.from(atob(value.f8 ?? value.f4), (sign) => sign.charCodeAt(0));
    return Object.assign(value.f8 ? new Float64Array(bytes.buffer) : new Float32Array(bytes.buffer), { shape: value.shape });
  }
  if (value.count) return Float64Array.from({ length: value.count }, (_, k) => value.first + k * value.step);
  return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, decoded(entry)]));
}

const PANEL = { title: "", unit: "", x_title: "", lines: [], bars: [], bands: [], rules: [], labels: [], cells: [], marks: [],
  x_ticks: [], y_ticks: [], x_range: null, y_range: null, x_log: false, y_log: false, note: "", heat: null, equal_scales: false };
const CHART = { key: "", title: "", caption: "", columns: 1, panel_height: 132, share_x: true, legend: [], panels: [] };

function extent(low, high, margin) {
  if (!(low <= high)) return [0, 1];
  const spread = high - low || Math.abs(high) * 0.1 || 1;
  return [low - margin * spread, high + margin * spread];
}

// A map of numbers as a picture, one point a cell; what has no value stays clear.
function pictureOf(heat) {
  const [rows, columns] = heat.values.shape;
  const image = new OffscreenCanvas(columns, rows), inner = image.getContext("2d"), data = inner.createImageData(columns, rows);
  for (let r = 0; r < rows; r++) {
    for (let k = 0; k < columns; k++) {
      const value = heat.values[r * columns + k], at = 4 * ((rows - 1 - r) * columns + k);
      if (Number.isFinite(value)) data.data.set([...shade((value - heat.low) / (heat.high - heat.low || 1)), 255], at);
    }
  }
  inner.putImageData(data, 0, 0);
  return image;
}

// ---- one panel

class Panel {
  constructor(figure, panel, index) {
    this.figure = figure;
    this.index = index;
    this.canvas = element("canvas", { tabindex: 0, role: "img", class: "gr-canvas" });
    this.readout = element("span", { class: "gr-readout", "aria-live": "polite" });
    this.el = element("div", { class: "gr-panel" }, this.canvas, this.readout);
    this.zoom = null;
    this.box = null;
    this.cursor = null;
    this.marked = []; // points that stay marked: {x, y}
    this.set(panel);
    this.listen();
  }

  set(panel) {
    this.whole = { ...PANEL, ...panel };
    this.panel = { ...this.whole };
    for (const kind of ["lines", "bars", "cells"]) this.panel[kind] = this.whole[kind].filter((item) => this.figure.isShown(item));
    this.canvas.setAttribute("aria-label", `${this.figure.chart.title}: ${this.panel.title} ${this.panel.unit}`.trim());
  }

  get hasAxis() {
    const { chart } = this.figure;
    return !chart.share_x || this.index + this.figure.columns >= chart.panels.length;
  }

  forward(value, axis) { return this.panel[`${axis}_log`] ? Math.log10(value) : value; }
  back(value, axis) { return this.panel[`${axis}_log`] ? 10 ** value : value; }

  // Limits of the axes, in the coordinates of the axes (logarithms of a logarithmic one).
  limits() {
    const { panel } = this;
    const x = this.zoom?.x ?? (panel.x_range ? panel.x_range.map((v) => this.forward(v, "x")) : this.fitted("x", null));
    const isWhole = !this.zoom;
    const y = this.zoom?.y ?? (panel.y_range && isWhole ? panel.y_range.map((v) => this.forward(v, "y")) : this.fitted("y", isWhole ? null : x));
    return panel.equal_scales ? this.equal(x, y) : { x, y };
  }

  equal(x, y) {
    const across = (x[1] - x[0]) / this.width, up = (y[1] - y[0]) / this.height;
    const widened = ([low, high], size, scale) => [(low + high - size * scale) / 2, (low + high + size * scale) / 2];
    return across > up ? { x, y: widened(y, this.height, across) } : { x: widened(x, this.width, up), y };
  }

  // The range of everything on an axis; of y within a window of x.
  fitted(axis, within) {
    let low = Infinity, high = -Infinity;
    const take = (value) => {
      const v = this.forward(value, axis);
      if (Number.isFinite(v)) { if (v < low) low = v; if (v > high) high = v; }
    };
    const other = axis === "x" ? "y" : "x";
    for (const line of this.panel.lines) {
      const values = line[axis], partner = line[other];
      for (let k = 0; k < values.length; k++) {
        if (within) { const p = this.forward(partner[k], "x"); if (p < within[0] || p > within[1]) continue; }
        take(values[k]);
      }
    }
    for (const bars of this.panel.bars) {
      if (axis === "x") { take(bars.edges[0]); take(bars.edges[bars.edges.length - 1]); }
      else { bars.heights.forEach((h, k) => take(h + (bars.base?.[k] ?? 0))); if (!this.panel.y_log) take(0); }
    }
    const [first, second] = axis === "x" ? ["left", "right"] : ["low", "high"];
    for (const cells of this.panel.cells) { cells[first].forEach(take); cells[second].forEach(take); }
    if (this.panel.heat) this.panel.heat[`${axis}_range`].forEach(take);
    const isHeat = this.panel.heat || (axis === "x" && this.panel.lines.every((line) => (line.mark ?? "line") === "line"));
    const margin = axis === "y" && this.panel.marks.length ? MARKS : 0.06;
    return extent(low, high, isHeat ? 0 : margin);
  }

  layout() {
    const bottom = this.hasAxis ? (this.panel.x_title ? 38 : 24) : 8;
    const width = this.figure.panelWidth, height = this.figure.chart.panel_height + (this.hasAxis ? bottom - 8 : 0) + 26;
    this.size = [width, height];
    this.left = 66; this.top = 24;
    this.width = Math.max(40, width - this.left - 14);
    this.height = Math.max(30, height - this.top - bottom);
    const ratio = globalThis.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${height}px`;
    this.ratio = ratio;
  }

  px(v) { const [a, b] = this.now.x; return this.left + ((v - a) / (b - a)) * this.width; }
  py(v) { const [a, b] = this.now.y; return this.top + (1 - (v - a) / (b - a)) * this.height; }
  x(value) { return this.px(this.forward(value, "x")); }
  y(value) { return this.py(this.forward(value, "y")); }

  draw() {
    if (!this.size) this.layout();
    const c = this.canvas.getContext("2d"), { theme } = this.figure;
    this.now = this.limits();
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    c.clearRect(0, 0, ...this.size);
    c.fillStyle = theme.paper;
    c.fillRect(0, 0, ...this.size);
    this.drawAxes(c, theme);
    c.save();
    c.beginPath();
    c.rect(this.left, this.top, this.width, this.height);
    c.clip();
    this.drawContent(c, theme);
    c.restore();
    c.strokeStyle = theme.line;
    c.strokeRect(this.left + 0.5, this.top + 0.5, this.width - 1, this.height - 1);
    this.picture = new OffscreenCanvas(this.canvas.width, this.canvas.height);
    this.picture.getContext("2d").drawImage(this.canvas, 0, 0);
    this.drawCursor(c, theme);
  }

  // The cursor moves over what is drawn already.
  drawOver() {
    const c = this.canvas.getContext("2d");
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.drawImage(this.picture, 0, 0);
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.drawCursor(c, this.figure.theme);
  }

  drawAxes(c, theme) {
    const { panel } = this, [x, y] = [this.now.x, this.now.y];
    const own = (ticks, axis, [low, high]) => ticks.map(([v, word]) => [this.forward(v, axis), word]).filter(([v]) => v >= low && v <= high);
    const xTicks = panel.x_ticks.length ? own(panel.x_ticks, "x", x) : panel.x_log ? decadesOf(...x) : ticksOf(...x, Math.max(3, this.width / 90));
    const yTicks = panel.y_ticks.length ? own(panel.y_ticks, "y", y) : panel.y_log ? decadesOf(...y) : ticksOf(...y, Math.max(2, this.height / 34));
    c.lineWidth = 1; c.strokeStyle = theme.line; c.fillStyle = theme.muted; c.font = SMALL;
    c.textBaseline = "middle"; c.textAlign = "right";
    for (const [v, word] of yTicks) {
      const at = Math.round(this.py(v)) + 0.5;
      c.beginPath(); c.moveTo(this.left, at); c.lineTo(this.left + this.width, at); c.stroke();
      c.fillText(word, this.left - 6, at, this.left - 10);
    }
    c.textBaseline = "top"; c.textAlign = "center";
    for (const [v, word] of xTicks) {
      const at = Math.round(this.px(v)) + 0.5;
      c.beginPath(); c.moveTo(at, this.top + this.height); c.lineTo(at, this.top + this.height - 4); c.stroke();
      if (this.hasAxis) c.fillText(word, at, this.top + this.height + 5);
    }
    if (this.hasAxis && panel.x_title) c.fillText(panel.x_title, this.left + this.width / 2, this.top + this.height + 22);
    c.textAlign = "left"; c.textBaseline = "alphabetic"; c.font = BOLD; c.fillStyle = theme.ink;
    c.fillText(panel.title, this.left, this.top - 8);
    const after = this.left + c.measureText(panel.title).width + 8;
    c.font = FONT; c.fillStyle = theme.muted;
    c.fillText(panel.unit, after, this.top - 8, Math.max(10, this.left + this.width - after));
  }

  drawContent(c, theme) {
    const { panel } = this;
    if (panel.heat) this.drawHeat(c);
    for (const band of panel.bands) this.drawBand(c, theme, band);
    for (const cells of panel.cells) {
      c.beginPath();
      for (let k = 0; k < cells.left.length; k++) {
        const [a, b, t, u] = [this.x(cells.left[k]), this.x(cells.right[k]), this.y(cells.high[k]), this.y(cells.low[k])].map(Math.round);
        c.rect(a, t, Math.max(1, b - a), Math.max(1, u - t));
      }
      if (cells.colour === NO_VALUE) this.hatch(c, theme);
      else { c.fillStyle = theme.area(cells.colour); c.fill(); }
    }
    for (const bars of panel.bars) this.drawBars(c, theme, bars);
    for (const rule of panel.rules) this.drawRule(c, theme, rule);
    for (const line of panel.lines) this.drawLine(c, theme, line);
    this.drawMarks(c, theme);
    c.font = SMALL;
    for (const label of panel.labels) {
      c.fillStyle = theme.colour(label.colour);
      const isAbove = label.side === "above", isAt = label.side === "at";
      const at = [this.x(label.x) + (isAbove || isAt ? 0 : 5), this.y(label.y) - (isAbove ? 3 : 0)];
      c.textAlign = isAbove ? "right" : isAt ? "center" : "left"; c.textBaseline = isAbove ? "bottom" : "middle";
      if (panel.heat) { c.strokeStyle = theme.paper; c.lineWidth = 4; c.lineJoin = "round"; c.strokeText(label.words, ...at); }
      c.fillText(label.words, ...at);
    }
    if (panel.note) {
      c.fillStyle = theme.muted; c.font = FONT; c.textAlign = "center"; c.textBaseline = "middle";
      c.fillText(panel.note, this.left + this.width / 2, this.top + this.height / 2, this.width);
    }
  }

  // Strokes within the path: what has no value is told from every colour, and without colours.
  hatch(c, theme) {
    const first = this.left + this.top, last = first + this.width + this.height;
    c.save();
    c.clip();
    c.strokeStyle = theme.muted; c.lineWidth = 1;
    c.beginPath();
    for (let sum = Math.ceil(first / HATCH) * HATCH; sum < last; sum += HATCH) { c.moveTo(sum - this.top, this.top); c.lineTo(sum - this.top - this.height, this.top + this.height); }
    c.stroke();
    c.restore();
  }

  drawHeat(c) {
    const { heat } = this.panel;
    heat.picture ??= pictureOf(heat);
    const [a, b] = heat.x_range.map((v) => this.x(v)), [u, t] = heat.y_range.map((v) => this.y(v));
    c.imageSmoothingEnabled = false;
    c.drawImage(heat.picture, a, t, b - a, u - t);
  }

  drawBand(c, theme, band) {
    const along = band.along ?? "y", isX = along === "x";
    const edges = [band.low, band.high].map((v) => (v === null ? null : isX ? this.x(v) : this.y(v)));
    c.fillStyle = theme.colour(band.colour); c.globalAlpha = Math.min(1, (band.opacity ?? 0.08) * 1.4);
    if (isX) { const a = edges[0] ?? this.left, b = edges[1] ?? this.left + this.width; c.fillRect(a, this.top, b - a, this.height); }
    else { const b = edges[0] ?? this.top + this.height, a = edges[1] ?? this.top; c.fillRect(this.left, a, this.width, b - a); }
    c.globalAlpha = 1;
  }

  drawBars(c, theme, bars) {
    c.fillStyle = theme.colour(bars.colour); c.globalAlpha = 0.85;
    const floor = this.panel.y_log ? this.top + this.height : this.y(0);
    for (let k = 0; k < bars.heights.length; k++) {
      const base = bars.base?.[k] ?? 0;
      const [a, b] = [this.x(bars.edges[k]), this.x(bars.edges[k + 1])];
      const top = this.y(base + bars.heights[k]), foot = base ? this.y(base) : floor;
      if (Number.isFinite(top)) c.fillRect(a, Math.min(top, foot), Math.max(1, b - a - (b - a > 4 ? 1 : 0)), Math.abs(foot - top));
    }
    c.globalAlpha = 1;
  }

  drawRule(c, theme, rule) {
    const isX = rule.along === "x", at = Math.round(isX ? this.x(rule.at) : this.y(rule.at)) + 0.5;
    c.strokeStyle = theme.colour(rule.colour ?? "#9aa5b1"); c.lineWidth = 1; c.setLineDash(rule.dashed === false ? [] : [2, 2]);
    c.beginPath();
    if (isX) { c.moveTo(at, this.top); c.lineTo(at, this.top + this.height); } else { c.moveTo(this.left, at); c.lineTo(this.left + this.width, at); }
    c.stroke(); c.setLineDash([]);
    if (!rule.label) return;
    c.font = SMALL; c.fillStyle = theme.muted; c.textAlign = isX ? "left" : "right"; c.textBaseline = isX ? "top" : "bottom";
    c.fillText(rule.label, isX ? at + 4 : this.left + this.width - 4, isX ? this.top + 3 : at - 2);
  }

  drawLine(c, theme, line) {
    const { x, y } = line, colour = theme.colour(line.colour ?? "#0b5c8f");
    c.globalAlpha = line.opacity ?? 1;
    if (line.mark === "points") {
      c.fillStyle = colour;
      const radius = Math.max(0.8, (line.width ?? 4) / 2), isSmall = radius < 1.3 || x.length > 4000;
      for (let k = 0; k < x.length; k++) {
        const [a, b] = [this.x(x[k]), this.y(y[k])];
        if (isSmall) c.fillRect(a - radius, b - radius, 2 * radius, 2 * radius);
        else { c.beginPath(); shapeOf(c, line.shape, a, b, radius); c.fill(); }
      }
    } else {
      c.strokeStyle = colour; c.lineWidth = line.width ?? 1.3; c.lineJoin = "round"; c.setLineDash(DASHES[line.dash] ?? []);
      c.beginPath();
      this.trace(c, x, y);
      c.stroke(); c.setLineDash([]);
    }
    c.globalAlpha = 1;
  }

  // A path through points, lifted where one is missing; of very many without those that hide in a column of pixels.
  trace(c, x, y) {
    const isThinned = x.length > 4 * this.width;
    let column = NaN, high = 0, low = 0;
    for (let k = 0; k < x.length; k++) {
      const a = this.x(x[k]), b = this.y(y[k]), isSame = isThinned && Math.abs(a - column) < 0.5;
      if (!Number.isFinite(a) || !Number.isFinite(b)) column = NaN;
      else if (!isSame || b < high - 0.5 || b > low + 0.5) {
        if (Number.isNaN(column)) c.moveTo(a, b); else c.lineTo(a, b);
        if (!isSame) { column = a; high = low = b; }
        high = Math.min(high, b); low = Math.max(low, b);
      }
    }
  }

  // Impacts: a tick at the edge of the panel on their side, as long as they are hard.
  drawMarks(c, theme) {
    for (const marks of this.panel.marks) {
      const hardest = marks.size.reduce((most, size) => Math.max(most, size), 0) || 1;
      const alpha = Math.min(1, Math.max(0.25, this.width / (2 * marks.x.length + 1)));
      for (let k = 0; k < marks.x.length; k++) {
        const isDrive = marks.up[k] > 0, long = 3 + 0.12 * this.height * (marks.size[k] / hardest);
        const a = Math.round(this.x(marks.x[k])) + 0.5, foot = isDrive ? this.top : this.top + this.height;
        c.strokeStyle = theme.colour(isDrive ? "#0072b2" : "#d55e00"); c.lineWidth = 1; c.globalAlpha = alpha;
        c.beginPath(); c.moveTo(a, foot); c.lineTo(a, foot + (isDrive ? long : -long)); c.stroke();
      }
      c.globalAlpha = 1;
    }
  }

  drawCursor(c, theme) {
    if (this.box) {
      const [a, b, t, u] = this.boxEdges();
      c.fillStyle = theme.accent; c.globalAlpha = 0.15; c.fillRect(a, t, b - a, u - t); c.globalAlpha = 1;
    }
    c.strokeStyle = theme.colour("#a8123e"); c.lineWidth = 2.2;
    for (const { x, y } of this.marked) { c.beginPath(); c.arc(this.x(x), this.y(y), 6, 0, 7); c.stroke(); }
    if (!this.cursor) return;
    const at = this.x(this.cursor.x);
    if (at < this.left || at > this.left + this.width) return;
    c.strokeStyle = theme.muted; c.lineWidth = 1; c.setLineDash([2, 3]);
    c.beginPath(); c.moveTo(at, this.top); c.lineTo(at, this.top + this.height); c.stroke(); c.setLineDash([]);
    for (const point of this.cursor.points ?? []) {
      c.fillStyle = theme.colour(point.colour); c.strokeStyle = theme.paper; c.lineWidth = 2;
      c.beginPath(); c.arc(this.x(point.x), this.y(point.y), 4, 0, 7); c.fill(); c.stroke();
    }
  }

  // ---- pointer and keys

  listen() {
    const { canvas } = this;
    const at = (event) => { const frame = canvas.getBoundingClientRect(); return [event.clientX - frame.left, event.clientY - frame.top]; };
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      canvas.setPointerCapture(event.pointerId);
      this.box = { from: at(event), to: at(event), isPan: event.shiftKey, begin: this.now };
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = at(event);
      if (!this.box) { this.point(now); return; }
      this.box.to = now;
      if (this.box.isPan) this.panTo(now); else this.drawOver();
    });
    canvas.addEventListener("pointerup", (event) => { const { box } = this; this.box = null; if (box) this.release(box, at(event)); });
    canvas.addEventListener("pointercancel", () => { this.box = null; this.drawOver(); });
    canvas.addEventListener("pointerleave", () => this.figure.leave());
    canvas.addEventListener("dblclick", () => this.figure.reset());
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.altKey) return; // the page scrolls, unless it is asked to zoom
      event.preventDefault();
      this.magnify(event.deltaY < 0 ? 0.8 : 1.25, (at(event)[0] - this.left) / this.width);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  boxEdges() {
    let [[a, t], [b, u]] = [this.box.from, this.box.to];
    if (a > b) [a, b] = [b, a];
    if (t > u) [t, u] = [u, t];
    const isFlat = u - t < 14, isThin = b - a < 14;
    return [isThin && !isFlat ? this.left : a, isThin && !isFlat ? this.left + this.width : b, isFlat ? this.top : t, isFlat ? this.top + this.height : u];
  }

  release(box, to) {
    this.box = { ...box, to };
    const [a, b, t, u] = this.boxEdges();
    const moved = Math.max(Math.abs(to[0] - box.from[0]), Math.abs(to[1] - box.from[1]));
    this.box = null;
    if (box.isPan) return this.figure.settled();
    if (moved < LEAST_BOX) { this.point(to); return this.figure.clicked(this, this.valueAt(to)); }
    const part = (from, [low, high], size, pixel) => low + ((pixel - from) / size) * (high - low);
    const x = [part(this.left, this.now.x, this.width, a), part(this.left, this.now.x, this.width, b)];
    const isFlat = u - t >= this.height - 1;
    const y = isFlat ? null : [u, t].map((pixel) => this.now.y[1] - ((pixel - this.top) / this.height) * (this.now.y[1] - this.now.y[0]));
    this.figure.zoomTo(x, y, this);
  }

  panTo(now) {
    const { begin, from } = this.box;
    const shift = (begin.x[1] - begin.x[0]) * ((from[0] - now[0]) / this.width);
    this.figure.zoomTo(begin.x.map((v) => v + shift), null, this, true);
  }

  magnify(factor, share) {
    const [low, high] = this.now.x, centre = low + share * (high - low);
    this.figure.zoomTo([centre + factor * (low - centre), centre + factor * (high - centre)], null, this);
  }

  key(event) {
    const step = event.shiftKey ? 0 : 0.01;
    const moves = { ArrowLeft: -1, ArrowRight: 1 };
    if (event.key in moves) {
      const [low, high] = this.now.x, size = high - low;
      if (event.shiftKey) this.figure.zoomTo([low + 0.25 * moves[event.key] * size, high + 0.25 * moves[event.key] * size], null, this);
      else this.point([this.px((this.cursor ? this.forward(this.cursor.x, "x") : (low + high) / 2) + step * moves[event.key] * size), this.top + this.height / 2]);
    } else if (event.key === "+" || event.key === "=") this.magnify(0.5, 0.5);
    else if (event.key === "-") this.magnify(2, 0.5);
    else if (event.key === "0" || event.key === "Escape") this.figure.reset();
    else if (event.key === "Enter" && this.cursor) this.figure.clicked(this, this.cursor);
    else return;
    event.preventDefault();
  }

  valueAt([px, py]) {
    const { x, y } = this.now;
    return {
      x: this.back(x[0] + ((px - this.left) / this.width) * (x[1] - x[0]), "x"),
      y: this.back(y[1] - ((py - this.top) / this.height) * (y[1] - y[0]), "y"),
    };
  }

  point(pixel) { this.figure.moveCursor(this.valueAt(pixel), this); }

  // The nearest point of every line: across of a history, by distance of a cloud.
  nearest(value, isOwn) {
    const points = [];
    for (const line of this.panel.lines) {
      let best = -1, least = Infinity;
      const isCurve = ascending(line.x);
      if (!isCurve && !isOwn) continue;
      const ax = this.x(value.x), ay = this.y(value.y);
      if (isCurve) best = bisected(line.x, value.x);
      else for (let k = 0; k < line.x.length; k++) {
        const d = (this.x(line.x[k]) - ax) ** 2 + (this.y(line.y[k]) - ay) ** 2;
        if (d < least) { least = d; best = k; }
      }
      if (best >= 0 && Number.isFinite(line.y[best]) && (isCurve || least < 900)) points.push({ x: line.x[best], y: line.y[best], name: line.name, colour: line.colour ?? "#0b5c8f" });
    }
    return points.slice(0, 6);
  }

  showCursor(value, isOwn) {
    this.cursor = value && { ...value, points: this.nearest(value, isOwn) };
    this.readout.textContent = this.cursor ? this.words(isOwn) : "";
    this.drawOver();
  }

  words(isOwn) {
    const { heat } = this.panel, { x, y, points } = this.cursor;
    if (heat && isOwn) {
      const [rows, columns] = heat.values.shape;
      const share = (v, [low, high], count) => Math.floor(((v - low) / (high - low)) * count);
      const [k, r] = [share(x, heat.x_range, columns), share(y, heat.y_range, rows)];
      const value = k >= 0 && k < columns && r >= 0 && r < rows ? heat.values[r * columns + k] : NaN;
      return `${numeral(x)}, ${numeral(y)}: ${heat.name} ${numeral(value)}`;
    }
    if (this.panel.cells.length && isOwn) {
      const holds = (cells, k) => cells.left[k] <= x && x < cells.right[k] && cells.low[k] <= y && y < cells.high[k];
      return this.panel.cells.find((cells) => cells.left.some((_, k) => holds(cells, k)))?.name ?? "";
    }
    for (const bars of isOwn ? this.panel.bars : []) {
      const k = bars.heights.findIndex((_, n) => bars.edges[n] <= x && x < bars.edges[n + 1]), base = bars.base?.[k] ?? 0;
      if (k >= 0 && base <= y && y <= base + bars.heights[k]) return `${bars.name} ${numeral(bars.edges[k])} to ${numeral(bars.edges[k + 1])} → ${numeral(bars.heights[k])}`;
    }
    const several = points.length > 1, unitOf = (words) => /\[(.+)\]$/.exec(words)?.[1];
    const across = unitOf(this.panel.x_title) ?? "", up = unitOf(this.panel.unit) ?? this.panel.unit;
    const said = (p) => [several && p.name, numeral(p.x, 6), across, "→", numeral(p.y), up].filter(Boolean).join(" ");
    return points.map(said).join(" · ");
  }
}

function shapeOf(c, shape, x, y, r) {
  if (shape === "square") c.rect(x - r, y - r, 2 * r, 2 * r);
  else if (shape === "diamond") { c.moveTo(x, y - 1.3 * r); c.lineTo(x + 1.3 * r, y); c.lineTo(x, y + 1.3 * r); c.lineTo(x - 1.3 * r, y); c.closePath(); }
  else if (shape === "triangle") { c.moveTo(x, y - 1.3 * r); c.lineTo(x + 1.2 * r, y + r); c.lineTo(x - 1.2 * r, y + r); c.closePath(); }
  else if (shape === "inverted triangle") { c.moveTo(x, y + 1.3 * r); c.lineTo(x + 1.2 * r, y - r); c.lineTo(x - 1.2 * r, y - r); c.closePath(); }
  else if (shape === "cross" || shape === "plus") {
    // Twelve corners, three an arm; a cross is a plus turned by an eighth.
    for (let k = 0; k < 4; k++) {
      const turn = (k * Math.PI) / 2 + (shape === "plus" ? 0 : Math.PI / 4), [cos, sin] = [Math.cos(turn), Math.sin(turn)];
      for (const [p, q] of [[1.3, -0.28], [1.3, 0.28], [0.28, 0.28]]) c.lineTo(x + r * (p * cos - q * sin), y + r * (p * sin + q * cos));
    }
    c.closePath();
  } else if (shape === "star") {
    for (let k = 0; k < 10; k++) { const size = k % 2 ? 0.55 * r : 1.4 * r, turn = (k * Math.PI) / 5; c.lineTo(x + size * Math.sin(turn), y - size * Math.cos(turn)); }
    c.closePath();
  } else c.arc(x, y, r, 0, 2 * Math.PI);
}

function ascending(x) {
  if (x.ascending === undefined) {
    let is = true;
    for (let k = 1; k < x.length && is; k++) is = !(x[k] < x[k - 1]);
    Object.defineProperty(x, "ascending", { value: is, enumerable: false });
  }
  return x.ascending;
}

function bisected(x, value) {
  let low = 0, high = x.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (x[middle] < value) low = middle; else high = middle; }
  return high < 0 ? -1 : Math.abs(x[low] - value) <= Math.abs(x[high] - value) ? low : high;
}

// ---- a figure of panels

class Figure {
  // options: onZoom([low, high] | null), onClick({panel, x, y})
  constructor(el, chart, options = {}) {
    this.el = el;
    this.options = options;
    this.hidden = new Map(); // entries of the legend, by name
    this.panels = [];
    this.grid = element("div", { class: "gr-grid" });
    el.replaceChildren(this.grid);
    this.set(chart);
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(el);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.repaint = () => this.redraw();
    this.scheme.addEventListener("change", this.repaint);
    addEventListener("beforeprint", this.repaint);
    addEventListener("gr-theme", this.repaint);
  }

  set(chart) {
    this.chart = { ...CHART, ...chart };
    const { panels } = this.chart;
    if (panels.length !== this.panels.length) {
      this.panels = panels.map((panel, index) => new Panel(this, panel, index));
      this.grid.replaceChildren(...this.panels.map((panel) => panel.el));
    } else this.panels.forEach((panel, index) => panel.set(panels[index]));
    this.drawnAt = 0;
    this.resize();
  }

  resize() {
    const width = this.el.clientWidth;
    if (!width || width === this.drawnAt) return;
    this.drawnAt = width;
    const fitting = Math.max(1, Math.floor(width / 260));
    this.columns = Math.min(this.chart.columns, fitting);
    this.grid.style.gridTemplateColumns = `repeat(${this.columns}, minmax(0, 1fr))`;
    this.panelWidth = Math.floor(width / this.columns);
    this.panels.forEach((panel) => panel.layout());
    this.redraw();
  }

  isShown(item) { return ![...this.hidden.values()].some((key) => explains(key, item)); }

  toggle(key) {
    if (!this.hidden.delete(key.name)) this.hidden.set(key.name, key);
    this.panels.forEach((panel) => panel.set(panel.whole));
    this.redraw();
  }

  redraw() {
    if (!this.drawnAt) return;
    this.theme = themeOf(this.el);
    this.panels.forEach((panel) => panel.draw());
  }

  zoomTo(x, y, from, isMoving = false) {
    for (const panel of this.chart.share_x ? this.panels : [from]) panel.zoom = { x, y: panel === from ? y : null };
    this.redraw();
    if (!isMoving) this.settled();
  }

  settled() {
    const zoom = this.panels[0]?.zoom;
    this.options.onZoom?.(zoom ? zoom.x.map((v) => this.panels[0].back(v, "x")) : null);
  }

  reset() {
    this.panels.forEach((panel) => { panel.zoom = null; });
    this.redraw();
    this.options.onZoom?.(null);
  }

  moveCursor(value, from) {
    for (const panel of this.panels) if (panel === from || this.chart.share_x) panel.showCursor(value, panel === from);
    this.options.onCursor?.(value, from);
  }

  // Marks points, a list a panel.
  mark(points) { this.panels.forEach((panel, k) => { panel.marked = points?.[k] ?? []; if (this.drawnAt) panel.drawOver(); }); }

  leave() { this.panels.forEach((panel) => panel.showCursor(null)); this.options.onCursor?.(null); }

  clicked(panel, value) { this.options.onClick?.({ panel: panel.index, ...value }); }

  destroy() {
    this.watch.disconnect();
    this.scheme.removeEventListener("change", this.repaint);
    removeEventListener("beforeprint", this.repaint);
    removeEventListener("gr-theme", this.repaint);
  }
}

// The shape or the dash that an entry of a legend explains.
function drawnSwatch({ shape, dash }, colour) {
  const ratio = globalThis.devicePixelRatio || 1, [width, height] = [dash ? 22 : 12, 12];
  const swatch = element("canvas", { class: "gr-drawn-swatch", width: Math.round(width * ratio), height: Math.round(height * ratio), "aria-hidden": "true" });
  swatch.style.width = `${width}px`;
  swatch.style.height = `${height}px`;
  const c = swatch.getContext("2d");
  c.scale(ratio, ratio);
  c.fillStyle = c.strokeStyle = colour;
  c.beginPath();
  if (dash) { c.lineWidth = 1.7; c.setLineDash(DASHES[dash] ?? []); c.moveTo(0, height / 2); c.lineTo(width, height / 2); c.stroke(); }
  else { shapeOf(c, shape, width / 2, height / 2, 4); c.fill(); }
  return swatch;
}

// Whether an entry of a legend explains something that is drawn.
function explains(key, item) {
  if (key.isName) return item.legend && item.name === key.name;
  return (key.isAnyColour || item.colour === key.colour) && (!key.shape || item.shape === key.shape) && (!key.dash || item.dash === key.dash);
}

// The legend of a figure: swatches with words, buttons where they explain lines, bars or cells.
function legend(figure) {
  const { panels, legend: entries } = figure.chart, theme = themeOf(figure.el);
  const drawn = panels.flatMap((panel) => [...(panel.lines ?? []), ...(panel.bars ?? []), ...(panel.cells ?? [])]);
  // A shape or a dash means the same in every colour, unless its own is drawn.
  const isAnyColour = (key) => (key.shape || key.dash) && !drawn.some((item) => explains(key, item));
  const named = drawn.filter((item) => item.legend).map(({ name, colour }) => ({ name, colour, isName: true }));
  const keys = [...entries.map((key) => ({ ...key, isAnyColour: isAnyColour(key) })), ...named];
  const unique = [...new Map(keys.map((key) => [key.name, key])).values()];
  if (!unique.length) return null;
  const swatchOf = (key) => {
    const colour = key.colour ?? MUTED;
    if (key.shape || key.dash) return drawnSwatch(key, theme.colour(colour));
    const swatch = element("i", { class: "gr-swatch" });
    swatch.style.background = colour === NO_VALUE ? `repeating-linear-gradient(135deg, ${theme.muted} 0 1.5px, ${theme.paper} 1.5px 4px)` : drawn.some((item) => item.left && item.colour === colour) ? theme.area(colour) : theme.colour(colour);
    return swatch;
  };
  return element("ul", { class: "gr-legend" }, unique.map((key) => {
    if (!drawn.some((item) => explains(key, item))) return element("li", {}, swatchOf(key), key.name);
    const button = element("button", { type: "button" }, swatchOf(key), key.name);
    const press = () => button.setAttribute("aria-pressed", String(!figure.hidden.has(key.name)));
    button.addEventListener("click", () => { figure.toggle(key); press(); });
    press();
    return element("li", {}, button);
  }));
}

export default { Figure, decoded, legend };
