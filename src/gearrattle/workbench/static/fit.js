// Fit: values of a model that meet measured frequencies and frequency responses best, computed as a job.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { valuesOf } from "/static/live.js";

const FREE = /\.(J|stiffness|damping)$/;
const HEADS = "frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]";

// What a fit compares, as rows of the form: a natural frequency, a frequency response in a file, or a file of both.
const ROWS = {
  mode: { words: "a natural frequency", empty: { number: 2, frequency: "", standard_error: "" } },
  response: { words: "a frequency response", empty: { file: "", torque_on: "", at: "" } },
  file: { words: "a data file (TOML)", empty: { file: "" } },
};

const clean = (row) => Object.fromEntries(Object.entries(row).filter(([key, value]) => key !== "kind" && value !== ""));

export function Fit({ jobs, job, files, peak, onStarted, onError }) {
  const [model, setModel] = useState(null);
  const [free, setFree] = useState([]);
  const [rows, setRows] = useState([{ kind: "mode", ...ROWS.mode.empty }]);
  useEffect(() => {
    setModel(null);
    setFree([]);
    if (!job) return;
    api.get(`/api/jobs/${encodeURIComponent(job)}/model.toml`)
      .then((text) => api.post("/api/check", { text }).then(({ tables, title }) => setModel({ text, tables, title }))).catch(onError);
  }, [job]);
  if (!model) return null;
  const values = valuesOf(model.tables).filter(({ path }) => FREE.test(path));
  const bodies = (model.tables.inertia ?? []).map(({ name }) => name);
  const change = (at, changes) => setRows(rows.map((row, k) => (k === at ? { ...row, ...changes } : row)));
  const start = async () => {
    try {
      const edits = free.filter(({ path, start: text }) => text !== values.find((value) => value.path === path).text).map(({ path, start: text }) => ({ op: "set", path, value: text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text }));
      const { text } = edits.length ? await api.post("/api/edit", { text: model.text, edits }) : model;
      const file = rows.find(({ kind }) => kind === "file");
      const of = (kind) => rows.filter((row) => row.kind === kind).map(clean);
      const tables = Object.fromEntries(["mode", "response"].map((kind) => [kind, of(kind)]).filter(([, list]) => list.length));
      const paths = free.map(({ path }) => path);
      onStarted(await api.post("/api/jobs", { task: "fit", text, options: { data: file ? file.file : tables, free: paths }, name: `fit of ${paths.join(", ")}`.slice(0, 120), parent: job }));
    } catch (error) { onError(error); }
  };
  const isReady = free.length > 0 && rows.length > 0;
  return html`<section class="card" aria-label="Fit"><h2>Fit values of the model</h2>
    <p class="muted">Natural frequencies and frequency responses are linear: they hold while no clearance opens. The answer says how sure every value is, and what the data leave open.</p>
    <h3>Free values, and where each begins</h3>
    ${free.map(({ path, start: text }) => html`<div class="form" key=${path}><label><span class="path">${path}</span><input type="text" value=${text} aria-label=${`Start of ${path}`} onInput=${(event) => setFree(free.map((entry) => (entry.path === path ? { ...entry, start: event.target.value } : entry)))} /></label>
      <button type="button" class="plain" aria-label=${`Hold ${path}`} onClick=${() => setFree(free.filter((entry) => entry.path !== path))}>Remove</button></div>`)}
    <div class="form"><label>Free a value<select value="" onChange=${(event) => { const { path, text } = values.find((value) => value.path === event.target.value); setFree([...free, { path, start: text }]); event.target.value = ""; }}><option value="">Choose …</option>
      ${values.filter(({ path }) => !free.some((entry) => entry.path === path)).map(({ path, text }) => html`<option value=${path}>${path} = ${text}</option>`)}</select></label></div>
    <h3>Measured</h3>
    ${rows.map((row, k) => html`<${Row} key=${k} row=${row} bodies=${bodies} files=${files} peak=${peak} change=${(changes) => change(k, changes)} drop=${() => setRows(rows.filter((_, other) => other !== k))} />`)}
    <div class="form"><label>Add<select value="" onChange=${(event) => { const kind = event.target.value; setRows([...rows, { kind, ...ROWS[kind].empty }]); event.target.value = ""; }}><option value="">Choose …</option>${Object.entries(ROWS).map(([kind, { words }]) => html`<option value=${kind}>${words}</option>`)}</select></label>
      <button type="button" class="primary" disabled=${!isReady} onClick=${start}>Fit ${free.length} ${free.length === 1 ? "value" : "values"}</button></div>
  </section>`;
}

function Row({ row, bodies, files, peak, change, drop }) {
  const text = (key, words, hint) => html`<label>${words}<input type="text" value=${row[key]} placeholder=${hint} onInput=${(event) => change({ [key]: event.target.value })} /></label>`;
  const select = (key, words, options) => html`<label>${words}<select value=${row[key]} onChange=${(event) => change({ [key]: event.target.value })}><option value="">Choose …</option>${options.map((option) => html`<option value=${option}>${option}</option>`)}</select></label>`;
  const ending = (end) => files.map(({ path }) => path).filter((path) => path.toLowerCase().endsWith(end));
  const parts = {
    mode: () => html`<label>Mode number<input type="number" min="1" value=${row.number} title="As the table of modes counts: a rigid motion is number 1" onInput=${(event) => change({ number: Number(event.target.value) })} /></label>${text("frequency", "Frequency", "55 Hz")}${text("standard_error", "Standard error", "1 %, if empty")}
      ${peak ? html`<button type="button" title=${`Of ${peak.channel}, where the driveline swings by itself: after a knock, or in a run-up`} onClick=${() => change({ frequency: peak.text })}>Highest peak: ${peak.text}</button>` : null}`,
    response: () => html`${select("file", `CSV (${HEADS})`, ending(".csv"))}${select("torque_on", "Torque on", bodies)}${select("at", "Measured at", bodies)}`,
    file: () => select("file", "Data file", ending(".toml")),
  };
  return html`<fieldset class="form"><legend>${ROWS[row.kind].words}</legend>${parts[row.kind]()}<button type="button" class="plain" onClick=${drop}>Remove</button></fieldset>`;
}
