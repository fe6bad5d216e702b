// needs: host, plot
// The motion at a point of branches: its phase planes over one period, and its multipliers with the unit circle.
// Model keys: "motions" is what report/motion_at_point.py gives, "shown" the index of the motion that is shown, "kept"
// the one that stays when the pointer leaves; "actions" are what the page does with it, [key, words] each. "chosen"
// receives {point, path, value, action}.

const { element } = host;
const INK = "#17212b", OUTSIDE = "#a8123e", INSIDE = "#0b5c8f";
const WHOLE = 32767, ROUNDING = 1e-9;

// Curves of all motions of a clearance, as whole numbers of 16 bits between the ends of its ranges.
function curvesOf(clearance) {
  const bytes = Uint8Array.from(atob(clearance.curves), (sign) => sign.charCodeAt(0));
  return new DataView(bytes.buffer);
}

function curve(clearance, curves, index) {
  const value = (k, [low, high]) => low + ((curves.getInt16(2 * k, true) + WHOLE) / (2 * WHOLE)) * (high - low);
  const first = 2 * clearance.counts.slice(0, index).reduce((sum, count) => sum + count, 0);
  const steps = Array.from({ length: clearance.counts[index] }, (_, k) => first + 2 * k);
  return { x: Float64Array.from(steps, (k) => value(k, clearance.x_range)), y: Float64Array.from(steps, (k) => value(k + 1, clearance.y_range)) };
}

function phasePlane(motions, clearance, curves, index) {
  const { stable } = motions.points[index], { x, y } = curve(clearance, curves, index), starts = clearance.starts[index];
  const lines = [
    { x, y, name: clearance.name, colour: INK, dash: stable ? "solid" : "dashed", width: 1.5 },
    { x: starts.map((k) => x[k]), y: starts.map((k) => y[k]), name: "start of a period", colour: INK, mark: "points", width: 7 },
  ];
  return {
    title: clearance.y_title, x_title: clearance.x_title, lines, x_range: clearance.x_range, y_range: clearance.y_range,
    bands: clearance.bands.map((band) => ({ ...band, along: "x" })), rules: clearance.corners.map((at) => ({ at, along: "x" })),
  };
}

const CIRCLE = Array.from({ length: 121 }, (_, k) => (2 * Math.PI * k) / 120);

function circle(motions, index) {
  const shown = motions.points[index].multipliers, isOutside = ([a, b]) => Math.hypot(a, b) > 1 + ROUNDING;
  const points = (chosen, name, colour, shape) => ({ x: chosen.map(([a]) => a), y: chosen.map(([, b]) => b), name, colour, shape, mark: "points", width: 8 });
  const range = [-motions.radius, motions.radius];
  return {
    title: "Multipliers", unit: "imaginary part", x_title: "real part", x_range: range, y_range: range, equal_scales: true,
    lines: [
      { x: CIRCLE.map(Math.cos), y: CIRCLE.map(Math.sin), name: "unit circle", colour: "#5d6b7a", width: 1 },
      points(shown.filter((one) => !isOutside(one)), "dies out", INSIDE, "circle"), points(shown.filter(isOutside), "grows", OUTSIDE, "cross"),
    ],
  };
}

// The motion nearest to a point of a figure, of which the levels of all motions are known.
function nearest(motions, levels, { x, y, limits }) {
  const size = ([low, high]) => Math.abs(high - low) || 1;
  let least = Infinity, best = 0;
  motions.value.forEach((value, index) => {
    for (const level of levels) {
      const away = Math.hypot((value - x) / size(limits.x), (level[index] - y) / size(limits.y));
      if (away < least) { least = away; best = index; }
    }
  });
  return best;
}

function render({ model, el }) {
  const motions = model.get("motions"), last = motions.points.length - 1;
  const curves = motions.clearances.map(curvesOf);
  const words = element("p", { class: "gr-motion-words", "aria-live": "polite" });
  const slider = element("input", { type: "range", min: 0, max: last, value: 0, step: 1 });
  const choose = (action) => {
    const { point, value } = motions.points[model.get("kept")];
    model.set("chosen", { point, path: motions.path, value, ...(action ? { action } : {}) });
    model.save_changes();
  };
  const actions = (model.get("actions") ?? []).map(([key, text]) => element("button", { type: "button", onclick: () => choose(key) }, text));
  const body = element("div", { class: "gr-figure" });
  el.replaceChildren(element("section", { class: "gr-widget gr-motion", "aria-label": "The motion at a point of the branches" },
    element("h3", {}, "Motion at a point"),
    element("label", {}, element("span", { class: "gr-hidden" }, "Along the branches"), slider), words, body,
    actions.length ? element("div", { class: "gr-toolbar" }, actions) : "",
    element("p", { class: "gr-note" }, "Point at a branch, or move along it with the arrow keys; a click or Enter keeps the motion. Dots: start of a period.")));
  const chart = (index) => ({
    key: "motion", title: "Motion at a point", columns: 2, panel_height: 150, share_x: false,
    panels: [...motions.clearances.map((clearance, k) => phasePlane(motions, clearance, curves[k], index)), circle(motions, index)],
  });
  const figure = new plot.Figure(body, chart(model.get("shown")));
  const show = () => {
    const index = model.get("shown"), said = motions.points[index].words;
    slider.value = String(index);
    slider.setAttribute("aria-valuetext", said);
    words.textContent = said;
    figure.set(chart(index));
  };
  const keep = () => choose("");
  slider.addEventListener("input", () => { model.set("kept", Number(slider.value)); model.set("shown", Number(slider.value)); });
  model.on("change:shown", show);
  model.on("change:kept", keep);
  show();
  return () => { model.off("change:shown", show); model.off("change:kept", keep); figure.destroy(); };
}

// Marks the motion that is shown in figures of branches, [key, model] each; pointer, click and arrow keys choose it.
// The model receives what is "chosen".
function follow(model, known, models, into) {
  const shown = host.innerModel(model, { motions: known, shown: 0, kept: 0, chosen: null });
  const mark = () => models.forEach(([key, own]) => {
    const index = shown.get("shown");
    own.set("marked", known.levels[key].map((levels) => levels.map((level) => ({ x: known.value[index], y: level[index] }))));
  });
  const show = (index) => { if (index !== shown.get("shown")) shown.set("shown", index); };
  const keep = (index) => { shown.set("kept", index); show(index); };
  const step = { ArrowLeft: -1, ArrowRight: 1 };
  for (const [key, own] of models) {
    const at = (cursor) => nearest(known, known.levels[key][cursor.panel] ?? [], cursor);
    own.on("change:cursor", () => { const cursor = own.get("cursor"); show(cursor ? at(cursor) : shown.get("kept")); });
    own.on("change:chosen", () => keep(shown.get("shown")));
    own.get("el").addEventListener("keydown", (event) => {
      if (event.key === "Enter") keep(shown.get("shown"));
      else if (event.key in step && !event.shiftKey) show(Math.min(known.points.length - 1, Math.max(0, shown.get("shown") + step[event.key])));
      else return;
      event.preventDefault();
      event.stopPropagation();
    }, { capture: true });
  }
  shown.on("change:shown", mark);
  shown.on("change:chosen", () => { model?.set("chosen", shown.get("chosen")); model?.save_changes(); });
  mark();
  return render({ model: shown, el: into });
}

export default { follow, render };
