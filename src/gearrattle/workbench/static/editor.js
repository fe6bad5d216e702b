// The editor: a driveline as a drawing, the form of what is selected, and the text of the model file. Every change is
// an edit of the text, made by the server, so that all three always agree; undo goes back to earlier texts.

import { html, render, useEffect, useRef, useState } from "/static/vendor/htm-preact.js";
import { Drawing } from "/static/driveline.js";
import { Row } from "/static/form.js";

const PAUSE = 300; // ms without a key before the text is checked
const MOST_UNDONE = 200;
const NEW = 'schema = 1\nname = "new driveline"\n\n[excitation]\nspeed = "1500 rpm"\n';

export async function mountEditor(el, { api, onRun, onError, text }) {
  const [schema, shelf] = await Promise.all([api.get("/api/schema"), api.get("/api/components")]);
  render(html`<${Editor} api=${api} onRun=${onRun} onError=${onError} schema=${schema} shelf=${shelf} first=${text ?? NEW} />`, el);
  return { destroy: () => render(null, el) };
}

// A text, what the server says of it, and the texts before and after it.
function useModel(api, first, onError) {
  const [text, setText] = useState(first);
  const [answer, setAnswer] = useState(null);
  const history = useRef({ past: [], future: [] });
  const newest = useRef(0);
  const ask = async (request) => {
    const number = ++newest.current;
    try {
      const made = await request();
      if (number === newest.current) setAnswer((old) => ({ ...made, drawing: made.drawing ?? old?.drawing, tables: made.tables ?? old?.tables, isStale: !made.tables }));
      return made;
    } catch (error) { if (number === newest.current) onError(error); return null; }
  };
  const check = (value) => ask(() => api.post("/api/check", { text: value }));
  const put = (value) => {
    if (value === text) return;
    history.current.past = [...history.current.past, text].slice(-MOST_UNDONE);
    history.current.future = [];
    setText(value);
  };
  const edit = async (...edits) => {
    const made = await ask(() => api.post("/api/edit", { text, edits }));
    if (made) put(made.text);
    return made;
  };
  const go = (from, to) => {
    const value = history.current[from].at(-1);
    if (value === undefined) return;
    history.current[from] = history.current[from].slice(0, -1);
    history.current[to] = [...history.current[to], text];
    setText(value);
    check(value);
  };
  useEffect(() => { check(first); }, []);
  const open = (value) => { put(value); check(value); };
  return { text, answer, check, put, edit, open, undo: () => go("past", "future"), redo: () => go("future", "past"), canUndo: history.current.past.length > 0, canRedo: history.current.future.length > 0 };
}

function Editor({ api, onRun, onError, schema, shelf, first }) {
  const model = useModel(api, first, onError);
  const [selected, setSelected] = useState(null);
  const [adding, setAdding] = useState(null);
  const area = useRef(null);
  const { answer } = model;
  const tables = answer?.tables ?? {};
  const bodies = (tables.inertia ?? []).map((row) => row.name).filter(Boolean);
  const problems = answer?.problems ?? [];
  const row = selected && valueAt(tables, selected);
  const select = (path) => {
    setSelected(path);
    setAdding(null);
    const header = answer?.headers.find((entry) => String(entry.path) === String(path));
    if (header && area.current) area.current.scrollTop = (header.line - 3) * parseFloat(getComputedStyle(area.current).lineHeight);
  };
  const remove = async () => { if (row && (await model.edit({ op: "delete", path: selected }))) setSelected(null); };
  const parts = shelf.filter(({ table }) => schema.properties[table].type === "array");
  const add = async (entry, ends) => {
    const value = withEnds(named(entry, tables), entry, ends);
    const made = await model.edit({ op: "add", table: entry.table, value });
    if (made) { setSelected([entry.table, (made.tables[entry.table]?.length ?? 1) - 1]); setAdding(null); }
  };
  const keys = (event) => {
    const isText = /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName);
    const isUndo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
    if (isUndo && event.target !== area.current) { event.preventDefault(); if (event.shiftKey) model.redo(); else model.undo(); }
    if (event.key === "Delete" && !isText) remove();
  };
  return html`<div class="editor" onKeyDown=${keys}>
    <${Bar} api=${api} model=${model} onRun=${onRun} onError=${onError} isSound=${answer && !problems.length && bodies.length > 0} />
    <section class="card canvas" aria-label="Drawing">
      <div class="palette" role="toolbar" aria-label="Add">${parts.map((entry) => html`<button type="button" key=${entry.table} title=${entry.words}
        aria-expanded=${adding === entry} disabled=${entry.ends.some((end) => !end.ground) && !bodies.length}
        onClick=${() => (entry.ends.length ? setAdding(adding === entry ? null : entry) : add(entry, []))}>
        <svg viewBox=${`-3 -22 ${entry.width + 6} 44`} aria-hidden="true"><path d=${`M0 0 ${entry.symbol}`} /></svg>${entry.title}</button>`)}</div>
      ${adding ? html`<${Ends} key=${adding.table} entry=${adding} bodies=${bodies} add=${add} />` : null}
      ${answer?.drawing?.bodies.length ? html`<${Drawing} drawing=${answer.drawing} selected=${selected} select=${select} problems=${problems}
          connect=${(from, to) => { const entry = shelf.find((one) => one.ends.length === 2); if (entry) setAdding({ ...entry, chosen: [from, to] }); }} />`
        : html`<p class="loading">Add an inertia, or open an example.</p>`}
      ${answer?.isStale ? html`<p class="small failed">The text is no TOML now; the drawing shows what it was.</p>` : null}
    </section>
    <section class="card form-side" aria-label="Form">
      ${row ? html`<${Row} key=${String(selected)} schema=${schema} tables=${tables} path=${selected} value=${row} problems=${problems} bodies=${bodies} edit=${model.edit} />
          <p><button type="button" class="danger" onClick=${remove}>Delete</button></p>`
        : html`<h2>Driveline</h2><${Top} schema=${schema} tables=${tables} problems=${problems} bodies=${bodies} edit=${model.edit} /><p class="muted small">Select a part of the drawing to change it. Drag from one body to another to connect them.</p>`}
      ${row ? html`<p><button type="button" class="plain" onClick=${() => setSelected(null)}>Speed and run settings</button></p>` : null}
    </section>
    <section class="card text-side" aria-label="Model file"><h2 id="toml">Model file</h2><${Text} model=${model} area=${area} />
      <${Problems} problems=${problems} notes=${answer?.notes ?? []} select=${select} tables=${tables} /></section>
  </div>`;
}

function Bar({ api, model, onRun, onError, isSound }) {
  const [lists, setLists] = useState({ examples: [], files: [] });
  const [name, setName] = useState("driveline.toml");
  const [saved, setSaved] = useState("");
  const read = () => Promise.all([api.get("/api/examples"), api.get("/api/files")])
    .then(([examples, files]) => setLists({ examples, files: files.filter((file) => file.kind === "model") })).catch(onError);
  useEffect(() => { read(); }, []);
  const open = async (choice) => {
    if (!choice) return;
    const kind = choice.slice(0, 1), key = choice.slice(1);
    try {
      model.open(kind === "e" ? (await api.get(`/api/examples/${encodeURIComponent(key)}`)).text : await api.get(`/api/files/${key.split("/").map(encodeURIComponent).join("/")}`));
      setName(kind === "e" ? `${key}.toml` : key);
    } catch (error) { onError(error); }
  };
  const save = async (event) => {
    event.preventDefault();
    const path = name.endsWith(".toml") ? name : `${name}.toml`;
    try { await api.put(`/api/files/${path.split("/").map(encodeURIComponent).join("/")}`, model.text); setSaved(`saved as ${path}`); read(); } catch (error) { onError(error); }
  };
  return html`<div class="bar">
    <label><span class="hidden">Open</span><select value="" aria-label="Open" onChange=${(event) => { open(event.target.value); event.target.value = ""; }}><option value="">Open …</option>
      <optgroup label="Files">${lists.files.map(({ path }) => html`<option value=${`f${path}`}>${path}</option>`)}</optgroup>
      <optgroup label="Examples">${lists.examples.map(({ name: key, title }) => html`<option value=${`e${key}`}>${title || key}</option>`)}</optgroup></select></label>
    <button type="button" onClick=${() => model.open(NEW)}>New</button>
    <button type="button" disabled=${!model.canUndo} onClick=${model.undo} title="Ctrl+Z">Undo</button>
    <button type="button" disabled=${!model.canRedo} onClick=${model.redo} title="Ctrl+Shift+Z">Redo</button>
    <form onSubmit=${save}><label><span class="hidden">File name</span><input aria-label="File name" value=${name} onInput=${(event) => { setName(event.target.value); setSaved(""); }} /></label><button>Save</button></form>
    <span class="muted small" role="status">${saved}</span>
    <button type="button" class="primary run" disabled=${!isSound} onClick=${() => onRun(model.text)}>Run</button>
  </div>`;
}

// What a new component joins: chosen by name, from the keyboard as well.
function Ends({ entry, bodies, add }) {
  const [ends, setEnds] = useState(entry.ends.map((end, k) => entry.chosen?.[k] ?? bodies[Math.min(k, bodies.length - 1)] ?? "ground"));
  return html`<form class="ends" onSubmit=${(event) => { event.preventDefault(); add(entry, ends); }}>
    ${entry.ends.map((end, k) => html`<label>${end.title}<select value=${ends[k]} onChange=${(event) => setEnds(ends.map((old, j) => (j === k ? event.target.value : old)))}>
      ${[...bodies, ...(end.ground ? ["ground"] : [])].map((name) => html`<option value=${name}>${name}</option>`)}</select></label>`)}
    <button class="primary">Add ${entry.title.toLowerCase()}</button></form>`;
}

function Top({ schema, tables, problems, bodies, edit }) {
  return ["excitation", "simulation"].map((name) => html`<${Row} key=${name} schema=${schema} tables=${tables} path=${[name]} value=${tables[name] ?? {}} problems=${problems} bodies=${bodies} edit=${edit} />`);
}

function Text({ model, area }) {
  const timer = useRef(0);
  const typed = (event) => {
    const value = event.target.value;
    model.put(value);
    clearTimeout(timer.current);
    timer.current = setTimeout(() => model.check(value), PAUSE);
  };
  return html`<textarea ref=${area} class="model-text" aria-labelledby="toml" spellcheck="false" wrap="off" value=${model.text} onInput=${typed}></textarea>`;
}

function Problems({ problems, notes, select, tables }) {
  const rowOf = (path) => (Array.isArray(valueAt(tables, path.slice(0, 1))) ? path.slice(0, 2) : path.slice(0, 1));
  return html`<ul class="problems" aria-live="polite" aria-label="Problems">${problems.map((problem) => html`<li>
      <button type="button" class="plain" disabled=${!problem.path?.length} onClick=${() => select(rowOf(problem.path))}>${problem.place}</button>
      ${problem.value ? html` <code>${problem.value}</code>` : null} ${problem.rule}${problem.remedy ? html` <span class="muted">(${problem.remedy})</span>` : null}</li>`)}
    ${notes.map((note) => html`<li class="muted">${note}</li>`)}</ul>`;
}

export const valueAt = (tables, path) => path.reduce((value, key) => value?.[key], tables);

// The template of a component under a name that no other row of its table has.
function named(entry, tables) {
  const value = structuredClone(entry.template);
  if (!("name" in value)) return value;
  const names = new Set(Object.values(tables).filter(Array.isArray).flat().map((row) => row?.name));
  let number = 1;
  while (names.has(`${entry.table}_${number}`)) number += 1;
  return { ...value, name: `${entry.table}_${number}` };
}

function withEnds(value, entry, ends) {
  entry.ends.forEach(({ path, many }, k) => {
    const last = path.at(-1), node = path.slice(0, -1).reduce((inner, key) => inner[key], value);
    node[last] = ends[k];
    if (many && Array.isArray(node)) node.length = 1;
  });
  return value;
}
