// The shell of the workbench: navigation, the list of runs, and what each page shows. Widgets draw, the server computes.

import { html, render, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { labelled } from "/static/labels.js";
import { ResultPane } from "/static/result_pane.js";
import { Compare } from "/static/compare.js";
import { Live } from "/static/live.js";
import { Measured } from "/static/measured.js";
import { Studies } from "/static/studies.js";
import { Edit } from "/static/edit.js";

const PAGES = [["edit", "Edit"], ["runs", "Runs"], ["compare", "Compare"], ["measured", "Measured"], ["studies", "Studies"]];
const ACTIVE = ["waiting", "running"];
const SCHEMES = { "": "Auto", light: "Light", dark: "Dark" };

function route() {
  const [path, query] = location.hash.replace(/^#\/?/, "").split("?");
  const [page, ...rest] = path.split("/").map(decodeURIComponent);
  return { page: PAGES.some(([name]) => name === page) ? page : "edit", rest, query: new URLSearchParams(query) };
}

function useRoute() {
  const [now, setNow] = useState(route);
  useEffect(() => {
    const changed = () => setNow(route());
    addEventListener("hashchange", changed);
    changed(); // the address may have changed since the page was drawn
    return () => removeEventListener("hashchange", changed);
  }, []);
  return now;
}

// All jobs, newest first, kept current by the socket; read again when it rejoins. A message that comes while
// the list is read is newer than the list.
function useJobs(onError) {
  const [jobs, setJobs] = useState(null);
  const [isJoined, setJoined] = useState(true);
  const drop = (id) => setJobs((old) => updated(old, { deleted: id }));
  useEffect(() => {
    let during = null; // messages since the list was asked for
    const read = () => {
      const messages = [];
      during = messages;
      api.get("/api/jobs").then((list) => {
        if (during !== messages) return;
        during = null;
        setJobs(messages.reduce(updated, sorted(list)));
      }).catch((error) => { setJobs((old) => old ?? []); onError(error); });
    };
    read();
    return api.events((message) => {
      during?.push(message);
      if ("joined" in message) { setJoined(message.joined); if (message.joined) read(); }
      if (message.job || message.deleted) setJobs((old) => updated(old, message));
    });
  }, []);
  return { jobs, isJoined, drop };
}

function updated(jobs, { job, deleted }) {
  const id = job?.id ?? deleted;
  return sorted([...(job ? [job] : []), ...(jobs ?? []).filter((other) => other.id !== id)]);
}

const sorted = (jobs) => labelled([...jobs].sort((a, b) => String(b.created).localeCompare(String(a.created))));

// Every run below the run that it came from.
function ordered(jobs) {
  const known = new Set(jobs.map((job) => job.id)), rows = [];
  const add = (job, depth) => {
    rows.push([job, Math.min(3, depth)]);
    for (const child of jobs.filter((other) => other.parent === job.id).reverse()) add(child, depth + 1);
  };
  for (const job of jobs) if (!known.has(job.parent)) add(job, 0);
  return rows;
}

function RunList({ jobs, chosen }) {
  if (!jobs) return html`<p class="loading">Reading …</p>`;
  return html`<ul class="runs">${ordered(jobs).map(([job, depth]) => html`
    <li key=${job.id} class=${depth ? `child depth-${depth}` : ""}>
      <a href=${`#/runs/${job.id}`} aria-current=${job.id === chosen ? "page" : null}>
        <span class="name">${job.label}</span>
        <span class="what"><span>${job.task}</span><${State} job=${job} /></span>
        ${ACTIVE.includes(job.state) && job.progress ? html`<progress max="1" value=${job.progress.fraction ?? 0} aria-label=${`Progress of ${job.label}`}></progress>` : null}
        ${job.state === "done" && job.sentence ? html`<span class="sentence">${job.sentence}</span>` : null}
      </a>
    </li>`)}</ul>`;
}

function State({ job }) {
  const when = job.ended ?? job.started ?? job.created;
  const clock = when ? new Date(when).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" }) : "";
  return html`<span class=${job.state}>${job.state === "done" ? clock : job.state}</span>`;
}

function Runs({ jobs, id, tab, onStarted, onError, drop }) {
  const chosen = id ?? jobs?.[0]?.id;
  const job = jobs?.find((entry) => entry.id === chosen);
  if (jobs && !jobs.length) {
    return html`<div class="page card empty"><h1>No runs yet</h1>
      <p>A run appears here with its verdict, histories, figures and files as soon as it is started.</p>
      <div class="choices"><a class="button primary" href="#/edit">Draw or open a driveline</a></div></div>`;
  }
  return html`<div class="page split">
    <aside class="card side" aria-label="Runs"><h2>Runs</h2><${RunList} jobs=${jobs} chosen=${chosen} /></aside>
    <div>${job ? html`<${ResultPane} key=${job.id} job=${job} tab=${tab} onStarted=${onStarted} onError=${onError} drop=${drop} />`
      : jobs ? html`<div class="card empty"><p>There is no such run; choose one on the left.</p></div>` : null}</div>
  </div>`;
}

function SchemeChoice() {
  const [scheme, setScheme] = useState(localStorage.getItem("gr-scheme") ?? "");
  useEffect(() => {
    if (scheme) document.documentElement.dataset.scheme = scheme; else delete document.documentElement.dataset.scheme;
    localStorage.setItem("gr-scheme", scheme);
    dispatchEvent(new Event("gr-theme"));
  }, [scheme]);
  return html`<label><span class="hidden">Colours</span><select value=${scheme} onChange=${(event) => setScheme(event.target.value)}>
    ${Object.entries(SCHEMES).map(([key, words]) => html`<option value=${key}>${words}</option>`)}</select></label>`;
}

function App() {
  const { page, rest, query } = useRoute();
  const [error, setError] = useState(null);
  const onError = (problem) => setError(problem instanceof Error ? problem.message : String(problem));
  const { jobs, isJoined, drop } = useJobs(onError);
  const main = useRef(null);
  useEffect(() => { setError(null); document.title = `${PAGES.find(([name]) => name === page)[1]} · gearrattle`; }, [page]);
  const active = useMemo(() => (jobs ?? []).filter((job) => ACTIVE.includes(job.state)).length, [jobs]);
  const started = (job) => { location.hash = `#/runs/${job.id}`; };
  const pages = {
    edit: () => html`<${Edit} from=${query.get("job")} motion=${query.get("motion")} name=${query.get("name")} jobs=${jobs} onStarted=${started} onError=${onError} />`,
    runs: () => (rest[1] === "vary"
      ? html`<${Live} key=${rest[0]} id=${rest[0]} onStarted=${started} onError=${onError} />`
      : html`<${Runs} jobs=${jobs} id=${rest[0]} tab=${rest[1]} onStarted=${started} onError=${onError} drop=${drop} />`),
    compare: () => html`<${Compare} jobs=${jobs} chosen=${(query.get("jobs") ?? "").split(",").filter(Boolean)} onError=${onError} />`,
    measured: () => html`<${Measured} jobs=${jobs} query=${query} onStarted=${started} onError=${onError} />`,
    studies: () => html`<${Studies} jobs=${jobs} onStarted=${started} onError=${onError} />`,
  };
  return html`
    <a class="skip" href="#main" onClick=${(event) => { event.preventDefault(); main.current.focus(); }}>To the content</a>
    <header class="top">
      <a class="brand" href="#/edit"><img src="/static/icon.svg" alt="" /><span>gearrattle</span></a>
      <nav aria-label="Workbench">${PAGES.map(([name, words]) => html`
        <a href=${`#/${name}`} aria-current=${name === page ? "page" : null}>${words}${name === "runs" && active ? html`<span class="badge" aria-label=${`${active} running or waiting`}>${active}</span>` : null}</a>`)}
      </nav>
      <div class="end">${isJoined ? null : html`<span class="failed small" role="status">not connected</span>`}<${SchemeChoice} /></div>
    </header>
    ${error ? html`<div class="alert" role="alert"><span>${error}</span><button type="button" onClick=${() => setError(null)}>Close</button></div>` : null}
    <main id="main" tabindex="-1" ref=${main}>${pages[page]()}</main>`;
}

const root = document.getElementById("app");
root.replaceChildren();
render(html`<${App} />`, root);
