// Studies: one or two values over their ranges, as a map that fills; a click opens the case.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { about, named } from "/static/labels.js";
import { PATTERN, valuesOf } from "/static/live.js";

const MOST = 400;
const LISTED = ["study", "continuation"];

export function Studies({ jobs, onStarted, onError }) {
  const query = new URLSearchParams(location.hash.split("?")[1] ?? "");
  const done = (jobs ?? []).filter((job) => job.task !== "study" && job.state === "done");
  const [base, setBase] = useState("");
  const [model, setModel] = useState(null);
  const [axes, setAxes] = useState([]);
  useEffect(() => { if (!base && done.length) setBase(done[0].id); }, [done.length]);
  useEffect(() => {
    if (!base) return;
    setAxes([]);
    modelOf(base).then(setModel).catch(onError);
  }, [base]);
  const studies = (jobs ?? []).filter((job) => LISTED.includes(job.task));
  const values = model ? valuesOf(model).filter(({ path }) => !path.startsWith("simulation")) : [];
  const add = (path) => {
    const { text, si } = values.find((entry) => entry.path === path);
    const [, head, unit] = text.match(PATTERN), value = Number(head) || 1;
    setAxes((before) => [...before, { path, unit, si, low: Number((value / 2).toPrecision(3)), high: Number((value * 2).toPrecision(3)), count: 9 }]);
  };
  const change = (path, changes) => setAxes((before) => before.map((axis) => (axis.path === path ? { ...axis, ...changes } : axis)));
  const cases = axes.reduce((product, axis) => product * axis.count, axes.length ? 1 : 0);
  const start = () => {
    const grid = Object.fromEntries(axes.map(({ path, unit, low, high, count }) => [path, Array.from({ length: count }, (_, k) => {
      const value = Number((low + ((high - low) * k) / Math.max(1, count - 1)).toPrecision(6));
      return unit ? `${value} ${unit}` : value;
    })]));
    api.post("/api/jobs", { task: "study", text: model.text, file: model.file, options: { axes: grid }, name: about("study over", axes.map((axis) => axis.path), model.labels), parent: base }).then(onStarted).catch(onError);
  };
  const follow = () => {
    const [{ path, unit, low, high }] = axes, range = [low, high].map((value) => (unit ? `${value} ${unit}` : value));
    api.post("/api/jobs", { task: "continuation", text: model.text, file: model.file, options: { path, range }, name: about("motions over", [path], model.labels), parent: base }).then(onStarted).catch(onError);
  };
  return html`<div class="page split">
    <aside class="card side" aria-label="Studies"><h2>Studies</h2>
      <ul class="runs">${studies.map((job) => html`<li key=${job.id}><a href=${`#/runs/${job.id}`}><span class="name">${job.label}</span><span class="what"><span>${job.state}</span></span></a></li>`)}</ul>
      ${studies.length ? null : html`<p class="loading">No studies yet.</p>`}</aside>
    <article class="card">
      ${query.get("x") ? html`<${Case} query=${query} jobs=${jobs} onStarted=${onStarted} onError=${onError} />` : null}
      <h1>New study</h1><p class="muted">Choose one or two values; every combination is run, and the map shows where it rattles. A click in the map opens that case. Over one value, periodic motions can be followed as well, stable or not.</p>
      <div class="form"><label>Model of<select value=${base} onChange=${(event) => setBase(event.target.value)}>${done.length ? null : html`<option value="">no finished run</option>`}${done.map((job) => html`<option value=${job.id}>${job.label}</option>`)}</select></label>
        ${model && axes.length < 2 ? html`<label>Vary<select value="" onChange=${(event) => { add(event.target.value); event.target.value = ""; }}><option value="">Choose a value …</option>
          ${values.filter(({ path }) => !axes.some((axis) => axis.path === path)).map(({ path, words }) => html`<option value=${path}>${path} = ${words}</option>`)}</select></label>` : null}</div>
      ${axes.map((axis) => html`<${Axis} key=${axis.path} axis=${axis} change=${change} drop=${() => setAxes((before) => before.filter((other) => other.path !== axis.path))} />`)}
      ${axes.length ? html`<p><button type="button" class="primary" disabled=${cases > MOST} onClick=${start}>Run ${cases} ${cases === 1 ? "case" : "cases"}</button>${cases > MOST ? html` <span class="failed">at most ${MOST} cases here; gearrattle study does more</span>` : null}
        ${axes.length === 1 ? html` <button type="button" onClick=${follow}>Follow periodic motions</button>` : null}</p>` : null}
    </article></div>`;
}

function Axis({ axis, change, drop }) {
  const unit = axis.unit || axis.si, inUnit = unit ? ` [${unit}]` : "";
  const field = (key, words) => html`<${Numeral} words=${words} value=${axis[key]} commit=${(value) => change(axis.path, { [key]: key === "count" ? Math.max(1, Math.round(value)) : value })} />`;
  return html`<fieldset class="form"><legend class="path">${axis.path}</legend>${field("low", `from${inUnit}`)}${field("high", `to${inUnit}`)}${field("count", "values")}<button type="button" class="plain" onClick=${drop}>Remove</button></fieldset>`;
}

// A number that is changed when its text is left; while it is typed it stays as it is, whatever else changes on the page.
function Numeral({ words, value, commit }) {
  const [typed, setTyped] = useState(null);
  const leave = (event) => {
    const text = event.target.value.trim();
    if (text && Number.isFinite(Number(text))) commit(Number(text));
    setTyped(null);
  };
  return html`<label>${words}<input type="text" inputmode="decimal" size="8" value=${typed ?? value} onInput=${(event) => setTyped(event.target.value)} onChange=${leave} /></label>`;
}

// The case that was chosen in a map, whose axes count the values: its values in the model, ready to be run.
function Case({ query, jobs, onStarted, onError }) {
  const id = query.get("job"), job = (jobs ?? []).find((entry) => entry.id === id);
  const axes = Object.entries(job?.options?.axes ?? {});
  if (!axes.length) return null;
  const index = (k, position) => Math.min(axes[k][1].length - 1, Math.max(0, Math.round(Number(query.get(position)))));
  const values = Object.fromEntries(axes.slice(0, 2).map(([path, all], k) => [path, all[index(k, k ? "y" : "x")]]));
  const open = async () => {
    try {
      const { text, file } = await modelOf(id);
      const edits = Object.entries(values).map(([path, value]) => ({ op: "set", path, value }));
      const edited = await api.post("/api/edit", { text, file, edits });
      onStarted(await api.post("/api/jobs", { task: "run", text: edited.text, file, options: {}, name: named(Object.entries(values), edited.labels), parent: id }));
    } catch (error) { onError(error); }
  };
  return html`<section class="slider"><h2>The case of the map</h2><p>${Object.entries(values).map(([path, value]) => html`<span class="path">${path} = ${String(value)}</span> `)}</p>
    <button type="button" class="primary" onClick=${open}>Run this case</button> <a class="button" href=${`#/runs/${id}`}>Back to the map</a></section>`;
}
