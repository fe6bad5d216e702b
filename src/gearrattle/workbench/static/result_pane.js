// One run: its name and state, what can be done with it, and its result.

import { html, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { named } from "/static/labels.js";
import { jobAnswers, standIn } from "/static/model_stand_in.js";
import { Decide, QUESTIONS } from "/static/decide.js";
import { Widget } from "/static/widget_host.js";

const ACTIVE = ["waiting", "running"], CASES = ["study", "conditions"], FILLING = [...CASES, "continuation"], PAUSE = 700; // ms between two looks at what is computed
const KEEPING = ["threshold", "remedies"]; // tasks that end with what is known
const WITH_MODEL = ["run", "simulate", "advise", "periodic", "modes"];

export function ResultPane({ job, tab, onStarted, onError, drop }) {
  const [view, setView] = useState(null);
  const [question, setQuestion] = useState("");
  const [part, setPart] = useState("");
  const path = `/api/jobs/${encodeURIComponent(job.id)}`;
  useEffect(() => {
    if (job.state !== "done") return;
    api.get(`${path}/view`).then(setView).catch(onError);
  }, [job.id, job.state]);
  return html`<article class="card" aria-label=${job.label}>
    <${Head} job=${job} view=${view} path=${path} question=${question} setQuestion=${setQuestion} onStarted=${onStarted} onError=${onError} drop=${drop} />
    ${view?.verdict && question ? html`<${Decide} key=${question} job=${job} question=${question} parts=${view.verdict.parts} selected=${part} onStarted=${onStarted} onError=${onError} />` : null}
    ${view?.changes ? html`<${Proposed} job=${job} changes=${view.changes} path=${path} onStarted=${onStarted} onError=${onError} />` : null}
    ${ACTIVE.includes(job.state) ? html`<${Running} job=${job} />` : null}
    ${!["waiting", "done"].includes(job.state) && FILLING.includes(job.task) ? html`<${Filling} job=${job} path=${path} onError=${onError} />` : null}
    ${job.problems?.length ? html`<${Problems} problems=${job.problems} />` : null}
    ${job.state === "cancelled" ? html`<p class="muted">Cancelled before it ended.</p>` : null}
    ${job.state === "done" && !view ? html`<p class="loading">Reading the result …</p>` : null}
    ${view ? html`<${Result} key=${job.id} id=${job.id} file=${job.file} view=${view} tab=${tab} path=${path} onSelected=${setPart} onStarted=${onStarted} onError=${onError} />` : null}
  </article>`;
}

function Head({ job, view, path, question, setQuestion, onStarted, onError, drop }) {
  const [isNaming, setNaming] = useState(false);
  const rename = (event) => {
    event.preventDefault();
    api.patch(path, { name: new FormData(event.target).get("name") }).then(() => setNaming(false)).catch(onError);
  };
  const cancel = () => api.post(`${path}/cancel`).catch(onError);
  const remove = () => {
    if (!confirm(`Delete "${job.label}" and its files?`)) return;
    api.delete(path).then(() => { drop(job.id); location.hash = "#/runs"; }).catch(onError);
  };
  const parent = job.parent ? html` · from <a href=${`#/runs/${job.parent}`}>its parent</a>` : null;
  return html`<div class="head">
    <div class="title">
      ${isNaming
        ? html`<form onSubmit=${rename}><label><span class="hidden">Name</span><input name="name" value=${job.name} autofocus maxlength="120" onKeyDown=${(event) => event.key === "Escape" && setNaming(false)} /></label> <button class="primary">Keep</button></form>`
        : html`<h1>${job.name ? job.label : view?.title || job.label} <button class="plain small" type="button" onClick=${() => setNaming(true)}>Rename</button></h1>`}
      <p class="muted small">${job.task}, ${when(job)}${parent}</p>
    </div>
    <div class="tools">
      ${ACTIVE.includes(job.state) ? html`<button type="button" class="danger" onClick=${cancel}>${!KEEPING.includes(job.task) || job.state === "waiting" ? "Cancel" : job.progress?.text.startsWith("stopping") ? "End at once" : "Stop"}</button>` : null}
      ${view?.verdict ? QUESTIONS.map(([key, words]) => html`<button type="button" aria-expanded=${question === key} onClick=${() => setQuestion(question === key ? "" : key)}>${words}</button>`) : null}
      <a class="button" href=${`#/edit?job=${job.id}`}>Edit</a>
      ${WITH_MODEL.includes(job.task) ? html`<a class="button" href=${`#/runs/${job.id}/vary`}>Vary values</a>` : null}
      <a class="button" href=${`#/compare?jobs=${[job.parent, job.id].filter(Boolean).join(",")}`}>Compare</a>
      ${view?.verdict ? html`<a class="button" href=${`#/measured?job=${job.id}`}>Lay measured over</a>` : null}
      ${job.state === "done" ? html`<${HandOver} job=${job} path=${path} />` : null}
      ${ACTIVE.includes(job.state) ? null : html`<button type="button" class="danger" onClick=${remove}>Delete</button>`}
    </div>
  </div>`;
}

// Changes of the model that a result proposes: one is chosen, and run.
function Proposed({ job, changes, path, onStarted, onError }) {
  const [chosen, setChosen] = useState(0);
  const run = async () => {
    try {
      const edits = Object.entries(changes[chosen].values).map(([where, value]) => ({ op: "set", path: where, value }));
      const { text } = await api.post("/api/edit", { text: await api.get(`${path}/model.toml`), file: job.file, edits });
      onStarted(await api.post("/api/jobs", { task: "run", text, file: job.file, options: {}, parent: job.id }));
    } catch (error) { onError(error); }
  };
  return html`<div class="form">
    ${changes.length > 1 ? html`<label>Change<select value=${chosen} onChange=${(event) => setChosen(Number(event.target.value))}>${changes.map(({ words }, k) => html`<option value=${k}>${words}</option>`)}</select></label>` : null}
    <button type="button" class="primary" onClick=${run}>Run with ${changes.length > 1 ? "it" : changes[0].words}</button></div>`;
}

function when(job) {
  if (!job.started) return job.state === "waiting" ? "waiting in the queue" : job.state;
  const begin = new Date(job.started), words = begin.toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
  if (!job.ended) return `since ${begin.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit" })}`;
  const seconds = (new Date(job.ended) - begin) / 1000;
  return `${words}, ${seconds < 120 ? `${seconds.toFixed(1)} s` : `${(seconds / 60).toFixed(1)} min`}`;
}

function HandOver({ job, path }) {
  const hasData = job.data_files?.length > 0;
  const files = [
    ["archive.zip", "Everything", "model, data, script, page, numbers, figures (.zip)"],
    ["report.html", "Report page", "one file, opens anywhere"],
    hasData ? ["model.zip", "Model file", "TOML, and the data files that it reads (.zip)"] : ["model.toml", "Model file", "TOML, with these settings"],
    ["script.zip", "Python script", "does the same anywhere: with the model and all it reads (.zip)"],
  ];
  return html`<details class="menu"><summary class="button">Hand over ▾</summary><div>
    ${files.map(([file, words, detail]) => html`<a href=${`${path}/${file}`} download=${file}>${words}<small>${detail}</small></a>`)}
  </div></details>`;
}

function Running({ job }) {
  const { fraction = 0, text = "" } = job.progress ?? {};
  const words = job.state === "waiting" ? "Waits for a free worker" : text || "Computing";
  return html`<div role="status"><p>${words}${fraction > 0 ? `, ${Math.round(100 * fraction)} %` : ""}</p><progress max="1" value=${fraction > 0 ? fraction : null} aria-label="Progress"></progress></div>`;
}

export function Problems({ problems }) {
  return html`<ul class="failed" role="alert">${problems.map(({ place, value, rule, remedy }) => html`<li><strong>${place}</strong>${value ? `: found ${value}` : ""}; ${rule}${remedy ? html` <span class="muted">(${remedy})</span>` : null}</li>`)}</ul>`;
}

const openCase = (id) => (chosen) => { location.hash = `#/studies?job=${id}&x=${chosen.x}&y=${chosen.y}&panel=${chosen.panel}&figure=${chosen.figure}`; };

// What is computed of a study, or followed of branches, that is under way: read again as it goes on, the tab stays.
function Filling({ job, path, onError }) {
  const [partial, setPartial] = useState(null);
  const tab = useRef(""), isBusy = useRef(false);
  const fraction = job.progress?.fraction ?? 0;
  useEffect(() => {
    if (isBusy.current || !fraction) return;
    isBusy.current = true;
    api.get(`${path}/partial`).then((made) => made && setPartial(made)).catch(onError).finally(() => setTimeout(() => { isBusy.current = false; }, PAUSE));
  }, [fraction]);
  const model = useMemo(() => {
    if (!partial) return null;
    const made = standIn({ view: partial.view, tab: tab.current, has_cases: CASES.includes(job.task) }, { figure: async ({ name }) => ({ content: { chart: partial.charts[name] } }), motions: async () => ({ content: { motions: null } }) });
    made.on("change:tab", (key) => { tab.current = key; });
    if (CASES.includes(job.task)) made.on("change:chosen", openCase(job.id));
    return made;
  }, [partial]);
  return model ? html`<section aria-label="Computed so far"><${Widget} name="result" model=${model} /></section>` : null;
}

const ACTIONS = [["run", "Run this motion"], ["edit", "Edit its model"]];

function Result({ id, file, view, tab, path, onSelected, onStarted, onError }) {
  const runMotion = async ({ point, path: of, value }) => {
    try {
      const text = await api.get(`${path}/motions/${point}/model.toml`), { labels } = await api.post("/api/check", { text, file });
      onStarted(await api.post("/api/jobs", { task: "run", text, file, options: {}, name: named([[of, Number(value.toPrecision(6))]], labels), parent: id }));
    } catch (error) { onError(error); }
  };
  const openMotion = (chosen) => {
    if (chosen.action === "run") runMotion(chosen);
    else if (chosen.action === "edit") location.hash = `#/edit?job=${id}&motion=${chosen.point}`;
  };
  const model = useMemo(() => {
    const isMotion = view.kind === "run" || view.kind === "motion";
    const made = standIn({ view, tab, links: path, has_histories: isMotion, has_sound: isMotion, has_cases: view.kind === "study", actions: ACTIONS }, jobAnswers(id));
    made.on("change:tab", (key) => history.replaceState(null, "", `#/runs/${id}/${key}`));
    made.on("change:selected", () => onSelected(String(made.get("selected")?.[0] ?? "").replace(/^[^.]*\./, "")));
    made.on("change:chosen", view.kind === "branches" ? openMotion : openCase(id));
    return made;
  }, [id, view]);
  return html`<${Widget} name="result" model=${model} />`;
}
