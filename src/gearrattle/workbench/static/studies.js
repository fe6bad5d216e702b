// Studies: one or two values over their ranges, or idle conditions, as a map that fills; a click opens the case.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { about } from "/static/labels.js";
import { rangeOf, written } from "/static/decide.js";
import { valuesOf } from "/static/live.js";

const MOST = 400;
const SPACINGS = ["linear", "log"];
const OUTPUTS = ["verdict severity", "severity", "regime", "impacts per cycle", "contact share", "largest impact energy", "largest approach speed"];
const USUAL = ["verdict severity", "severity", "regime", "impacts per cycle", "contact share"];
const MAPS = ["study", "conditions"]; // what holds many models, none of which is its own
const LISTED = [...MAPS, "continuation"];
const ROLES = ["temperature", "speed", "load"]; // of the axes of conditions
const IDLE = 1.15; // times the speed, either way: idle speeds
const KINDS = { study: "every combination of values", conditions: "idle conditions" };

export function Studies({ jobs, onStarted, onError }) {
  const query = new URLSearchParams(location.hash.split("?")[1] ?? "");
  const done = (jobs ?? []).filter((job) => !MAPS.includes(job.task) && job.state === "done");
  const [base, setBase] = useState("");
  const [model, setModel] = useState(null);
  const [kind, setKind] = useState("study");
  const [axes, setAxes] = useState([]);
  const [outputs, setOutputs] = useState(USUAL);
  const [cost, setCost] = useState("");
  useEffect(() => setCost(""), [kind, axes, outputs]);
  useEffect(() => { if (!base && done.length) setBase(done[0].id); }, [done.length]);
  useEffect(() => {
    if (!base) return;
    setAxes([]);
    setKind("study");
    modelOf(base).then(setModel).catch(onError);
  }, [base]);
  const studies = (jobs ?? []).filter((job) => LISTED.includes(job.task));
  const values = model ? valuesOf(model).filter(({ path }) => !path.startsWith("simulation")) : [];
  const variable = (path, wide = 2) => ({ path, ...rangeOf(model, path, wide) });
  const isConditions = kind === "conditions";
  const axisOf = (path, role) => ({ ...variable(path, role === "speed" ? IDLE : 2), count: role ? 4 : 9, spacing: "linear", ties: [], role });
  const add = (path) => setAxes((before) => [...before, axisOf(path, isConditions ? ROLES.find((role) => before.every((axis) => axis.role !== role)) : "")]);
  const oil = values.find(({ path }) => path === "oil.temperature")?.path ?? model?.groups.find((path) => path.endsWith(".drag_torque"));
  const turn = (to) => {
    setKind(to);
    setAxes(to === "conditions" ? [oil, "excitation.speed"].map((path, k) => path && axisOf(path, ROLES[k])).filter(Boolean) : []);
  };
  const taken = axes.flatMap((axis) => [axis, ...axis.ties]).map(({ path }) => path);
  const options = model ? html`<optgroup label="several together">${model.groups.filter((path) => !taken.includes(path)).map((path) => html`<option value=${path}>${model.labels[path]}</option>`)}</optgroup>
    ${values.filter(({ path }) => !taken.includes(path)).map(({ path, words }) => html`<option value=${path}>${path} = ${words}</option>`)}` : null;
  const change = (path, changes) => setAxes((before) => before.map((axis) => (axis.path === path ? { ...axis, ...changes } : axis)));
  const cases = axes.reduce((product, axis) => product * axis.count, axes.length ? 1 : 0);
  const grid = () => Object.fromEntries(axes.map((axis) => {
    const lists = listsOf(axis);
    return axis.ties.length ? [together(axis, model.labels), Object.fromEntries(lists)] : lists[0];
  }));
  const asked = () => ({ task: kind, text: model.text, file: model.file, options: isConditions ? Object.fromEntries(axes.map(conditionsOf)) : { axes: grid(), outputs } });
  const isAsked = cases <= MOST && axes.every(isSound) && (isConditions ? ROLES.slice(0, 2).every((role) => axes.some((axis) => axis.role === role)) : outputs.length);
  const ask = () => {
    setCost("computing some cases …");
    api.post("/api/estimate", asked()).then(({ estimate }) => setCost(estimate)).catch((error) => { setCost(""); onError(error); });
  };
  const start = () => {
    api.post("/api/jobs", { ...asked(), name: about(`${kind} over`, taken, model.labels), parent: base }).then(onStarted).catch(onError);
  };
  const follow = () => {
    const [axis] = axes, { path } = axis, range = [axis.low, axis.high].map((value) => written(axis, value));
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
        ${model && axes.length < (isConditions ? 3 : 2) ? html`<label>Vary<select value="" onChange=${(event) => { add(event.target.value); event.target.value = ""; }}><option value="">Choose a value …</option>
          ${options}</select></label>` : null}
        ${model?.units === "dimensionless" || !model ? null : html`<label>Kind of study<select value=${kind} onChange=${(event) => turn(event.target.value)}>${Object.entries(KINDS).map(([key, words]) => html`<option value=${key}>${words}</option>`)}</select></label>`}</div>
      ${isConditions ? html`<p class="muted">Oil temperature, or a drag that it changes, over speed, and a load if you vary a third value: what happens in every condition, and how near its gears are to lifting off. The page to hand over plays every condition.</p>` : null}
      ${axes.map((axis) => html`<${Axis} key=${axis.path} axis=${axis} labels=${model.labels} options=${options} variable=${variable} change=${change} drop=${() => setAxes((before) => before.filter((other) => other.path !== axis.path))} />`)}
      ${axes.length && !isConditions ? html`<fieldset class="form checks"><legend>Outputs</legend>${OUTPUTS.map((name) => html`<label><input type="checkbox" checked=${outputs.includes(name)} onChange=${(event) => setOutputs((old) => OUTPUTS.filter((one) => (one === name ? event.target.checked : old.includes(one))))} />${name}</label>`)}</fieldset>` : null}
      ${axes.length ? html`<p><button type="button" class="primary" disabled=${!isAsked} onClick=${start}>Run ${cases} ${cases === 1 ? "case" : "cases"}</button> <button type="button" disabled=${!isAsked} onClick=${ask}>How long?</button> <span class="muted" role="status">${cost}</span>${cases > MOST ? html` <span class="failed">at most ${MOST} cases here; gearrattle study does more</span>` : null}
        ${axes.length === 1 && !isConditions && !axes[0].isFactor && !axes[0].ties.length ? html` <button type="button" onClick=${follow}>Follow periodic motions</button>` : null}</p>` : null}
    </article></div>`;
}

// The values of one that varies along an axis, from end to end.
function listOf(one, { count, spacing }) {
  const { low, high } = one;
  const at = (share) => (spacing === "log" ? low * (high / low) ** share : low + (high - low) * share);
  const list = Array.from({ length: count }, (_, k) => Number(at(k / Math.max(1, count - 1)).toPrecision(6)));
  return one.isFactor ? { factor: list } : list.map((value) => written(one, value));
}

const listsOf = (axis) => [axis, ...axis.ties].map((one) => [one.path, listOf(one, axis)]);

// An axis of conditions by its role.
function conditionsOf(axis) {
  const lists = listsOf(axis);
  return [axis.role, axis.ties.length ? { values: Object.fromEntries(lists) } : { path: axis.path, values: lists[0][1] }];
}

// What several values that vary together are called.
const together = (axis, labels) => [axis, ...axis.ties].map(({ path }) => labels[path] ?? path).join(" and ").replace(/[^\w-]+/g, " ").slice(0, 60).trim();

const isSound = ({ low, high, spacing, ties }) => spacing === "linear" || [{ low, high }, ...ties].every((one) => one.low * one.high > 0);

// One axis of a study: a value, and what varies together with it, step by step.
function Axis({ axis, labels, options, variable, change, drop }) {
  const set = (changes) => change(axis.path, changes);
  const untie = (path) => set({ ties: axis.ties.filter((tie) => tie.path !== path) });
  const retie = (path, changes) => set({ ties: axis.ties.map((tie) => (tie.path === path ? { ...tie, ...changes } : tie)) });
  const ends = (one, commit) => ["low", "high"].map((key) => html`<${Numeral} words=${`${key === "low" ? "from" : "to"}${one.shown ? ` [${one.shown}]` : ""}`} value=${one[key]} commit=${(value) => commit({ [key]: value })} />`);
  return html`<fieldset class="form"><legend title=${axis.path}>${axis.role ? `${axis.role}: ` : ""}${labels[axis.path] ?? axis.path}</legend>
    ${ends(axis, set)}<${Numeral} words="values" value=${axis.count} commit=${(value) => set({ count: Math.max(1, Math.round(value)) })} /><label>spacing<select value=${axis.spacing} onChange=${(event) => set({ spacing: event.target.value })}>${SPACINGS.map((name) => html`<option value=${name}>${name}</option>`)}</select></label>${isSound(axis) ? null : html`<span class="failed">log needs ends of one sign, none of them 0</span>`}
    <label>together with<select value="" onChange=${(event) => { set({ ties: [...axis.ties, variable(event.target.value)] }); event.target.value = ""; }}><option value="">Choose a value …</option>${options}</select></label>
    <button type="button" class="plain" onClick=${drop}>Remove</button>
    ${axis.ties.map((tie) => html`<fieldset class="form" key=${tie.path}><legend title=${tie.path}>with ${labels[tie.path] ?? tie.path}</legend>${ends(tie, (changes) => retie(tie.path, changes))}<button type="button" class="plain" onClick=${() => untie(tie.path)}>Remove</button></fieldset>`)}</fieldset>`;
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

const isList = (entry) => Array.isArray(entry) || "factor" in entry;
const valueAt = (entry, index) => { const list = entry.factor ?? entry, value = list[Math.min(list.length - 1, Math.max(0, index))]; return entry.factor ? { factor: value } : value; };

// Names and values of the axes of a map: horizontal, vertical, and of its panels.
function axesOf(task, options) {
  if (task !== "conditions") return Object.entries(options.axes ?? {}).slice(0, 2);
  return ["speed", "temperature", "load"].filter((role) => options[role]).map((role) => [options[role].path, options[role].values]);
}

// The case that was chosen in a map, whose axes count the values: its values in the model, ready to be run.
function Case({ query, jobs, onStarted, onError }) {
  const id = query.get("job"), job = (jobs ?? []).find((entry) => entry.id === id);
  const axes = axesOf(job?.task, job?.options ?? {}).map(([name, entry]) => Object.entries(isList(entry) ? { [name]: entry } : entry));
  if (!axes.length) return null;
  const values = Object.fromEntries(axes.flatMap((members, k) => members.map(([path, entry]) => [path, valueAt(entry, Math.round(Number(query.get(["x", "y", "panel"][k]))))])));
  const open = async () => {
    try {
      const { text, file } = await modelOf(id);
      const edits = Object.entries(values).map(([path, value]) => ({ op: "set", path, value }));
      const edited = await api.post("/api/edit", { text, file, edits });
      onStarted(await api.post("/api/jobs", { task: "run", text: edited.text, file, options: {}, parent: id }));
    } catch (error) { onError(error); }
  };
  return html`<section class="slider"><h2>The case of the map</h2><p>${Object.entries(values).map(([path, value]) => html`<span class="path">${path} ${typeof value === "object" ? `x${value.factor}` : `= ${value}`}</span> `)}</p>
    <button type="button" class="primary" onClick=${open}>Run this case</button> <a class="button" href=${`#/runs/${id}`}>Back to the map</a></section>`;
}
