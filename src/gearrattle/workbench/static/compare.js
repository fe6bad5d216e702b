// Variants side by side: what differs in their models, and what came of it; the best one is kept by its name.

import { html, useEffect, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";

const WORSE = { quiet: 0, "single-sided": 1, "double-sided": 2 };
const SMALLER = new Set(["impacts per second", "fastest approach", "hardest impact", "loose-gear margin"]);

export function Compare({ jobs, chosen, onError }) {
  const [rows, setRows] = useState(null);
  const done = (jobs ?? []).filter((job) => job.state === "done");
  const known = chosen.filter((id) => done.some((job) => job.id === id));
  const key = known.join(",");
  useEffect(() => {
    setRows(null);
    if (known.length > 1) api.get(`/api/compare?jobs=${key}`).then(setRows).catch(onError);
  }, [key]);
  const toggle = (id, isOn) => { location.hash = `#/compare?jobs=${(isOn ? [...known, id] : known.filter((other) => other !== id)).join(",")}`; };
  return html`<div class="page split">
    <aside class="card side checks" aria-label="Runs to compare"><h2>Runs to compare</h2>
      ${done.length ? done.map((job) => html`<label key=${job.id}><input type="checkbox" checked=${known.includes(job.id)} onChange=${(event) => toggle(job.id, event.target.checked)} /><span>${job.name || job.task}</span></label>`) : html`<p class="loading">No finished runs yet.</p>`}
    </aside>
    <article class="card">
      ${known.length < 2 ? html`<div class="empty"><h1>Compare variants</h1><p>Mark two runs or more on the left. What differs in their models is named, and what came of it stands side by side.</p></div>`
        : rows ? html`<${Table} rows=${rows} jobs=${known.map((id) => done.find((job) => job.id === id))} onError=${onError} />` : html`<p class="loading">Reading …</p>`}
    </article>
  </div>`;
}

function shown(value) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "number") return String(Number(value.toPrecision(4))).replace("-", "−");
  return typeof value === "string" ? value : JSON.stringify(value);
}

// Index of the best value of a row; -1 where there is none that is better than another.
function best({ quantity, values }) {
  const size = quantity === "regime" ? (value) => WORSE[value] : SMALLER.has(quantity) ? (value) => value : null;
  if (!size) return -1;
  const sizes = values.map((value) => (value === null || value === undefined ? Infinity : size(value)));
  const least = Math.min(...sizes);
  return sizes.filter((other) => other === least).length === 1 ? sizes.indexOf(least) : -1;
}

function Table({ rows, jobs, onError }) {
  const keep = (job) => {
    const name = prompt("Name of the variant that is kept", job.name);
    if (name) api.patch(`/api/jobs/${job.id}`, { name }).catch(onError);
  };
  const parts = [...new Set(rows.numbers.map((row) => row.part))];
  const first = html`<tr><th scope="row">verdict</th>${rows.verdicts.map((value) => html`<td>${shown(value)}</td>`)}</tr>`;
  const line = (row, label, isNumber) => {
    const isSame = row.values.every((value) => value === row.values[0]), k = isSame ? -1 : best(row);
    return html`<tr class=${isSame ? "same" : ""}><th scope="row" class=${isNumber ? "" : "path"}>${label}</th>
      ${row.values.map((value, at) => html`<td class=${[isNumber && typeof value === "number" ? "n" : "", at === k ? "best" : ""].join(" ")}>${shown(value)}${at === k ? html`<span class="hidden"> (best)</span>` : null}</td>`)}</tr>`;
  };
  return html`<h1>Variants side by side</h1>
    <p class="muted">${rows.model.length ? `${rows.model.length} ${rows.model.length === 1 ? "value differs" : "values differ"} in the models.` : "The models are the same."} The best of a row is green.</p>
    <div class="scroll" tabindex="0" role="region" aria-label="Variants side by side"><table>
      <thead><tr><th></th>${jobs.map((job) => html`<th scope="col"><a href=${`#/runs/${job.id}`}>${job.name || job.task}</a> <button type="button" class="plain small" onClick=${() => keep(job)}>Keep as …</button></th>`)}</tr></thead>
      <tbody>
        ${rows.model.length ? html`<tr class="group"><th colspan=${jobs.length + 1}>What differs</th></tr>${rows.model.map((row) => line(row, row.path, false))}` : null}
        <tr class="group"><th colspan=${jobs.length + 1}>What came of it</th></tr>${first}
        ${parts.map((part) => html`<tr class="group"><th colspan=${jobs.length + 1}>${part}</th></tr>${rows.numbers.filter((row) => row.part === part).map((row) => line(row, `${row.quantity}${row.unit ? ` [${row.unit}]` : ""}`, true))}`)}
      </tbody></table></div>`;
}
