// Variants side by side: what differs in their models, and what came of it; the best one is kept by its name.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { standIn } from "/static/model_stand_in.js";
import numerals from "/widgets/numerals.js";
import { Widget, widget } from "/static/widget_host.js";

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7a5c3e"];
const OVERLAID = [["phase_plane", "Phase planes"], ["spectrum", "Spectra"], ["impacts", "Impacts"]];

export function Compare({ jobs, chosen, onError }) {
  const [answered, setAnswered] = useState({});
  const done = (jobs ?? []).filter((job) => job.state === "done");
  const known = chosen.filter((id) => done.some((job) => job.id === id));
  const runs = known.map((id) => done.find((job) => job.id === id));
  const key = known.join(",");
  const rows = answered.key === key ? answered.rows : null; // those of the runs marked before are not theirs
  useEffect(() => {
    if (known.length > 1) api.get(`/api/compare?jobs=${key}`).then((rows) => setAnswered({ key, rows })).catch(onError);
  }, [key]);
  const toggle = (id, isOn) => { location.hash = `#/compare?jobs=${(isOn ? [...known, id] : known.filter((other) => other !== id)).join(",")}`; };
  return html`<div class="page split">
    <aside class="card side checks" aria-label="Runs to compare"><h2>Runs to compare</h2>
      ${done.length ? done.map((job) => html`<label key=${job.id}><input type="checkbox" checked=${known.includes(job.id)} onChange=${(event) => toggle(job.id, event.target.checked)} /><span>${job.label}</span></label>`) : html`<p class="loading">No finished runs yet.</p>`}
    </aside>
    <article class="card">
      ${known.length < 2 ? html`<div class="empty"><h1>Compare variants</h1><p>Mark two runs or more on the left. What differs in their models is named, and what came of it stands side by side.</p></div>`
        : rows ? html`<${Table} rows=${rows} jobs=${runs} onError=${onError} /><${Sounds} key=${`sounds ${key}`} jobs=${runs} onError=${onError} /><${Overlay} key=${key} figures=${rows.figures} jobs=${runs} />` : html`<p class="loading">Reading …</p>`}
    </article>
  </div>`;
}

// The sounds of all that are compared, at one gain: their differences are heard as they are.
function Sounds({ jobs, onError }) {
  const [made, setMade] = useState(null);
  const [isBusy, setBusy] = useState(false);
  const make = () => { setBusy(true); api.get(`/api/sound?jobs=${jobs.map(({ id }) => id).join(",")}`).then(setMade).catch(onError).finally(() => setBusy(false)); };
  const words = ({ level, problems }) => (problems.length ? problems.map(({ rule }) => rule).join("; ") : level === null ? "silent" : `${numerals.numeral(level, 3)} dB re 20 µPa`);
  return html`<section aria-label="Sounds"><h2>Sounds</h2>
    <p class="muted">The force on the casing, or without bearings the impacts of all gear meshes, through an assumed path, at one gain for all: the differences are those of the designs, the level is not.${made?.gain ? ` Full scale is ${numerals.engineering(1 / made.gain, "Pa")}; the highest peak of all is half of it.` : ""}</p>
    ${made ? html`<table><tbody>${jobs.map((job, k) => html`<tr key=${job.id}><th scope="row">${job.label}</th><td>${words(made.designs[k])}</td>
      <td>${made.designs[k].level === null ? null : html`<audio controls preload="none" aria-label=${`Sound of ${job.label}`} src=${`/api/jobs/${job.id}/sound.wav?gain=${made.gain}`}></audio>`}</td></tr>`)}</tbody></table>`
      : html`<button type="button" disabled=${isBusy} onClick=${make}>${isBusy ? "…" : "Make the sounds"}</button>`}</section>`;
}

function shown(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return numerals.numeral(value);
  return typeof value === "string" ? value : JSON.stringify(value);
}

const withUnit = (words, { unit }) => (unit ? `${words} [${unit}]` : words);

function Table({ rows, jobs, onError }) {
  const keep = (job) => {
    const name = prompt("Name of this variant", job.name);
    if (name) api.patch(`/api/jobs/${job.id}`, { name }).catch(onError);
  };
  const parts = [...new Set(rows.numbers.map((row) => row.part))];
  const first = html`<tr><th scope="row">verdict</th>${rows.verdicts.map((value) => html`<td>${shown(value)}</td>`)}</tr>`;
  const line = (row, label, isNumber) => {
    const isSame = row.values.every((value) => value === row.values[0]);
    return html`<tr class=${isSame ? "same" : ""}><th scope="row" class=${isNumber ? "" : "path"}>${label}</th>
      ${row.values.map((value, at) => html`<td class=${[isNumber && typeof value === "number" ? "n" : "", at === row.best ? "best" : ""].join(" ")}>${shown(value)}${at === row.best ? html`<span class="hidden"> (best)</span>` : null}</td>`)}${row.in_scatter ? html`<td class="muted small">within the scatter</td>` : null}</tr>`;
  };
  return html`<h1>Variants side by side</h1>
    <p class="muted">${rows.model.length ? `${rows.model.length} ${rows.model.length === 1 ? "value differs" : "values differ"} in the models.` : "The models are the same."} The best of a row is green where it is beyond the scatter: by twice the standard error, from eight parts of every run.</p>
    <div class="scroll" tabindex="0" role="region" aria-label="Variants side by side"><table>
      <thead><tr><td></td>${jobs.map((job) => html`<th scope="col"><a href=${`#/runs/${job.id}`}>${job.label}</a> <button type="button" class="plain small" onClick=${() => keep(job)}>Keep as …</button></th>`)}</tr></thead>
      <tbody>
        ${rows.model.length ? html`<tr class="group"><th colspan=${jobs.length + 1}>What differs</th></tr>${rows.model.map((row) => line(row, withUnit(row.path, row), false))}` : null}
        <tr class="group"><th colspan=${jobs.length + 1}>What came of it</th></tr>${first}
        ${parts.map((part) => html`<tr class="group"><th colspan=${jobs.length + 1}>${part}</th></tr>${rows.numbers.filter((row) => row.part === part).map((row) => line(row, withUnit(row.quantity, row), true))}`)}
      </tbody></table></div>`;
}

// One figure of several runs, laid over each other: panels of one title together, a colour a run. Only those are asked
// for that a job has.
function Overlay({ jobs, figures }) {
  const choices = OVERLAID.filter(([key]) => figures.some((keys) => keys.includes(key)));
  const [name, setName] = useState(choices[0]?.[0]);
  const [model, setModel] = useState(null);
  const [words, setWords] = useState("");
  useEffect(() => {
    if (!name) return;
    const shown = jobs.slice(0, COLOURS.length);
    let isGone = false;
    setModel(null);
    Promise.all(shown.map((job, k) => (figures[k].includes(name) ? api.get(`/api/jobs/${job.id}/figures/${name}.json`) : null))).then((charts) => laidOver(charts, shown)).then((made) => {
      if (isGone) return;
      setWords("");
      setModel(standIn({ chart: made }));
    }).catch((error) => setWords(error.message));
    return () => { isGone = true; };
  }, [name, jobs.map(({ label }) => label).join()]);
  if (!name) return null;
  return html`<section aria-label="Laid over each other"><div class="head"><h2 class="title">Laid over each other</h2>
      <label>Figure <select value=${name} onChange=${(event) => setName(event.target.value)}>${choices.map(([key, title]) => html`<option value=${key}>${title}</option>`)}</select></label></div>
    ${words ? html`<p class="muted">${words}</p>` : null}${model ? html`<${Widget} name="figure" model=${model} />` : null}</section>`;
}

const PREFIXES = { "": 1, k: 1e3, m: 1e-3, "µ": 1e-6, n: 1e-9 };

// What values in one title's unit are multiplied by to be in another's: "deflection [mm]" and "deflection [µm]";
// null where they are not of one kind.
function factorOf(from, to) {
  if (from === to) return 1;
  const unit = (title) => title.match(/\[(.*)\]/)?.[1] ?? title;
  for (const [first, size] of Object.entries(PREFIXES)) {
    for (const [second, other] of Object.entries(PREFIXES)) {
      const [a, b] = [unit(from), unit(to)];
      if (a.startsWith(first) && b.startsWith(second) && a.slice(first.length) === b.slice(second.length)) return size / other;
    }
  }
  return null;
}

async function laidOver(charts, jobs) {
  const first = charts.find(Boolean), plot = await widget("plot");
  const panels = new Map(), scaled = (values, factor) => (factor === 1 ? values : values.map((value) => factor * value));
  charts.forEach((chart, k) => (chart ? plot.decoded(chart).panels : []).forEach((panel) => {
    const old = panels.get(panel.title) ?? { ...panel, lines: [], bars: [], labels: [], x_range: panel.y_log ? panel.x_range : null, y_range: panel.y_log ? panel.y_range : null };
    const [across, up] = [factorOf(panel.x_title, old.x_title), factorOf(panel.unit, old.unit)];
    if (across === null || up === null) return;
    const lines = panel.lines.map((line) => ({ ...line, x: scaled(line.x, across), y: scaled(line.y, up), colour: COLOURS[k], name: jobs[k].label, legend: true, opacity: 0.7 }));
    panels.set(panel.title, { ...old, lines: [...old.lines, ...lines] });
  }));
  return { ...first, legend: [], panels: [...panels.values()].filter((panel) => panel.lines.length) };
}
