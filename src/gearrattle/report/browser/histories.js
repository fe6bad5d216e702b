// needs: host, plot, numerals
// Histories of a run or a recording, thinned where they are kept so that every extreme and every impact stays.
// It asks its host: {ask: "channels"}, {ask: "trace", channels, from, to, points}, {ask: "impacts", from, to, points}.
// Model key "selected": names of channels at first; "window": of time at first; "overlay": [{over, channel, label, shift}],
// channels that {ask: "overlay", channel, from, to, points} gives, laid over one of these.

const { ask, element, unpacked } = host;
const POINTS = 3000;
const MARKED = ["deflection", "force"];
const OVER = ["#d55e00", "#009e73", "#cc79a7", "#e69f00"];
const WAITING = 30; // ms after the last zoom
const SHOWN_CYCLES = 8;

class Histories {
  constructor(model, el) {
    this.model = model;
    this.body = element("div", { class: "gr-figure" });
    this.bar = element("div", { class: "gr-toolbar", role: "toolbar", "aria-label": "Window of time" });
    this.state = element("span", { class: "gr-state", role: "status" });
    this.picker = element("details", { class: "gr-picker" });
    this.legend = element("div", {});
    el.replaceChildren(element("div", { class: "gr-widget gr-histories" }, this.bar, this.picker, this.legend, this.body));
    this.impacts = null;
    this.clearances = [];
    this.asked = 0;
  }

  async start() {
    const { content } = await ask(this.model, { ask: "channels" });
    this.known = content;
    this.window = this.model.get("window") ?? [content.begin, content.end];
    this.clearances = content.clearances ?? [];
    const named = this.model.get("selected") ?? [];
    const names = content.channels.map((channel) => channel.name);
    this.selected = named.filter((name) => names.includes(name));
    if (!this.selected.length) this.selected = content.channels.filter((c) => c.quantity === "deflection").map((c) => c.name).slice(0, 4);
    if (!this.selected.length) this.selected = names.slice(0, 4);
    this.showBar();
    this.showPicker();
    if (this.clearances.length) await this.fetchImpacts();
    await this.fetch();
    this.model.on("change:selected", this.onSelected = () => { this.selected = this.model.get("selected"); this.showPicker(); this.fetch(); });
    this.model.on("change:overlay", this.onOverlay = () => this.fetch());
  }

  showBar() {
    const { known } = this, button = (words, title, action) => element("button", { type: "button", title, onclick: action }, words);
    const window = (begin, end) => this.move([Math.max(known.begin, begin), Math.min(known.end, end)]);
    const cycles = (count) => window(known.end - count * known.period, known.end);
    const buttons = [button("Whole run", "All of it (0)", () => window(known.begin, known.end))];
    if (known.period) {
      const steady = known.begin + (known.discard ?? 0) * known.period;
      if (known.discard) buttons.push(button("Judged part", "Without the discarded cycles", () => window(steady, known.end)));
      buttons.push(button(`Last ${SHOWN_CYCLES} cycles`, "The end of the run", () => cycles(SHOWN_CYCLES)), button("1 cycle", "The last cycle", () => cycles(1)));
    }
    if (this.clearances.length) {
      buttons.push(element("span", { class: "gr-gap" }),
        button("‹ impact", "The impact before (p)", () => this.step(-1)), button("impact ›", "The next impact (n)", () => this.step(1)),
        button("Hardest", "The impact of the largest approach speed (h)", () => this.hardest()));
    }
    this.bar.replaceChildren(...buttons, this.state);
    this.body.addEventListener("keydown", (event) => {
      const action = { n: () => this.step(1), p: () => this.step(-1), h: () => this.hardest() }[event.key];
      if (action && !event.ctrlKey && !event.metaKey) action();
    });
  }

  count() { return `Channels (${this.selected.length} of ${this.known.channels.length})`; }

  showPicker() {
    const groups = new Map();
    for (const channel of this.known.channels) groups.set(channel.quantity || "channels", [...(groups.get(channel.quantity || "channels") ?? []), channel]);
    const sets = [...groups].map(([quantity, channels]) => element("fieldset", {}, element("legend", {}, quantity.replace("_", " ")),
      channels.map((channel) => {
        const box = element("input", { type: "checkbox", checked: this.selected.includes(channel.name) });
        box.addEventListener("change", () => this.choose(channel.name, box.checked));
        return element("label", {}, box, channel.label || channel.name);
      })));
    const isOpen = this.picker.open;
    this.picker.replaceChildren(element("summary", {}, this.count()), element("div", { class: "gr-sets" }, sets));
    this.picker.open = isOpen;
  }

  choose(name, isChosen) {
    const order = this.known.channels.map((channel) => channel.name);
    const chosen = isChosen ? [...this.selected, name] : this.selected.filter((other) => other !== name);
    this.selected = order.filter((other) => chosen.includes(other));
    this.picker.firstChild.textContent = this.count();
    this.fetch();
  }

  async fetchImpacts() {
    const { buffers } = await ask(this.model, { ask: "impacts", from: this.known.begin, to: this.known.end, points: 20000 });
    this.impacts = this.marksOf(buffers[0]);
  }

  marksOf(buffer) {
    const [[time, clearance, velocity, energy, count]] = unpacked(buffer, 5);
    return { time, clearance, velocity, energy, count };
  }

  // Read the window anew; an answer that is not the last asked for is dropped.
  async fetch() {
    const asked = ++this.asked, [from, to] = this.window, points = POINTS;
    const overlay = this.model.get("overlay") ?? [];
    this.state.textContent = "…";
    const begin = performance.now();
    try {
      const [traces, impacts, ...over] = await Promise.all([
        this.selected.length ? ask(this.model, { ask: "trace", channels: this.selected, from, to, points }) : { buffers: [] },
        this.clearances.length ? ask(this.model, { ask: "impacts", from, to, points: 1000 }) : { buffers: [] },
        ...overlay.map((line) => ask(this.model, { ask: "overlay", channel: line.channel, from: from - line.shift, to: to - line.shift, points }).catch(() => ({ buffers: [] }))),
      ]);
      if (asked !== this.asked) return;
      const parts = traces.buffers[0] ? unpacked(traces.buffers[0], 2) : [];
      const marks = impacts.buffers[0] ? this.marksOf(impacts.buffers[0]) : null;
      const laid = over.map((answer, k) => ({ ...overlay[k], arrays: answer.buffers[0] ? unpacked(answer.buffers[0], 2)[0] : null }));
      this.show(parts, marks, laid);
      this.took = performance.now() - begin;
      this.state.textContent = this.words(marks);
    } catch (error) {
      if (asked === this.asked) this.state.textContent = error.problems ? error.problems.map((p) => `${p.place}: ${p.rule}`).join("; ") : error.message;
    }
  }

  words(marks) {
    const number = marks ? marks.count.reduce((sum, count) => sum + count, 0) : 0;
    const size = this.window[1] - this.window[0];
    const length = this.known.period ? `${numerals.numeral(size / this.known.period, 3)} cycles` : `${numerals.numeral(size, 3)} s`;
    return marks ? `${length}, ${number} ${number === 1 ? "impact" : "impacts"}` : length;
  }

  show(parts, marks, laid) {
    const { known } = this, byName = new Map(known.channels.map((channel) => [channel.name, channel]));
    const panels = this.selected.map((name, k) => {
      const channel = byName.get(name), [x, y] = parts[k] ?? [[], []];
      const over = laid.filter((line) => line.over === name && line.arrays)
        .map((line, n) => ({ x: line.arrays[0].map((t) => t + line.shift), y: line.arrays[1], name: line.label, colour: OVER[n % OVER.length], legend: true, opacity: 0.85 }));
      const title = channel.label || channel.name, words = channel.quantity && channel.label ? channel.quantity.replace("_", " ") : "";
      return {
        title, unit: `${words}${channel.unit && channel.unit !== "1" ? `  [${channel.unit}]` : ""}`, x_title: "time [s]",
        lines: [{ x, y, name: over.length ? "simulated" : title, colour: "#0b5c8f", legend: over.length > 0 }, ...over],
        marks: marks && MARKED.includes(channel.quantity) ? [this.marksFor(marks, channel.label)] : [], x_range: this.window,
      };
    });
    const few = panels.length <= 2, chart = { title: "Histories", panel_height: few ? 220 : 130, share_x: true, panels };
    if (!panels.length) chart.panels = [{ note: "Choose a channel above" }];
    if (!this.figure) this.figure = new plot.Figure(this.body, chart, { onZoom: (window) => this.zoomed(window) });
    else { this.figure.panels.forEach((panel) => { panel.zoom = null; }); this.figure.set(chart); }
    this.legend.replaceChildren(...[laid.length ? plot.legend(this.figure) : null].filter(Boolean));
  }

  marksFor(marks, name) {
    const index = this.clearances.findIndex((clearance) => clearance.name === name);
    const rows = [...marks.clearance.keys()].filter((k) => marks.clearance[k] === index);
    return { x: rows.map((k) => marks.time[k]), up: rows.map((k) => marks.velocity[k]), size: rows.map((k) => Math.abs(marks.velocity[k])) };
  }

  zoomed(window) {
    this.window = window ? [Math.max(this.known.begin, window[0]), Math.min(this.known.end, window[1])] : [this.known.begin, this.known.end];
    if (!(this.window[1] > this.window[0])) this.window = [this.known.begin, this.known.end];
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.fetch(), WAITING);
  }

  move(window) { this.window = window; return this.fetch(); }

  relevant() {
    const shown = new Set(this.selected.map((name) => name.split(".").slice(1).join(".")));
    const wanted = this.clearances.map((clearance) => shown.has(clearance.name));
    const isAny = wanted.some(Boolean);
    return [...this.impacts.time.keys()].filter((k) => !isAny || wanted[this.impacts.clearance[k]]);
  }

  around(k) {
    const size = Math.min(this.window[1] - this.window[0], (this.known.period ?? this.window[1] - this.window[0]) / 2);
    const at = this.impacts.time[k];
    this.model.set("impact", at);
    return this.move([at - size / 2, at + size / 2]);
  }

  step(direction) {
    const rows = this.relevant(), middle = (this.window[0] + this.window[1]) / 2, least = 1e-9 * (this.known.end - this.known.begin);
    const next = direction > 0 ? rows.find((k) => this.impacts.time[k] > middle + least) : rows.findLast((k) => this.impacts.time[k] < middle - least);
    if (next !== undefined) this.around(next);
  }

  hardest() {
    const rows = this.relevant(), size = (k) => this.impacts.energy[k] || 0;
    if (rows.length) this.around(rows.reduce((best, k) => (size(k) > size(best) ? k : best), rows[0]));
  }

  destroy() {
    clearTimeout(this.timer);
    this.asked++;
    this.model.off("change:selected", this.onSelected);
    this.model.off("change:overlay", this.onOverlay);
    this.figure?.destroy();
  }
}

function render({ model, el }) {
  const histories = new Histories(model, el);
  histories.start().catch((error) => { histories.state.textContent = error.message; el.append(element("p", { role: "alert" }, error.message)); });
  return () => histories.destroy();
}

export default { render };
