// Values under the hand: sliders re-run the model of a run, the newest value wins, verdict and phase plane follow.

import { html, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { standIn } from "/static/model_stand_in.js";
import { Widget } from "/static/widget_host.js";

const PATTERN = /^\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)$/;
const STEPS = 200;

// Path and text of every value of a model that is a number or a number with a unit.
export function valuesOf(tables, prefix = "") {
  const values = [];
  for (const [key, value] of Object.entries(tables ?? {})) {
    const path = prefix ? `${prefix}.${key}` : key;
    if (Array.isArray(value)) value.forEach((entry, k) => { if (entry && typeof entry === "object") values.push(...valuesOf(entry, `${path}.${entry.name ?? k}`)); });
    else if (value && typeof value === "object") values.push(...valuesOf(value, path));
    else if (key !== "schema" && (typeof value === "number" || (typeof value === "string" && PATTERN.test(value)))) values.push({ path, text: String(value) });
  }
  return values;
}

function rangeOf(text) {
  const [, head, unit] = text.match(PATTERN), value = Number(head);
  return value ? { unit, low: Math.min(value / 5, value * 2), high: Math.max(value * 2, value / 5), value } : { unit, low: 0, high: 1, value };
}

export function Live({ id, onStarted, onError }) {
  const [model, setModel] = useState(null);
  const [sliders, setSliders] = useState([]);
  const [answer, setAnswer] = useState(null);
  const state = useRef({ sequence: 0, isBusy: false, wanted: null, times: [] });
  const [rate, setRate] = useState("");
  const verdict = useMemo(() => standIn({ view: { verdict: { verdict: "quiet", sentence: "", parts: [] }, notes: [] } }), [id]);
  const plane = useMemo(() => standIn({ chart: { panels: [] } }), [id]);

  useEffect(() => {
    modelOf(id).then(setModel).catch(onError);
  }, [id]);

  // One request is under way at a time; what is wanted meanwhile is asked for when it is answered: the newest alone.
  const ask = async (values) => {
    const now = state.current;
    now.wanted = values;
    if (now.isBusy) return;
    now.isBusy = true;
    while (now.wanted) {
      const asked = now.wanted, sequence = ++now.sequence;
      now.wanted = null;
      try {
        const made = await api.post("/api/live", { text: model.text, file: model.file, values: asked, sequence });
        if (made.sequence === now.sequence) show(made);
      } catch (error) {
        if (error.status !== 409) setAnswer({ problems: error.problems?.length ? error.problems : [{ place: "", value: "", rule: error.message, remedy: "" }] });
      }
    }
    now.isBusy = false;
  };
  const show = (made) => {
    const { times } = state.current;
    times.push(performance.now());
    if (times.length > 10) times.shift();
    if (times.length > 2) setRate(`${((1000 * (times.length - 1)) / (times.at(-1) - times[0])).toFixed(1)} updates a second`);
    verdict.set("view", { verdict: made.verdict, notes: [] });
    if (made.phase_plane) plane.set("chart", made.phase_plane);
    setAnswer(made);
  };
  useEffect(() => {
    if (!model) return;
    const first = valuesOf(model.tables).find(({ path }) => path.endsWith(".backlash")) ?? valuesOf(model.tables).find(({ path }) => path.endsWith(".clearance"));
    if (first) setSliders([{ path: first.path, ...rangeOf(first.text) }]);
    ask({});
  }, [model]);

  const set = (path, changes) => {
    const next = sliders.map((slider) => (slider.path === path ? { ...slider, ...changes } : slider));
    setSliders(next);
    ask(Object.fromEntries(next.map(textOf)));
  };
  const add = (path) => {
    const { text } = valuesOf(model.tables).find((value) => value.path === path);
    if (!sliders.some((slider) => slider.path === path)) setSliders((before) => [...before, { path, ...rangeOf(text) }]);
  };
  const keep = async () => {
    const edits = sliders.map(textOf).map(([path, value]) => ({ op: "set", path, value }));
    const name = sliders.map((slider) => textOf(slider).join(" ")).join(", ").slice(0, 120);
    try {
      const edited = edits.length ? await api.post("/api/edit", { text: model.text, file: model.file, edits }) : model;
      onStarted(await api.post("/api/jobs", { task: "run", text: edited.text, file: model.file, options: {}, name: name || model.title, parent: id }));
    } catch (error) { onError(error); }
  };
  if (!model) return html`<div class="page card loading">Reading the model …</div>`;
  const free = valuesOf(model.tables).filter((value) => !sliders.some((slider) => slider.path === value.path) && !value.path.startsWith("simulation"));
  return html`<div class="page card"><div class="head"><div class="title"><h1>Vary values</h1><p class="muted small">${model.title} · <a href=${`#/runs/${id}`}>back to the run</a></p></div>
      <div class="tools"><button type="button" class="primary" disabled=${!sliders.length} onClick=${keep}>Keep as a run</button></div></div>
    <div class="live"><section aria-label="Values">
      ${sliders.map((slider) => html`<${Slider} key=${slider.path} slider=${slider} set=${set} drop=${() => setSliders((before) => before.filter((other) => other.path !== slider.path))} />`)}
      <label>Add a slider<br /><select value="" onChange=${(event) => { add(event.target.value); event.target.value = ""; }}>
        <option value="">Choose a value …</option>${free.map((value) => html`<option value=${value.path}>${value.path} = ${value.text}</option>`)}</select></label>
      <p class="rate" role="status">${rate}</p>
    </section><section aria-label="What comes of it" aria-live="off">
      ${answer?.problems ? html`<ul class="failed" role="alert">${answer.problems.map((problem) => html`<li>${problem.place} ${problem.rule}</li>`)}</ul>` : null}
      <${Widget} name="verdict" model=${verdict} /><${Widget} name="phase_plane" model=${plane} />
    </section></div></div>`;
}

function textOf({ path, value, unit }) {
  const number = Number(value.toPrecision(5));
  return [path, unit ? `${number} ${unit}` : number];
}

function Slider({ slider, set, drop }) {
  const { path, low, high, value, unit } = slider, step = (high - low) / STEPS;
  const bound = (key) => (event) => { const number = Number(event.target.value); if (Number.isFinite(number)) set(path, { [key]: number }); };
  return html`<div class="slider"><div class="row"><span class="path">${path}</span><button type="button" class="plain small" aria-label=${`Remove the slider of ${path}`} onClick=${drop}>✕</button></div>
    <output>${Number(value.toPrecision(4))} ${unit}</output>
    <div class="row"><input type="range" aria-label=${path} min=${low} max=${high} step=${step} value=${value} onInput=${(event) => set(path, { value: Number(event.target.value) })} /></div>
    <div class="row small"><label>from <input type="text" inputmode="decimal" value=${Number(low.toPrecision(3))} onChange=${bound("low")} /></label><label>to <input type="text" inputmode="decimal" value=${Number(high.toPrecision(3))} onChange=${bound("high")} /></label></div></div>`;
}
