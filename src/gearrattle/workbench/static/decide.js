// What is asked of a run: how much one value must change, and which change is the cheapest. Both become jobs.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { about } from "/static/labels.js";
import { PATTERN, valuesOf } from "/static/live.js";

export const QUESTIONS = [["threshold", "How much?"], ["remedies", "What to change?"]];
const BELOW = [["largest impact energy", "J"], ["impacts per cycle", ""], ["contact share", ""]];
const WIDE = 4; // times, either way, where nothing is said
const FIRST = /\.(backlash|clearance|drag_torque)$/;

// Values in the order in which they are likely to be asked for: of the part and the bodies at its ends, several
// together, all others.
export function choicesFor(model, part) {
  const values = valuesOf(model).filter(({ path }) => !/^(simulation|criteria)\./.test(path));
  const rows = Object.entries(model.tables).flatMap(([kind, list]) => (Array.isArray(list) ? list.map((row) => ({ kind, row })) : []));
  const owner = rows.find(({ kind, row }) => row?.name === part && kind !== "inertia");
  const near = owner ? [`${owner.kind}.${part}.`, ...(owner.row.between ?? []).map((body) => `inertia.${body}.`)] : [];
  const isNear = ({ path }) => near.some((start) => path.startsWith(start));
  const entry = ({ path, words }) => ({ path, words: `${model.labels[path] ?? path} = ${words}` });
  const rank = ({ path }) => near.findIndex((start) => path.startsWith(start)) * 2 - (FIRST.test(path) ? 1 : 0);
  const own = values.filter(isNear).sort((a, b) => rank(a) - rank(b));
  return [
    [`of ${part}`, own.map(entry)],
    ["several together", model.groups.map((path) => ({ path, words: model.labels[path] }))],
    ["others", values.filter((value) => !isNear(value)).map(entry)],
  ].filter(([, list]) => list.length);
}

// The range that is offered for a value: factors for a group, else around the value, in its unit.
export function rangeOf(model, path, wide = WIDE) {
  if (model.groups.includes(path)) return { isFactor: true, unit: "", shown: "times", low: Number((1 / wide).toPrecision(3)), high: wide };
  const { text, si } = valuesOf(model).find((value) => value.path === path);
  const [, head, unit] = text.match(PATTERN), value = Number(head) || 1, ends = [value / wide, value * wide].map((end) => Number(end.toPrecision(3)));
  return { isFactor: false, unit, shown: unit || si, low: Math.min(...ends), high: Math.max(...ends) };
}

// A number as it is written: in its unit, or as a factor.
export const written = ({ isFactor, unit }, value) => (isFactor ? { factor: value } : unit ? `${value} ${unit}` : value);

export function Decide({ job, question, parts, selected, onStarted, onError }) {
  const [model, setModel] = useState(null);
  useEffect(() => { modelOf(job.id).then(setModel).catch(onError); }, [job.id]);
  const submit = (task, options, name) => api.post("/api/jobs", { task, text: model.text, file: model.file, options, name, parent: job.id }).then(onStarted).catch(onError);
  if (!model) return html`<p class="loading">Reading the model …</p>`;
  if (question === "remedies") return html`<${WhatToChange} model=${model} submit=${submit} />`;
  return html`<${HowMuch} model=${model} parts=${parts} selected=${selected} submit=${submit} />`;
}

function HowMuch({ model, parts, selected, submit }) {
  const isPart = (name) => parts.some((known) => known.name === name);
  const [part, setPart] = useState(isPart(selected) ? selected : worst(parts));
  const choices = choicesFor(model, part);
  const [path, setPath] = useState(choices[0][1][0].path);
  const [range, setRange] = useState(() => rangeOf(model, path));
  const [goal, setGoal] = useState({ key: "quiet", limit: "" });
  const choose = (value) => { setPath(value); setRange(rangeOf(model, value)); };
  const turn = (name) => { setPart(name); choose(choicesFor(model, name)[0][1][0].path); };
  useEffect(() => { if (isPart(selected) && selected !== part) turn(selected); }, [selected]);
  const ends = [Number(range.low), Number(range.high)], isSound = ends.every(Number.isFinite) && ends[0] < ends[1] && isGoal(goal);
  const start = (event) => {
    event.preventDefault();
    submit("threshold", { path, range: ends.map((end) => written(range, end)), until: targetOf(goal) }, about("how much:", [path], model.labels));
  };
  const end = (key, words) => html`<label>${words}${range.shown ? ` [${range.shown}]` : ""}<input type="text" inputmode="decimal" size="8" value=${Number(Number(range[key]).toPrecision(4)) || range[key]} onChange=${(event) => setRange({ ...range, [key]: event.target.value.trim() })} /></label>`;
  return html`<form class="slider" aria-label="How much?" onSubmit=${start}><h2>How much must a value change?</h2>
    <p class="muted">The range is scanned by exact runs, from rest, from the motion before and after a push; then the change that is nearest to the value of the model is halved until it is known to 1 %.</p>
    <div class="form">
      ${parts.length ? html`<label>Part<select value=${part} onChange=${(event) => turn(event.target.value)}>${parts.map(({ name }) => html`<option value=${name}>${name}</option>`)}</select></label>` : null}
      <label>Value<select value=${path} onChange=${(event) => choose(event.target.value)}>${choices.map(([title, list]) => html`<optgroup label=${title}>${list.map((choice) => html`<option value=${choice.path}>${choice.words}</option>`)}</optgroup>`)}</select></label>
      ${end("low", "from")}${end("high", "to")}<${Goal} goal=${goal} set=${setGoal} words="until" choices=${[["quiet", "quiet"]]} />
      <button class="primary" disabled=${!isSound}>Find how much</button></div></form>`;
}

function WhatToChange({ model, submit }) {
  const [goal, setGoal] = useState({ key: "quiet", limit: "" });
  const [hasPairs, setPairs] = useState(true);
  const [changes, setChanges] = useState([]);
  const isTaken = ({ path }) => changes.some((change) => change.path === path);
  const choices = [["several together", model.groups.map((path) => ({ path, words: model.labels[path] }))], ["values", valuesOf(model).filter(({ path }) => !/^(simulation|criteria|excitation)\./.test(path)).map(({ path, words }) => ({ path, words: `${model.labels[path] ?? path} = ${words}` }))]];
  const set = (path, values) => setChanges((before) => before.map((change) => (change.path === path ? { ...change, ...values } : change)));
  const isSound = changes.every((change) => [change.low, change.high, change.cost].every((value) => value !== "" && Number.isFinite(Number(value))) && Number(change.low) < Number(change.high));
  const start = (event) => {
    event.preventDefault();
    const own = Object.fromEntries(changes.map((change) => [change.path, { ...ends(change), cost: Number(change.cost) }]));
    submit("remedies", { target: targetOf(goal), pairs: hasPairs, ...(changes.length ? { candidates: own } : {}) }, `what to change: ${targetOf(goal)}`.slice(0, 120));
  };
  const field = (change, key, words) => html`<label>${words}<input type="text" inputmode="decimal" size="8" value=${change[key]} onInput=${(event) => set(change.path, { [key]: event.target.value.trim() })} /></label>`;
  return html`<form class="slider" aria-label="What to change?" onSubmit=${start}><h2>Which change makes it quiet?</h2>
    <p class="muted">${changes.length ? "The changes below are searched, each by as little as does it." : "Drag torques, backlashes, gaps, damper stages and inertias are changed to 0.7 to 1.3 times what the model says, each by as little as does it; or choose the changes yourself."} A change counts only if it holds at the neighbouring speeds and from all starts. It may take minutes; what is known when it is stopped stays.</p>
    ${changes.map((change) => html`<fieldset class="form" key=${change.path}><legend title=${change.path}>${model.labels[change.path] ?? change.path}</legend>${field(change, "low", `from [${change.shown || "SI"}]`)}${field(change, "high", `to [${change.shown || "SI"}]`)}${field(change, "cost", "cost of the whole way")}<button type="button" class="plain" onClick=${() => setChanges((before) => before.filter((other) => other !== change))}>Remove</button></fieldset>`)}
    <div class="form"><label>Change to search<select value="" onChange=${(event) => { const path = event.target.value; setChanges((before) => [...before, { path, ...rangeOf(model, path, 1.5), cost: 1 }]); event.target.value = ""; }}><option value="">Choose a value …</option>${choices.map(([title, list]) => html`<optgroup label=${title}>${list.filter((choice) => !isTaken(choice)).map((choice) => html`<option value=${choice.path}>${choice.words}</option>`)}</optgroup>`)}</select></label>
      <${Goal} goal=${goal} set=${setGoal} words="target" choices=${[["quiet", "quiet"], ["half", "half the energy of the hardest impact"]]} />
      <label>pairs as well<input type="checkbox" checked=${hasPairs} onChange=${(event) => setPairs(event.target.checked)} /></label>
      <button class="primary" disabled=${!isGoal(goal) || !isSound}>Search</button></div></form>`;
}

// The ends of a range as a study of designs takes them.
function ends(range) {
  const [from, to] = [Number(range.low), Number(range.high)].map((value) => (range.isFactor || !range.unit ? value : `${value} ${range.unit}`));
  return range.isFactor ? { factor: { from, to } } : { from, to };
}

// What shall come out: one of the choices, or an output below a number.
function Goal({ goal, set, words, choices }) {
  const unit = BELOW.find(([name]) => name === goal.key)?.[1];
  return html`<label>${words}<select value=${goal.key} onChange=${(event) => set({ ...goal, key: event.target.value })}>${choices.map(([key, title]) => html`<option value=${key}>${title}</option>`)}${BELOW.map(([name]) => html`<option value=${name}>${name} below</option>`)}</select></label>
    ${unit === undefined ? null : html`<label>below${unit ? ` [${unit}]` : ""}<input type="text" inputmode="decimal" size="8" value=${goal.limit} onInput=${(event) => set({ ...goal, limit: event.target.value.trim() })} /></label>`}`;
}

const isCompared = ({ key }) => BELOW.some(([name]) => name === key);
const isGoal = (goal) => !isCompared(goal) || (goal.limit !== "" && Number.isFinite(Number(goal.limit)));
const targetOf = (goal) => (isCompared(goal) ? `${goal.key} < ${goal.limit}` : goal.key);
const worst = (parts) => [...parts].sort((a, b) => b.rattles - a.rattles || (b.max_impact_energy ?? 0) - (a.max_impact_energy ?? 0))[0]?.name ?? "";
