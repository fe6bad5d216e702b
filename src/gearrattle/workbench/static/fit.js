// Fit: values of a model that meet a recorded motion, or measured frequencies and frequency responses, best; a job.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { modelOf } from "/static/job_model.js";
import { about } from "/static/labels.js";
import { valuesOf } from "/static/live.js";

const LINEAR = /\.(J|stiffness|damping)$/;
const FIXED = /^(excitation|simulation)\.|\.order$/;
const HEADS = "frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]";

const WHAT = { motion: "the recorded motion", modes: "natural frequencies and responses", file: "a data file (TOML)" };
const WORDS = {
  motion: "Orders of the recording are compared with those of the simulated motion, impacts and all. The answer says how sure every value is, and what the recording leaves open.",
  modes: "Natural frequencies and frequency responses are linear: they hold while no clearance opens. The answer says how sure every value is, and what the data leave open.",
  file: "The file holds [[mode]] and [[response]] tables, or [recording].",
};

// What is linear and measured, as rows of the form: a natural frequency, or a frequency response in a file.
const ROWS = {
  mode: { words: "a natural frequency", empty: { number: 2, frequency: "", standard_error: "" } },
  response: { words: "a frequency response", empty: { file: "", torque_on: "", at: "" } },
};

const clean = (row) => Object.fromEntries(Object.entries(row).filter(([key, value]) => key !== "kind" && value !== ""));
const isNumber = (text) => text.trim() !== "" && Number.isFinite(Number(text));

export function Fit({ job, files, file, known, pair, peak, onStarted, onError }) {
  const [model, setModel] = useState(null);
  const [free, setFree] = useState([]);
  const [what, setWhat] = useState("modes");
  const [rows, setRows] = useState([{ kind: "mode", ...ROWS.mode.empty }]);
  const [dataFile, setDataFile] = useState("");
  const [partners, setPartners] = useState({});
  const [span, setSpan] = useState({ start: "", end: "", cycles: "", discard: "" });
  useEffect(() => {
    setModel(null);
    setFree([]);
    if (!job) return;
    modelOf(job).then(setModel).catch(onError);
  }, [job]);
  const isMeasured = Boolean(file && known.measured && known.simulated);
  useEffect(() => { if (isMeasured) { setPartners(partnersOf(known, pair)); setWhat("motion"); } }, [isMeasured, known.measured, known.simulated]);
  useEffect(() => { if (pair.measured && pair.simulated && isSameUnit(known, pair)) setPartners((old) => ({ ...old, [pair.measured]: pair.simulated })); }, [pair.measured, pair.simulated]);
  if (!model) return null;
  const values = valuesOf(model).filter(({ path }) => (what === "modes" ? LINEAR.test(path) : !FIXED.test(path)));
  const bodies = (model.tables.inertia ?? []).map(({ name }) => name);
  const change = (at, changes) => setRows((before) => before.map((row, k) => (k === at ? { ...row, ...changes } : row)));
  const match = Object.fromEntries(Object.entries(partners).filter(([, partner]) => partner));
  const data = () => {
    if (what === "file") return dataFile;
    if (what === "motion") return { recording: { file, match, ...numbers(span, ["start", "end"]), settings: numbers(span, ["cycles", "discard"]) } };
    return Object.fromEntries(Object.keys(ROWS).map((kind) => [kind, rows.filter((row) => row.kind === kind).map(clean)]).filter(([, list]) => list.length));
  };
  const start = async () => {
    try {
      const edits = free.filter(({ path, start: text }) => text !== values.find((value) => value.path === path).text).map(({ path, start: text }) => ({ op: "set", path, value: isNumber(text) ? Number(text) : text }));
      const { text } = edits.length ? await api.post("/api/edit", { text: model.text, file: model.file, edits }) : model;
      const paths = free.map(({ path }) => path);
      onStarted(await api.post("/api/jobs", { task: "fit", text, options: { data: data(), free: paths }, name: about("fit of", paths, model.labels), parent: job }));
    } catch (error) { onError(error); }
  };
  const missing = !free.length ? "Free a value first." : { motion: Object.keys(match).length ? "" : "Pair a measured channel with a simulated one first.", modes: rows.length ? "" : "Add what was measured first.", file: dataFile ? "" : "Choose the data file first." }[what];
  const choose = (next) => { setWhat(next); setFree(next === "modes" ? free.filter(({ path }) => LINEAR.test(path)) : free); };
  const parts = {
    motion: () => html`<${Motion} file=${file} known=${known} partners=${partners} setPartners=${setPartners} span=${span} setSpan=${setSpan} />`,
    modes: () => html`${rows.map((row, k) => html`<${Row} key=${k} row=${row} bodies=${bodies} files=${files} peak=${peak} change=${(changes) => change(k, changes)} drop=${() => setRows((before) => before.filter((_, other) => other !== k))} />`)}
      <div class="form"><label>Add<select value="" onChange=${(event) => { const kind = event.target.value; setRows((before) => [...before, { kind, ...ROWS[kind].empty }]); event.target.value = ""; }}><option value="">Choose …</option>${Object.entries(ROWS).map(([kind, { words }]) => html`<option value=${kind}>${words}</option>`)}</select></label></div>`,
    file: () => html`<div class="form"><label>Data file<select value=${dataFile} onChange=${(event) => setDataFile(event.target.value)}><option value="">Choose …</option>${ending(files, ".toml").map((path) => html`<option value=${path}>${path}</option>`)}</select></label></div>`,
  };
  return html`<section class="card" aria-label="Fit"><h2>Fit values of the model</h2>
    <div class="form"><label>Fit to<select value=${what} onChange=${(event) => choose(event.target.value)}>${Object.entries(WHAT).map(([key, words]) => html`<option value=${key} disabled=${key === "motion" && !isMeasured}>${words}${key === "motion" ? (isMeasured ? ` in ${file}` : " (choose a measured file above)") : ""}</option>`)}</select></label></div>
    <p class="muted">${WORDS[what]}</p>
    <h3>Free values, and where each begins</h3>
    ${free.map(({ path, start: text, si }) => html`<div class="form" key=${path}><label><span class="path">${path}${si && isNumber(text) ? ` [${si}]` : ""}</span><input type="text" value=${text} aria-label=${`Start of ${path}`} onInput=${(event) => setFree(free.map((entry) => (entry.path === path ? { ...entry, start: event.target.value } : entry)))} /></label>
      <button type="button" class="plain" aria-label=${`Hold ${path}`} onClick=${() => setFree(free.filter((entry) => entry.path !== path))}>Remove</button></div>`)}
    <div class="form"><label>Free a value<select value="" onChange=${(event) => { const { path, text, si } = values.find((value) => value.path === event.target.value); setFree([...free, { path, start: text, si }]); event.target.value = ""; }}><option value="">Choose …</option>
      ${values.filter(({ path }) => !free.some((entry) => entry.path === path)).map(({ path, words }) => html`<option value=${path}>${path} = ${words}</option>`)}</select></label></div>
    <h3>${what === "motion" ? "Measured channels, and what of the model each is" : "Measured"}</h3>
    ${parts[what]()}
    <div class="form"><button type="button" class="primary" disabled=${Boolean(missing)} onClick=${start}>Fit ${free.length} ${free.length === 1 ? "value" : "values"}</button>${missing ? html`<p class="muted small">${missing}</p>` : null}</div>
  </section>`;
}

// The numbers that were typed, by key; a text that is none is sent as it is, and refused with its place.
const numbers = (texts, keys) => Object.fromEntries(keys.filter((key) => texts[key].trim()).map((key) => [key, Number.isFinite(Number(texts[key])) ? Number(texts[key]) : texts[key]]));

const unitOf = (channels, name) => channels.find((channel) => channel.name === name)?.unit;
const isSameUnit = ({ simulated, measured }, pair) => Boolean(simulated && measured) && unitOf(measured.channels, pair.measured) === unitOf(simulated.channels, pair.simulated);

// The simulated channel of every measured one: of the same quantity and subject, or the one that is laid under it.
function partnersOf({ simulated, measured }, pair) {
  const chosen = {};
  for (const channel of measured.channels) {
    const same = channel.quantity && simulated.channels.find((other) => other.quantity === channel.quantity && other.label === channel.label);
    chosen[channel.name] = same ? same.name : "";
  }
  if (pair.measured in chosen && isSameUnit({ simulated, measured }, pair)) chosen[pair.measured] = pair.simulated;
  return chosen;
}

function Motion({ known, partners, setPartners, span, setSpan }) {
  if (!known.measured || !known.simulated) return null;
  const field = (key, words, hint) => html`<label>${words}<input type="text" inputmode="decimal" value=${span[key]} placeholder=${hint} onInput=${(event) => setSpan((before) => ({ ...before, [key]: event.target.value }))} /></label>`;
  return html`${known.measured.channels.map(({ name, unit }) => {
    const options = known.simulated.channels.filter((other) => other.unit === unit);
    return html`<div class="form" key=${name}><label><span class="path">${name}${unit ? ` [${unit}]` : ""}</span><select value=${partners[name] ?? ""} aria-label=${`Partner of ${name}`} onChange=${(event) => setPartners((before) => ({ ...before, [name]: event.target.value }))}>
      <option value="">${options.length ? "left out" : "left out: nothing simulated has this unit"}</option>${options.map((other) => html`<option value=${other.name}>${other.name}</option>`)}</select></label></div>`;
  })}
    <div class="form">${field("start", "From [s]", `${Number(known.measured.begin.toPrecision(4))}, its begin`)}${field("end", "To [s]", `${Number(known.measured.end.toPrecision(4))}, its end`)}
      ${field("cycles", "Cycles of each simulation", "as the run")}${field("discard", "Left out at its start", "as the run")}</div>`;
}

const ending = (files, end) => files.map(({ path }) => path).filter((path) => path.toLowerCase().endsWith(end));

function Row({ row, bodies, files, peak, change, drop }) {
  const text = (key, words, hint) => html`<label>${words}<input type="text" value=${row[key]} placeholder=${hint} onInput=${(event) => change({ [key]: event.target.value })} /></label>`;
  const select = (key, words, options) => html`<label>${words}<select value=${row[key]} onChange=${(event) => change({ [key]: event.target.value })}><option value="">Choose …</option>${options.map((option) => html`<option value=${option}>${option}</option>`)}</select></label>`;
  const parts = {
    mode: () => html`<label>Mode number<input type="number" min="1" value=${row.number} title="As the table of modes counts: a rigid motion is number 1" onInput=${(event) => change({ number: Number(event.target.value) })} /></label>${text("frequency", "Frequency", "55 Hz")}${text("standard_error", "Standard error", "1 %, if empty")}
      ${peak ? html`<button type="button" title=${`Of ${peak.channel}, where the driveline swings by itself: after a knock, or in a run-up`} onClick=${() => change({ frequency: peak.text })}>Highest peak: ${peak.text}</button>` : null}`,
    response: () => html`${select("file", `CSV (${HEADS})`, ending(files, ".csv"))}${select("torque_on", "Torque on", bodies)}${select("at", "Measured at", bodies)}`,
  };
  return html`<fieldset class="form"><legend>${ROWS[row.kind].words}</legend>${parts[row.kind]()}<button type="button" class="plain" onClick=${drop}>Remove</button></fieldset>`;
}
