// The Edit view: a driveline as drawing, form and text, each of which changes the others through the server.

import { html, render, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { standIn } from "/static/model_stand_in.js";
import { Widget } from "/static/widget_host.js";
import { Form } from "/static/form.js";
import numerals from "/widgets/numerals.js";
import { labelled } from "/static/labels.js";
import { TomlText } from "/static/toml.js";

const DRAFT = "gearrattle.draft", TEXT_SHOWN = "gearrattle.text", MOST_KEPT = 500, PAUSE = 250, VERDICT_PAUSE = 350, DRAFT_PAUSE = 200; // ms after the last change
const NEW = 'schema = 1\nname = "New driveline"\nunits = "SI"\n\n[excitation]\nspeed = "800 rpm"\n\n[simulation]\ncycles = 100\ndiscard = 50\n';
const EMPTY = { problems: [], notes: [], drawing: null, tables: null, headers: [], title: "" };
const SINGLE = ["excitation", "simulation", "criteria"];

const { numeral } = numerals;
const keyOf = (path) => path.join(".");
const pathOf = (key) => (key ? key.split(".").map((part) => (/^\d+$/.test(part) ? Number(part) : part)) : null);
// The file that names of data files are relative to: where the text is saved, or the file of the run that it comes from.
const fileOf = ({ name, origin }) => name || origin;
const addressOf = (file) => `/api/files/${file.split("/").map(encodeURIComponent).join("/")}`;
const folderOf = (file) => file.slice(0, file.lastIndexOf("/") + 1);
const copy = (value) => JSON.parse(JSON.stringify(value));
const rowsOf = (tables, kind) => (Array.isArray(tables?.[kind]) ? tables[kind] : []);

// The model of a run goes back to its file. Where that holds something else, Save asks before it replaces it; where it is
// gone, names of data files are still relative to where it was.
export async function withFile(api, text, { id, file }) {
  if (!file) return { text, name: "", parent: id };
  const saved = await api.get(addressOf(file)).catch((error) => { if (error.status !== 404) throw error; });
  if (saved === undefined) return { text, name: "", origin: file, parent: id };
  if (saved !== text) api.forget(addressOf(file));
  return { text, name: file, saved, parent: id, message: saved === text ? "" : `This is the model of the run. ${file} holds other values; Save asks before it replaces them.` };
}

function valueAt(tables, path) {
  return path.reduce((node, part) => (node && typeof node === "object" ? node[part] : undefined), tables);
}

// What the drawing says of an element: a gap rattles or touches, a staged spring changes stage.
function regimeOf({ regime, severity, rattles, separates, impacts_per_cycle: rate }) {
  if (regime === "quiet") return { regime, words: [] };
  const state = rattles ? regime : severity;
  return { regime: state, words: [separates ? state : "changes stage", ...(rate ? [`${numeral(rate, 3)} per cycle`] : [])] };
}

function put(row, path, value) {
  const [last, ...before] = [...path].reverse();
  valueAt(row, before.reverse())[last] = value;
}

// A template without units, for a model that has none.
function plain(value) {
  if (Array.isArray(value)) return value.map(plain);
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, plain(entry)]));
  return typeof value === "string" && /^[+-]?[\d.]/.test(value) ? parseFloat(value) : value;
}

// Bodies stay where they stand when something is added: a drawing keeps the positions of the one before, and a new body
// stands as far from a neighbour as it would in the fresh arrangement.
function kept(before, drawing, moved) {
  const old = Object.fromEntries((before?.bodies ?? []).map(({ name, x, y }) => [name, moved[name] ?? [x, y]]));
  const isSame = drawing.bodies.every(({ name, x, y }) => !old[name] || (!moved[name] && old[name][0] === x && old[name][1] === y));
  if (isSame) return moved;
  const at = { ...moved };
  for (const { name } of drawing.bodies) if (old[name]) at[name] = old[name];
  drawing.bodies.forEach((body, k) => {
    if (at[body.name]) return;
    const link = drawing.links.find(({ ends }) => ends.some((end) => end.body === k) && ends.every((end) => end.body === k || at[drawing.bodies[end.body]?.name]));
    const home = link && drawing.bodies[link.ends.find((end) => end.body !== k).body];
    const from = home ? at[home.name] : [0, 0], to = home ? [from[0] + body.x - home.x, from[1] + body.y - home.y] : [body.x, body.y];
    while (Object.values(at).some(([x, y]) => Math.abs(x - to[0]) < 60 && Math.abs(y - to[1]) < 60)) to[1] += 76;
    at[body.name] = to;
  });
  return at;
}

function useLatest(value) {
  const latest = useRef(value);
  latest.current = value;
  return latest;
}

// ---- the text and its history: everything that changes goes through here, one change after another

function useDocument({ api, initial, onError }) {
  const [state, setState] = useState({ text: initial.text, name: initial.name, origin: initial.origin ?? "", parent: initial.parent ?? null, answer: EMPTY, past: [], future: [], saved: initial.saved ?? null });
  const now = useLatest(state);
  const queue = useRef(Promise.resolve()), timer = useRef(0), typing = useRef(false);
  const change = (part) => { now.current = { ...now.current, ...part }; setState(now.current); };
  const failed = (error) => onError(error);
  const check = async () => {
    const { text } = now.current;
    const answer = await api.post("/api/check", { text, file: fileOf(now.current) });
    if (now.current.text === text) change({ answer: { ...answer, text, drawing: answer.drawing ?? now.current.answer.drawing, isParsed: answer.tables !== null } });
  };
  const step = (text) => ({ text, past: [...now.current.past, now.current.text].slice(-MOST_KEPT), future: [] });
  const inTurn = (act) => { queue.current = queue.current.then(act).catch(failed); return queue.current; };
  return {
    ...state,
    ready: () => queue.current,
    check: () => inTurn(check),
    // Edits of tables; `made` hears of the answer.
    edit: (edits, made) => inTurn(async () => {
      clearTimeout(timer.current);
      const { text } = now.current;
      const { text: changed, ...answer } = await api.post("/api/edit", { text, edits, file: fileOf(now.current) });
      if (now.current.text !== text) return;
      typing.current = false;
      change({ ...(changed === text ? {} : step(changed)), answer: { ...answer, text: changed, isParsed: true } });
      made?.(answer);
    }),
    type: (text) => {
      change(typing.current ? { text, future: [] } : step(text));
      typing.current = true;
      clearTimeout(timer.current);
      timer.current = setTimeout(() => inTurn(check), PAUSE);
    },
    undo: () => inTurn(async () => { const { past, text, future } = now.current; if (past.length) { typing.current = false; change({ text: past[past.length - 1], past: past.slice(0, -1), future: [text, ...future] }); await check(); } }),
    redo: () => inTurn(async () => { const { past, text, future } = now.current; if (future.length) { typing.current = false; change({ text: future[0], past: [...past, text], future: future.slice(1) }); await check(); } }),
    open: ({ text, name, saved = null, origin = "", parent = null }) => inTurn(async () => { typing.current = false; change({ ...step(text), name, origin, saved, parent, answer: EMPTY }); await check(); }),
    savedAs: (name, text) => { const isElsewhere = folderOf(name) !== folderOf(fileOf(now.current)); change({ name, saved: text }); if (isElsewhere) inTurn(check); },
    file: fileOf(state),
    now,
  };
}

// The verdict that follows every change: one request at a time, and after it the newest text alone.
function useVerdict(api, text, file, isSound, model) {
  const [verdict, setVerdict] = useState(null);
  const state = useRef({ isBusy: false, wanted: null, sequence: 0 });
  useEffect(() => {
    const now = state.current;
    if (!isSound) { now.wanted = null; setVerdict(null); model.set("regimes", {}); return undefined; }
    setVerdict((old) => old && { ...old, isStale: old.text !== text });
    const ask = async () => {
      now.wanted = { text, file };
      if (now.isBusy) return;
      now.isBusy = true;
      while (now.wanted) {
        const asked = now.wanted;
        now.wanted = null;
        try {
          const made = (await api.post("/api/live", { ...asked, values: {}, sequence: ++now.sequence })).verdict;
          if (now.wanted) continue;
          setVerdict({ ...made, text: asked.text });
          model.set("regimes", Object.fromEntries(made.parts.map((part) => [part.name, regimeOf(part)])));
        } catch (error) { if (!now.wanted) { setVerdict({ sentence: error.message, isFailed: true, text: asked.text }); model.set("regimes", {}); } }
      }
      now.isBusy = false;
    };
    const time = setTimeout(ask, VERDICT_PAUSE);
    return () => clearTimeout(time);
  }, [text, file, isSound]);
  return verdict;
}

// ---- parts of the page

function Symbol({ path, width }) {
  return html`<svg viewBox=${`${-Math.max(26, width / 2 + 3)} -22 ${2 * Math.max(26, width / 2 + 3)} 44`} aria-hidden="true"><path d=${`M${-width / 2} 0 ${path}`} /></svg>`;
}

function Dialog({ label, onClose, children }) {
  const own = useRef(null);
  useEffect(() => { own.current.showModal(); }, []);
  return html`<dialog class="ed-dialog" aria-label=${label} ref=${own} onCancel=${(event) => { event.preventDefault(); onClose(); }} onClick=${(event) => event.target === own.current && onClose()}>${children}</dialog>`;
}

function Open({ api, onOpen, onClose, onError }) {
  const [lists, setLists] = useState(null);
  useEffect(() => {
    const read = (path) => api.get(path).catch(() => []);
    Promise.all([read("/api/examples"), read("/api/files"), read("/api/jobs")]).then(([examples, files, jobs]) => setLists({ examples, files: files.filter((file) => file.kind === "model"), jobs: labelled(jobs) }));
  }, []);
  const open = (path, opened) => api.get(path).then(async (answer) => { onOpen(await opened(answer.text ?? answer)); onClose(); }).catch(onError);
  const entry = (act, title, small) => html`<li><button type="button" onClick=${act}>${title}${small ? html`<small>${small}</small>` : null}</button></li>`;
  const list = (title, entries, none) => html`<section aria-label=${title}><h3>${title}</h3>${entries.length ? html`<ul>${entries}</ul>` : html`<p class="muted small">${none}</p>`}</section>`;
  return html`<${Dialog} label="Open a model" onClose=${onClose}><h2>Open a model</h2>${lists ? html`<div class="ed-lists">
    ${list("Files of this folder", lists.files.map((file) => entry(() => open(addressOf(file.path), (text) => ({ text, name: file.path, saved: text })), file.path)), "No model files yet: Save puts one here.")}
    ${list("Runs", lists.jobs.map((job) => entry(() => open(`/api/jobs/${encodeURIComponent(job.id)}/model.toml`, (text) => withFile(api, text, job)), job.label, job.sentence)), "No runs yet.")}
    ${list("Examples", lists.examples.map((example) => entry(() => open(`/api/examples/${encodeURIComponent(example.name)}`, (text) => ({ text, name: "" })), example.title || example.name, example.title ? example.name : "")), "None.")}
    </div>` : html`<p class="loading">Reading …</p>`}<div class="ed-foot"><button type="button" onClick=${onClose}>Close</button></div><//>`;
}

function Save({ name, folder, title, onSave, onClose }) {
  const [path, setPath] = useState(name || `${folder}${(title || "model").toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^_|_$/g, "").slice(0, 40) || "model"}.toml`);
  const save = (event) => { event.preventDefault(); onSave(path.endsWith(".toml") ? path : `${path}.toml`); };
  return html`<${Dialog} label="Save the model" onClose=${onClose}><h2>Save the model</h2><form onSubmit=${save}><label>File in this folder<input value=${path} autofocus onInput=${(event) => setPath(event.target.value)} /></label>
    <button type="submit" class="primary">Save</button><button type="button" onClick=${onClose}>Cancel</button></form><//>`;
}

function Conflict({ name, rule, onReplace, onOther, onClose }) {
  return html`<${Dialog} label="The file is another" onClose=${onClose}><h2>Not saved: ${name} ${rule}</h2>
    <p>Saving under this name would lose what stands in the file now.</p>
    <div class="ed-foot"><button type="button" class="primary" autofocus onClick=${onOther}>Save under another name …</button><button type="button" class="danger" onClick=${onReplace}>Overwrite</button><button type="button" onClick=${onClose}>Cancel</button></div><//>`;
}

function Connect({ shelf, from, to, onChoose, onClose }) {
  const fits = shelf.filter(({ ends }) => ends.length > 1 && (to !== "ground" || ends.some((end) => end.ground)));
  return html`<${Dialog} label="Connect" onClose=${onClose}><h2>Connect ${from} ${to ? `and ${to}` : "and a new inertia"} by a</h2>
    <div class="ed-choose">${fits.map((entry, k) => html`<button type="button" autofocus=${k === 0} onClick=${() => onChoose(entry.table)}><${Symbol} path=${entry.symbol} width=${entry.width} />${entry.title}</button>`)}</div>
    <div class="ed-foot"><button type="button" onClick=${onClose}>Cancel</button></div><//>`;
}

// Torque or force over deflection, as the file says.
function Law({ link, isPlain }) {
  const factor = isPlain ? 1 : link.along_line ? 1e3 : 180 / Math.PI;
  const points = link.law.map(([x, y]) => [factor * x, y]), xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
  const w = 310, h = 132, left = 8, top = 14;
  const [x0, x1] = [Math.min(...xs), Math.max(...xs)], [y0, y1] = [Math.min(0, ...ys), Math.max(0, ...ys)];
  if (!(y1 > y0) || !(x1 > x0)) return null;
  const px = (x) => left + (w - 2 * left) * (x - x0) / (x1 - x0), py = (y) => h - top - (h - 2 * top) * (y - y0) / (y1 - y0);
  const short = (value) => numeral(value, 3);
  const [force, deflection] = isPlain ? ["", ""] : link.along_line ? ["N", "mm"] : ["N m", "°"];
  const said = `${link.along_line ? "Force" : "Torque"} over deflection, ${short(y0)} to ${short(y1)} ${force}, ${short(x0)} to ${short(x1)} ${deflection}`;
  return html`<svg class="ed-law" viewBox=${`0 0 ${w} ${h}`} role="img" aria-label=${said}><path class="axis" d=${`M${left} ${py(0)} H${w - left} M${px(0)} ${top} V${h - top}`} />
    <path d=${points.map(([x, y], k) => `${k ? "L" : "M"}${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join(" ")} />
    <text x=${px(0) + 5} y="11">${numerals.engineering(y1, force)}</text><text x=${w - left} y=${Math.min(h - 3, py(0) + 13)} text-anchor="end">${short(x1)} ${deflection}</text></svg>`;
}

function Selected({ path, doc, schema, shelf, changes, onDelete, onCopy, onRename }) {
  const { answer } = doc, [kind] = path, value = valueAt(answer.tables, path);
  const entry = shelf.find(({ table }) => table === kind);
  const bodies = rowsOf(answer.tables, "inertia").map((row) => row?.name).filter((name) => typeof name === "string");
  const link = answer.drawing?.links.find((candidate) => keyOf(candidate.path) === keyOf(path) && candidate.law);
  const onTyped = (where, text, isNumber) => (where.length === path.length + 1 && where[path.length] === "name" && typeof value?.name === "string" ? onRename(kind, value.name, text) : changes.onTyped(where, text, isNumber));
  const laws = link && link.law.length > 3 ? html`<${Law} link=${link} isPlain=${answer.tables.units === "dimensionless"} />` : null;
  return html`<h2>${entry?.title ?? kind} <small>${value?.name ?? (value?.on ? `on ${value.on}` : "")}</small></h2>
    ${SINGLE.includes(kind) ? null : html`<p class="ed-about">${entry?.words}</p><div class="tools"><button type="button" class="danger" onClick=${() => onDelete(path)}>Delete</button><button type="button" onClick=${() => onCopy(path)}>Duplicate</button></div>`}
    ${laws}<${Form} key=${keyOf(path)} schema=${schema} path=${path} value=${value} problems=${answer.problems} bodies=${bodies} ends=${entry?.ends ?? []} changes=${{ ...changes, onTyped }} />`;
}

// What concerns the whole model: name, units, speed and settings.
function Whole({ doc, schema, shelf, changes, onSelect }) {
  const { answer } = doc, tables = answer.tables ?? {};
  const root = { ...schema, properties: { model: { type: "object", properties: Object.fromEntries(["name", "units"].filter((key) => schema.properties[key]).map((key) => [key, schema.properties[key]])), required: ["name", "units"] } } };
  const own = { ...changes, onTyped: (path, text) => changes.onValue(path.slice(1), text), onValue: (path, value) => changes.onValue(path.slice(1), value) };
  return html`<h2>The model</h2><p class="ed-about">Select something in the drawing to change it.</p>
    <${Form} schema=${root} path=${["model"]} value=${{ name: tables.name, units: tables.units }} problems=${answer.problems.map((problem) => ({ ...problem, path: ["model", ...problem.path] })).filter(({ path }) => path.length === 2 && ["name", "units"].includes(path[1]))} bodies=${[]} ends=${[]} changes=${own} />
    ${SINGLE.map((kind) => { const entry = shelf.find(({ table }) => table === kind); return html`<section><h2>${entry.title} <small><button type="button" class="small-button" onClick=${() => onSelect(kind)}>show in the text</button></small></h2>
      <${Form} schema=${schema} path=${[kind]} value=${tables[kind]} problems=${answer.problems} bodies=${[]} ends=${[]} changes=${changes} /></section>`; })}`;
}

// ---- the view

function Editor({ api, schema, shelf, initial, onRun, onError, handle }) {
  const [message, setMessage] = useState(initial.message ?? "");
  const doc = useDocument({ api, initial, onError: (error) => setMessage(error.problems?.length ? error.problems.map(({ rule, remedy, place }) => `${place ? `${place}: ` : ""}${rule}${remedy ? ` (${remedy})` : ""}`).join("; ") : error.message) });
  const [selected, setSelected] = useState("");
  const [dialog, setDialog] = useState(null);
  const [isTextShown, setTextShown] = useState(localStorage.getItem(TEXT_SHOWN) !== "no");
  const [isListed, setListed] = useState(false);
  const [isBusy, setBusy] = useState(false);
  const root = useRef(null), wanted = useRef(null), drafted = useRef(0);
  const { answer, text } = doc, tables = answer.tables;
  const path = pathOf(selected), exists = path && valueAt(tables, path) !== undefined;
  const isSound = answer.isParsed && !answer.problems.length;
  const acts = useRef({});
  const model = useMemo(() => standIn({ drawing: null, selected: "", positions: initial.positions ?? {}, regimes: {}, problems: {}, editable: true }, {
    connect: (question) => acts.current.ask(question), insert: (question) => acts.current.ask(question), delete: (question) => acts.current.ask(question), rename: (question) => acts.current.ask(question),
    focus: async (question) => ({ content: question }),
  }), []);

  const verdict = useVerdict(api, text, doc.file, Boolean(isSound) && answer.text === text, model);

  const select = (key) => { setSelected(key); if (model.get("selected") !== key) model.set("selected", key); };
  const field = (where) => { wanted.current = `field-${where.join("-")}`; };
  const changes = {
    onTyped: (where, typed, isNumber) => { setMessage(""); doc.edit([{ op: "set", path: where, ...(isNumber ? { typed } : { value: typed || null }) }]); },
    onValue: (where, value) => { setMessage(""); doc.edit([{ op: "set", path: where, value }]); },
    onList: (where, entries) => { setMessage(""); doc.edit([{ op: "set", path: where, value: entries.map((entry) => (entry !== "" && !Number.isNaN(Number(entry)) ? Number(entry) : entry)) }]); },
    onAdd: (where, value) => { setMessage(""); doc.edit([{ op: "add", table: where, value }]); },
    onBegin: (where, option = 0) => { setMessage(""); doc.edit([{ op: "begin", path: where, option }]); },
    onDelete: (where) => { setMessage(""); doc.edit([{ op: "delete", path: where }]); },
  };

  const namesOf = () => new Set(Object.keys(tables ?? {}).flatMap((kind) => rowsOf(tables, kind).map((row) => row?.name)));
  const fresh = (base, taken) => { let name = base, count = 1; while (taken.has(name)) name = `${base}_${++count}`; taken.add(name); return name; };
  const bodyNames = () => rowsOf(tables, "inertia").map((row) => row?.name);

  // Adds a table with its template; ends without a body get new inertias.
  const insert = (table, between = [], at = null) => {
    if (!shelf.length) return; // it is on its way
    const entry = shelf.find((candidate) => candidate.table === table), taken = namesOf(), edits = [];
    const clean = (template) => (tables?.units === "dimensionless" ? plain(template) : copy(template));
    const body = (base) => { const name = fresh(base, taken); edits.push({ op: "add", table: ["inertia"], value: { ...clean(shelf[0].template), name } }); return name; };
    if (SINGLE.includes(table)) { select(table); return; }
    const row = clean(entry.template);
    if (row.name) row.name = fresh(table, taken);
    const chosen = between.length ? between : path?.[0] === "inertia" ? [bodyNames()[path[1]]] : entry.ends.length && bodyNames().length ? [bodyNames()[entry.ends.length > 1 ? bodyNames().length - 1 : 0]] : [];
    entry.ends.forEach((end, k) => put(row, end.path, chosen[k] ?? body(["on", "from", "to"].includes(end.title) ? "inertia" : end.title.replace(/s$/, ""))));
    const made = edits.length ? edits[edits.length - 1].value.name : null;
    if (at && made) model.set("positions", { ...model.get("positions"), [made]: at });
    edits.push({ op: "add", table: [table], value: row });
    const key = `${table}.${rowsOf(tables, table).length}`;
    setMessage("");
    doc.edit(edits, () => { select(key); field([table, rowsOf(tables, table).length, row.name ? "name" : "on"]); });
  };

  const remove = (where) => { setMessage(""); doc.edit([{ op: "delete", path: where }], (made) => { select(""); if (made.gone.length) setMessage(`${made.gone[0]}. Undo brings them back.`); }); };
  const duplicate = (where) => {
    const row = copy(valueAt(tables, where));
    if (row.name) row.name = fresh(row.name.replace(/_\d+$/, ""), namesOf());
    const count = rowsOf(tables, where[0]).length;
    doc.edit([{ op: "add", table: [where[0]], value: row }], () => { select(`${where[0]}.${count}`); field([where[0], count, "name"]); });
  };
  const rename = (table, name, to) => {
    const moved = model.get("positions");
    if (table === "inertia" && moved[name]) model.set("positions", { ...moved, [to]: moved[name] });
    setMessage("");
    doc.edit([{ op: "rename", table, name, to }]);
  };

  acts.current.ask = async (question) => {
    const names = bodyNames();
    if (question.ask === "connect") setDialog({ kind: "connect", from: names[question.from], to: question.to === null ? null : question.to < 0 ? "ground" : names[question.to], at: question.at });
    if (question.ask === "delete") remove(pathOf(question.path));
    if (question.ask === "rename") { const where = pathOf(question.path); select(question.path); field([...where, valueAt(tables, where)?.on === undefined ? "name" : "on"]); setSelected((key) => key); focusWanted(); }
    return { content: {} };
  };

  const focusWanted = () => {
    if (!wanted.current) return;
    const input = document.getElementById(wanted.current);
    if (!input) return;
    wanted.current = null;
    input.closest("details")?.setAttribute("open", "");
    input.focus();
    input.select?.();
  };

  const connected = (table) => {
    const { from, to, at } = dialog, ends = shelf.find((entry) => entry.table === table).ends;
    setDialog(null);
    const between = to === null ? [from] : [from, to];
    if (to === "ground") { const place = ends.findLastIndex((end) => end.ground); const row = []; row[place] = "ground"; row[place === 0 ? 1 : 0] = from; insert(table, row, at); } else insert(table, between, at);
  };

  // Enter and Escape in a field of the form: back to what is selected in the drawing, unless the field is wrong.
  const left = async (event) => {
    const { target: input, key } = event;
    if (input.localName !== "input" && (input.localName !== "select" || key === "Enter") || !["Enter", "Escape"].includes(key) || event.ctrlKey || event.metaKey) return;
    await doc.ready();
    const isWrong = doc.now.current.answer.problems.some((problem) => `field-${problem.path.join("-")}` === input.id);
    if (document.activeElement === input && (key === "Escape" || !isWrong)) model.send({ ask: "focus", focus: model.get("selected") || "inertia.0" });
  };

  const arrange = () => { model.set("drawing", null); model.set("positions", {}); model.set("drawing", answer.drawing); };
  const open = (opened) => { model.set("drawing", null); model.set("positions", {}); select(""); setMessage(opened.message ?? ""); doc.open(opened); };
  const save = async (name, write = api.put) => {
    const written = doc.now.current.text;
    try {
      await write(addressOf(name), written);
      doc.savedAs(name, written);
      setDialog(null);
      setMessage(`Saved ${name}.`);
    } catch (error) {
      const isConflict = error.status === 412;
      setDialog(isConflict ? { kind: "conflict", name, rule: error.problems[0].rule } : null);
      if (!isConflict) setMessage(error.message);
    }
  };
  const run = async () => {
    setBusy(true);
    try { await doc.ready(); if (!doc.now.current.answer.problems.length && doc.now.current.answer.isParsed) await onRun(doc.now.current.text, { file: fileOf(doc.now.current), parent: doc.now.current.parent }); else setListed(true); } finally { setBusy(false); }
  };

  const pressed = (event) => {
    if (!(event.ctrlKey || event.metaKey) || dialog) return;
    const letter = event.key.toLowerCase();
    const act = { z: () => (event.shiftKey ? doc.redo() : doc.undo()), y: doc.redo, s: () => (doc.name ? save(doc.name) : setDialog({ kind: "save" })), o: () => setDialog({ kind: "open" }), enter: run }[letter];
    if (!act) return;
    const input = event.target;
    if (["z", "y"].includes(letter) && input.dataset.typed !== undefined) return; // the field's own
    event.preventDefault();
    act();
  };

  const keys = useLatest(pressed); // wherever the focus is: a click on nothing must not leave Ctrl+S to the browser
  useEffect(() => {
    const heard = (event) => keys.current(event);
    addEventListener("keydown", heard);
    return () => removeEventListener("keydown", heard);
  }, []);
  useEffect(() => { doc.check(); }, []);
  // What is under way survives a reload: the text, its file, and where bodies were dragged to.
  const draft = () => {
    clearTimeout(drafted.current);
    drafted.current = setTimeout(() => {
      const { text: written, name, origin, saved, parent } = doc.now.current;
      localStorage.setItem(DRAFT, JSON.stringify({ text: written, name, origin, saved, parent, positions: model.get("positions") }));
    }, DRAFT_PAUSE);
  };
  useEffect(draft, [text, doc.name, doc.origin, doc.saved]);
  useEffect(() => { model.on("change:positions", draft); return () => { model.off("change:positions", draft); clearTimeout(drafted.current); }; }, []);
  useEffect(() => {
    const counts = {};
    for (const { path: where } of answer.problems) if (where.length >= 2) { const key = keyOf(where.slice(0, 2)); counts[key] = (counts[key] ?? 0) + 1; }
    model.set("problems", counts);
    const drawing = answer.drawing ?? { bodies: [], links: [], axles: [], loads: [] };
    model.set("positions", kept(model.get("drawing"), drawing, model.get("positions")));
    model.set("drawing", drawing);
  }, [answer]);
  useEffect(() => { const heard = () => setSelected(model.get("selected")); model.on("change:selected", heard); return () => model.off("change:selected", heard); }, []);
  useEffect(focusWanted);
  useEffect(() => { handle({ text: () => doc.now.current.text, open }); });

  const header = path && answer.headers.filter((entry) => keyOf(entry.path) === selected)[0];
  const next = header && answer.headers.find((entry) => entry.line > header.line && keyOf(entry.path.slice(0, path.length)) !== selected);
  const range = header ? [header.line, next ? next.line - 1 : text.split("\n").length] : null;
  const onLine = (line) => {
    const at = answer.headers.filter((entry) => entry.line <= line).pop();
    select(at ? keyOf(at.path.slice(0, typeof at.path[1] === "number" ? 2 : 1)) : "");
  };
  const toProblem = (problem) => {
    const where = problem.path, isRow = typeof where[1] === "number";
    select(isRow ? keyOf(where.slice(0, 2)) : SINGLE.includes(where[0]) ? "" : "");
    if (where.length) { field(where); setTimeout(focusWanted, 60); }
    if (!where.length && problem.line) { const area = root.current.querySelector(".toml-area"); if (area) { const start = text.split("\n").slice(0, problem.line - 1).join("\n").length + (problem.line > 1 ? 1 : 0); area.focus(); area.setSelectionRange(start, start); } }
  };
  const isEmpty = answer.isParsed ? !rowsOf(tables, "inertia").length : text === NEW;
  const count = answer.problems.length, { notes } = answer;
  const isChanged = doc.saved !== text;
  const title = answer.title || "Untitled";
  return html`<section class="editor" aria-label="Editor" ref=${root}>
    <div class="ed-bar" role="toolbar" aria-label="Model">
      <button type="button" onClick=${() => open({ text: NEW, name: "" })}>New</button><button type="button" title="Ctrl+O" onClick=${() => setDialog({ kind: "open" })}>Open …</button>
      <button type="button" title="Ctrl+S" onClick=${() => (doc.name ? save(doc.name) : setDialog({ kind: "save" }))}>Save</button><button type="button" onClick=${() => setDialog({ kind: "save" })}>Save as …</button>
      <span class="ed-gap"></span><button type="button" title="Ctrl+Z" disabled=${!doc.past.length} onClick=${doc.undo}>Undo</button><button type="button" title="Ctrl+Shift+Z" disabled=${!doc.future.length} onClick=${doc.redo}>Redo</button>
      <h1 class="ed-name" title=${doc.name ? `${title} (${doc.name})` : title}>${title}</h1><span class="ed-file">${doc.name}${isChanged ? html`<span title="not saved"> •</span>` : null}</span>
      <div class="ed-end">
        <span role="status">${!answer.isParsed && !count ? html`<span class="ed-state muted">checking …</span>` : count ? html`<button type="button" class="ed-state wrong" aria-expanded=${isListed} onClick=${() => setListed(!isListed)}>${count} ${count === 1 ? "problem" : "problems"}</button>` : html`<span class="ed-state ready">✓ ready ${notes.length ? `with ${notes.length} ${notes.length === 1 ? "note" : "notes"}` : "to run"}</span>`}</span>
        <button type="button" aria-pressed=${isTextShown} onClick=${() => { setTextShown(!isTextShown); localStorage.setItem(TEXT_SHOWN, isTextShown ? "no" : "yes"); }}>Text</button>
        <button type="button" class="primary" title="Ctrl+Enter" disabled=${!isSound || isBusy} onClick=${run}>Run</button>
      </div>
    </div>
    <div class=${`ed-panes${isTextShown ? "" : " no-text"}`}>
      <div class="ed-drawing">
        <div class="ed-palette" role="toolbar" aria-label="Add"><span class="ed-word">Add</span>${shelf.filter(({ table }) => !SINGLE.includes(table)).map((entry) => html`<button type="button" title=${entry.words} disabled=${!answer.isParsed} onClick=${() => insert(entry.table)}><${Symbol} path=${entry.symbol} width=${entry.width} />${entry.title}</button>`)}
          <button type="button" class="ed-arrange" title="Lay the driveline out anew" disabled=${!answer.drawing} onClick=${arrange}>Arrange</button></div>
        <div class="ed-sheet"><${Widget} name="driveline" model=${model} label="Drawing" />
          ${isEmpty ? html`<div class="ed-start"><h2>An empty sheet</h2><p>Add an inertia, then pull the small circle beside it to the next one. Or begin with something that works.</p><div class="choices"><button type="button" class="primary" disabled=${!shelf.length} onClick=${() => insert("inertia")}>Add an inertia</button><button type="button" onClick=${() => setDialog({ kind: "open" })}>Open an example …</button></div></div>` : null}</div>
        ${verdict ? html`<div class=${`ed-verdict ${verdict.isFailed ? "failed" : verdict.state}${verdict.isStale ? " stale" : ""}`} role="status">${verdict.isFailed ? verdict.sentence
          : html`<details><summary><b>${verdict.headline}</b> <small>a look over 60 cycles at most; Run gives the whole</small></summary>${verdict.sentence}</details>`}</div>` : null}
        ${message ? html`<p class="ed-note" role="status"><span>${message}</span><button type="button" class="small-button" aria-label="Close the message" onClick=${() => setMessage("")}>×</button></p>` : null}
        ${count && (isListed || !answer.isParsed) ? html`<ul class="ed-problems" aria-label="Problems">${answer.problems.map((problem) => html`<li><button type="button" onClick=${() => toProblem(problem)}><b>${problem.place.replace(/^[^:]*:(\d+):? ?/, "line $1 ").replace(/^model\.toml: /, "")}</b> ${problem.value ? `found ${problem.value}; ` : ""}${problem.rule}${problem.remedy ? ` (${problem.remedy})` : ""}</button></li>`)}</ul>` : null}
        ${notes.length && !count ? html`<ul class="ed-notes" aria-label="Notes">${notes.map((note) => html`<li>${note}</li>`)}</ul>` : null}
        <p class="ed-keys"><kbd>arrows</kbd> walk · <kbd>Enter</kbd> select · <kbd>C</kbd> connect · <kbd>N</kbd> next inertia · <kbd>F2</kbd> rename · <kbd>Del</kbd> delete · <kbd>Alt</kbd>+<kbd>arrows</kbd> move</p>
      </div>
      <div class="ed-form" role="region" aria-label="Properties" tabindex="0" onKeyDown=${left}>${!schema ? null : exists && typeof path[1] === "number" ? html`<${Selected} path=${path} doc=${doc} schema=${schema} shelf=${shelf} changes=${changes} onDelete=${remove} onCopy=${duplicate} onRename=${rename} />`
        : html`<${Whole} doc=${doc} schema=${schema} shelf=${shelf} changes=${changes} onSelect=${select} />`}</div>
      ${isTextShown ? html`<div class="ed-text"><${TomlText} text=${text} problems=${answer.problems} range=${range} onText=${doc.type} onLine=${onLine} /></div>` : null}
    </div>
    ${dialog?.kind === "open" ? html`<${Open} api=${api} onOpen=${open} onClose=${() => setDialog(null)} onError=${onError} />` : null}
    ${dialog?.kind === "save" ? html`<${Save} name=${doc.name} folder=${folderOf(doc.file)} title=${answer.title} onSave=${save} onClose=${() => setDialog(null)} />` : null}
    ${dialog?.kind === "conflict" ? html`<${Conflict} ...${dialog} onReplace=${() => save(dialog.name, api.replace)} onOther=${() => setDialog({ kind: "save" })} onClose=${() => setDialog(null)} />` : null}
    ${dialog?.kind === "connect" ? html`<${Connect} shelf=${shelf} from=${dialog.from} to=${dialog.to} onChoose=${connected} onClose=${() => setDialog(null)} />` : null}
  </section>`;
}

// Mounts the editor; returns {text(), open({text, name}), destroy()}. It is there at once; forms and the palette come with
// the schema and the shelf. `opened`: {text, name, saved, origin, parent, message}; without it, what was under way.
export function mountEditor(el, { api, onRun, onError = () => {}, opened }) {
  let draft = null, isGone = false;
  try { draft = JSON.parse(localStorage.getItem(DRAFT)); } catch { /* no draft */ }
  const initial = opened ?? (draft?.text ? draft : { text: NEW, name: "" });
  const editor = { destroy: () => { isGone = true; render(null, el); } };
  const show = (schema, shelf) => isGone || render(html`<${Editor} ...${{ api, schema, shelf, initial, onRun, onError, handle: (parts) => Object.assign(editor, parts) }} />`, el);
  show(null, []);
  Promise.all([api.get("/api/schema"), api.get("/api/components")]).then((parts) => show(...parts)).catch(onError);
  return editor;
}

export default mountEditor;
