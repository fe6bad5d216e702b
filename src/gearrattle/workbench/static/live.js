// Values under the hand: sliders re-run the model of a run, the newest value wins, verdict and phase plane follow.

import { html, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { standIn } from "/static/model_stand_in.js";
import { Widget } from "/static/widget_host.js";

export const PATTERN = /^\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*)$/;
const STEPS = 200;

// Every value of a model that is a number or a number with a unit: its path, its text, the SI unit of a plain number, and the words to show.
export function valuesOf({ tables, units }) {
  return textsOf(tables).map(({ path, text }) => ({ path, text, si: units[path] ?? "", words: [text, units[path]].filter(Boolean).join(" ") }));
}

function textsOf(tables, prefix = "") {
  const values = [];
  for (const [key, value] of Object.entries(tables ?? {})) {
    const path = prefix ? `${prefix}.${key}` : key;
    if (Array.isArray(value)) value.forEach((entry, k) => { if (entry && typeof entry === "object") values.push(...textsOf(entry, `${path}.${entry.name ?? k}`)); });
    else if (value && typeof value === "object") values.push(...textsOf(value, path));
    else if (key !== "schema" && (typeof value === "number" || (typeof value === "string" && PATTERN.test(value)))) values.push({ path, text: String(value) });
  }
  return values;
}

function sliderOf({ path, text, si }) {
  const [, head, unit] = text.match(PATTERN), value = Number(head);
  const [low, high] = value ? [Math.min(value / 5, value * 2), Math.max(value * 2, value / 5)] : [0, 1];
  return { path, unit, si, low, high, value };
}

export function Live({ id, onStarted, onError }) {
  const [model, setModel] = useState(null);
  const [sliders, setSliders] = useState([]);
  const [answer, setAnswer] = useState(null);
  const [isShown, setShown] = useState(false); // not before there is a verdict: an empty one would say "quiet"
  const state = useRef({ sequence: 0, isBusy: false, wanted: null });
  const verdict = useMemo(() => standIn({ view: { verdict: { state: "quiet", sentence: "", parts: [] }, notes: [] } }), [id]);
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
    verdict.set("view", { verdict: made.verdict, notes: [] });
    if (made.phase_plane) plane.set("chart", made.phase_plane);
    setAnswer(made);
    setShown(true);
  };
  useEffect(() => {
    if (!model) return;
    const first = valuesOf(model).find(({ path }) => path.endsWith(".backlash")) ?? valuesOf(model).find(({ path }) => path.endsWith(".clearance"));
    if (first) setSliders([sliderOf(first)]);
    ask({});
  }, [model]);

  const set = (path, changes) => {
    const next = sliders.map((slider) => (slider.path === path ? { ...slider, ...changes } : slider));
    setSliders(next);
    ask(Object.fromEntries(next.map(textOf)));
  };
  const add = (path) => {
    const added = sliderOf(valuesOf(model).find((value) => value.path === path));
    if (!sliders.some((slider) => slider.path === path)) setSliders((before) => [...before, added]);
  };
  const keep = async () => {
    const values = sliders.map(textOf), edits = values.map(([path, value]) => ({ op: "set", path, value }));
    try {
      const edited = edits.length ? await api.post("/api/edit", { text: model.text, file: model.file, edits }) : model;
      onStarted(await api.post("/api/jobs", { task: "run", text: edited.text, file: model.file, options: {}, parent: id }));
    } catch (error) { onError(error); }
  };
  if (!model) return html`<div class="page card loading">Reading the model …</div>`;
  const free = valuesOf(model).filter((value) => !sliders.some((slider) => slider.path === value.path) && !value.path.startsWith("simulation"));
  return html`<div class="page card"><div class="head"><div class="title"><h1>Vary values</h1><p class="muted small">${model.title} · <a href=${`#/runs/${id}`}>back to the run</a></p></div>
      <div class="tools"><button type="button" class="primary" disabled=${!sliders.length} onClick=${keep}>Keep as a run</button></div></div>
    <div class="live"><section aria-label="Values">
      ${sliders.map((slider) => html`<${Slider} key=${slider.path} slider=${slider} set=${set} drop=${() => setSliders((before) => before.filter((other) => other.path !== slider.path))} />`)}
      <label>Add a slider<br /><select value="" onChange=${(event) => { add(event.target.value); event.target.value = ""; }}>
        <option value="">Choose a value …</option>${free.map((value) => html`<option value=${value.path}>${value.path} = ${value.words}</option>`)}</select></label>
    </section><section aria-label="What comes of it" aria-live="off">
      ${answer?.problems ? html`<ul class="failed" role="alert">${answer.problems.map((problem) => html`<li>${problem.place} ${problem.rule}</li>`)}</ul>` : null}
      ${isShown ? html`<${Widget} name="verdict" model=${verdict} /><${Widget} name="phase_plane" model=${plane} />` : answer ? null : html`<p class="loading" role="status">Computing …</p>`}
    </section></div></div>`;
}

function textOf({ path, value, unit }) {
  const number = Number(value.toPrecision(5));
  return [path, unit ? `${number} ${unit}` : number];
}

function Slider({ slider, set, drop }) {
  const { path, low, high, value, unit, si } = slider, step = (high - low) / STEPS;
  const bound = (key) => (event) => { const number = Number(event.target.value); if (Number.isFinite(number)) set(path, { [key]: number }); };
  return html`<div class="slider"><div class="row"><span class="path">${path}</span><button type="button" class="plain small" aria-label=${`Remove the slider of ${path}`} onClick=${drop}>✕</button></div>
    <output>${Number(value.toPrecision(4))} ${unit || si}</output>
    <div class="row"><input type="range" aria-label=${path} min=${low} max=${high} step=${step} value=${value} onInput=${(event) => set(path, { value: Number(event.target.value) })} /></div>
    <div class="row small"><label>from <input type="text" inputmode="decimal" value=${Number(low.toPrecision(3))} onChange=${bound("low")} /></label><label>to <input type="text" inputmode="decimal" value=${Number(high.toPrecision(3))} onChange=${bound("high")} /></label></div></div>`;
}
