// A form of one table of the model file, made of the JSON Schema that reads it: no key is named here.

import { html, useEffect, useRef, useState } from "/static/vendor/htm-preact.js";

const STEPPED = /^\s*([+-]?\d*\.?\d+)((?:[eE][+-]?\d+)?)(.*)$/;
const SIMPLE = ["string", "number", "integer", "boolean"];

// ---- the schema

export function resolved(root, node) {
  if (!node?.$ref) return node ?? {};
  const { $ref, ...own } = node;
  return { ...root.$defs[$ref.split("/").pop()], ...own };
}

const optionsOf = (root, node) => (resolved(root, node).anyOf ?? [node]).map((option) => resolved(root, option));
const isTable = (node) => node.type === "object" && node.properties;
export const words = (key) => key.replace(/_/g, " ");

function unitOf(description = "") {
  return description.match(/\[([^\]]+)\]/)?.[1] ?? "";
}

// Words that may stand in place of a number.
const wordsOf = (root, node) => optionsOf(root, node).map((option) => option.const).filter((word) => typeof word === "string");

function exampleOf(root, node) {
  for (const option of optionsOf(root, node)) if (option.examples?.length) return option.examples[0];
  return "";
}

// ---- fields

// Raise the last digit of a number with its unit; what is no number stays.
export function stepped(text, steps) {
  const match = text.match(STEPPED);
  if (!match) return text;
  const digits = (match[1].split(".")[1] ?? "").length;
  return `${(Number(match[1]) + steps * 10 ** -digits).toFixed(digits)}${match[2]}${match[3]}`;
}

export function shown(value) {
  if (typeof value !== "number") return value === undefined || value === null ? "" : String(value);
  const plain = String(value);
  return Math.abs(value) >= 1e6 || (value && Math.abs(value) < 1e-4) ? value.toExponential().replace("e+", "e") : plain;
}

const startsWith = (path, start) => start.every((part, k) => part === path[k]);
const under = (problems, path) => problems.filter((problem) => startsWith(problem.path, path));
const at = (problems, path) => under(problems, path).filter((problem) => problem.path.length === path.length);

function Problems({ list, id }) {
  return list.length ? html`<div class="field-problems" id=${id} role="alert">${list.map(({ at, value, rule, remedy }) => html`<p>${at ? html`<b>${at}</b>` : null}${value ? `found ${value}; ` : ""}${rule}${remedy ? ` (${remedy})` : ""}</p>`)}</div>` : null;
}

function TextField({ path, value, label, unit, example, choices = [], description, problems, isNumber, isRequired, onTyped, hidesLabel, describedBy }) {
  const [typed, setTyped] = useState(shown(value));
  const own = useRef(null);
  useEffect(() => { own.sent = undefined; setTyped(shown(value)); }, [shown(value)]);
  const id = `field-${path.join("-")}`;
  const commit = (text) => { // once: Enter and leaving the field both say so
    if (text === shown(value) || text === own.sent) return;
    own.sent = text;
    onTyped(path, text, isNumber);
  };
  const pressed = (event) => {
    const steps = { ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (event.key === "Enter") commit(event.target.value);
    else if (event.key === "Escape") { event.target.value = shown(value); setTyped(shown(value)); }
    else if (steps && isNumber && STEPPED.test(typed)) {
      event.preventDefault();
      const next = stepped(typed, steps);
      setTyped(next);
      clearTimeout(own.timer);
      own.timer = setTimeout(() => commit(next), 250);
    }
  };
  return html`<div class=${`field${problems.length ? " wrong" : ""}`}>
    <label for=${id} class=${hidesLabel ? "hidden" : ""} title=${description}>${label}${isRequired ? html`<span class="must" aria-hidden="true"> *</span>` : null}</label>
    <span class="entry"><input id=${id} type="text" list=${choices.length ? `${id}-choices` : null} autocomplete="off" spellcheck="false" value=${typed} placeholder=${example ? `e.g. ${[example, ...choices].join(" or ")}` : ""} aria-required=${isRequired ? "true" : null} aria-invalid=${problems.length ? "true" : null} data-typed=${typed === shown(value) ? null : ""}
      aria-describedby=${problems.length ? `${describedBy ?? id}-problems` : null} onInput=${(event) => { own.sent = undefined; setTyped(event.target.value); }} onChange=${(event) => commit(event.target.value)} onKeyDown=${pressed} />${choices.length ? html`<datalist id=${`${id}-choices`}>${choices.map((word) => html`<option value=${word} />`)}</datalist>` : null}${unit && !hidesLabel && !/[^\d.eE+\s-]/.test(typed) ? html`<span class="unit" aria-hidden="true">${unit}</span>` : null}</span>
    ${description && !hidesLabel ? html`<p class="describe">${description}</p>` : null}
    ${hidesLabel ? null : html`<${Problems} list=${problems} id=${`${id}-problems`} />`}</div>`;
}

function Choice({ path, value, label, options, problems, description, onValue, isRequired }) {
  const id = `field-${path.join("-")}`;
  const every = options.includes(value) || value === undefined ? options : [value, ...options];
  return html`<div class=${`field${problems.length ? " wrong" : ""}`}><label for=${id} title=${description}>${label}${isRequired ? html`<span class="must" aria-hidden="true"> *</span>` : null}</label>
    <span class="entry"><select id=${id} value=${value ?? ""} aria-invalid=${problems.length ? "true" : null} onChange=${(event) => onValue(path, event.target.value || null)}>
      ${value === undefined ? html`<option value="">–</option>` : null}${every.map((option) => html`<option value=${option} selected=${option === value}>${option}</option>`)}</select></span>
    ${description ? html`<p class="describe">${description}</p>` : null}
    <${Problems} list=${problems} id=${`${id}-problems`} /></div>`;
}

// Any value of the schema. `around` holds root, problems, bodies, ends and the functions that change the text.
function Field({ node, path, value, name, label, isRequired, around, hidesLabel }) {
  const { root } = around, options = optionsOf(root, node), full = resolved(root, node);
  const isHere = (problem) => startsWith(problem.path, path), description = full.description?.replace(/``/g, "").replace(/\s+/g, " ");
  const end = around.ends.find((entry) => around.depth + entry.path.length === path.length && entry.path.every((part, k) => part === path[around.depth + k] || (entry.many && typeof part === "number" && typeof path[around.depth + k] === "number")));
  const all = around.problems.filter(isHere);
  if (end) {
    const bodies = [...around.bodies, ...(end.ground ? ["ground"] : [])];
    return html`<${Choice} path=${path} value=${value} label=${label} options=${bodies} problems=${all} isRequired=${isRequired} onValue=${around.onValue} />`;
  }
  const choices = options.find((option) => option.enum)?.enum;
  if (choices && typeof value !== "object") return html`<${Choice} path=${path} value=${value} label=${label} options=${choices} problems=${all} description=${description} isRequired=${isRequired} onValue=${around.onValue} />`;
  const array = options.find((option) => option.type === "array");
  if (array?.prefixItems) return html`<${Pair} ...${{ array, path, value, label, isRequired, around, description }} />`;
  if (array && optionsOf(root, array.items ?? {}).some(isTable)) return html`<${Rows} ...${{ item: optionsOf(root, array.items).find(isTable), path, value, label, around, description }} />`;
  if (array && around.ends.some((entry) => entry.many && entry.path[0] === name)) return html`<${Bodies} ...${{ array, path, value, label, around }} />`;
  if (array) return html`<${List} ...${{ path, value, label, problems: all, description, around, items: array.items }} />`;
  const tables = options.filter(isTable), isSimple = options.some((option) => SIMPLE.includes(option.type) || option.const !== undefined);
  if (value && typeof value === "object") return html`<${Group} ...${{ tables, path, value, label, around, description }} />`;
  if (!isSimple && tables.length) return html`<${Begin} ...${{ tables, path, label, around, problems: all, description }} />`;
  const isNumber = options.some((option) => ["number", "integer"].includes(option.type));
  const field = html`<${TextField} path=${path} value=${value} label=${label} unit=${unitOf(full.description)} example=${exampleOf(root, node)} choices=${wordsOf(root, node)} description=${description} problems=${all} isNumber=${isNumber} isRequired=${isRequired} onTyped=${around.onTyped} hidesLabel=${hidesLabel} describedBy=${around.describedBy} />`;
  return tables.length && !hidesLabel ? html`<div class="with-more">${field}<${Begin} ...${{ tables, path, label: "as a table", around, problems: [], small: true }} /></div>` : field;
}

function Pair({ array, path, value, label, around, description }) {
  const entries = Array.isArray(value) ? value : [];
  const own = at(around.problems, path);
  const typed = (where, text, isNumber) => (entries.length === array.prefixItems.length ? around.onTyped(where, text, isNumber)
    : around.onValue(path, array.prefixItems.map((entry, k) => (k === where[path.length] ? text : entries[k] ?? exampleOf(around.root, entry)))));
  const chosen = (where, text) => typed(where, text ?? "", false);
  const names = around.ends.filter((entry) => entry.path[0] === path[around.depth]).map((entry) => entry.title);
  return html`<fieldset class="pair"><legend title=${description}>${label}</legend><div class="pair-entries">${array.prefixItems.map((entry, k) => html`<${Field} node=${entry} path=${[...path, k]} value=${entries[k]} name=${k} label=${names[k] ?? `${label} ${k + 1}`} isRequired=${true} around=${{ ...around, onTyped: typed, onValue: chosen }} />`)}</div>
    ${description ? html`<p class="describe">${description}</p>` : null}<${Problems} list=${own} /></fieldset>`;
}

function List({ path, value, label, problems, description, around, items }) {
  const entries = Array.isArray(value) ? value : [];
  const commit = (_, text) => around.onList(path, text.split(/[,;]\s*/).map((entry) => entry.trim()).filter(Boolean));
  return html`<${TextField} path=${path} value=${entries.map(shown).join(", ")} label=${label} unit=${unitOf(items?.description)} example=${exampleOf(around.root, items ?? {}) || "1, 2"} description=${description} problems=${problems} onTyped=${commit} />`;
}

function Bodies({ path, value, label, around }) {
  const entries = Array.isArray(value) ? value : [];
  const free = around.bodies.filter((body) => !entries.includes(body));
  return html`<fieldset class="bodies"><legend>${label}</legend>${entries.map((_, k) => html`<div class="body-row"><${Field} node=${{ type: "string" }} path=${[...path, k]} value=${entries[k]} label=${`${label} ${k + 1}`} around=${around} />
    <button type="button" class="small-button" aria-label=${`Remove ${entries[k]}`} onClick=${() => around.onDelete([...path, k])}>×</button></div>`)}
    <button type="button" class="small-button" disabled=${!free.length} onClick=${() => around.onAdd(path, free[0])}>Add one</button></fieldset>`;
}

// Rows of equal tables, such as stages and harmonics, as a table.
function Rows({ item, path, value, label, around, description }) {
  const rows = Array.isArray(value) ? value : [];
  const keys = Object.keys(item.properties), { root } = around;
  const own = under(around.problems, path).map((problem) => ({ ...problem, at: problem.path.length > path.length + 1 ? `${words(String(problem.path[path.length + 1]))} of row ${problem.path[path.length] + 1}: ` : "" }));
  const id = `field-${path.join("-")}`;
  return html`<fieldset class="rows"><legend title=${description}>${label}</legend>
    ${rows.length ? html`<div class="scroll"><table class="grid"><thead><tr>${keys.map((key) => html`<th scope="col" title=${resolved(root, item.properties[key]).description}>${words(key)}</th>`)}<th><span class="hidden">Remove</span></th></tr></thead>
      <tbody>${rows.map((row, k) => html`<tr key=${k}>${keys.map((key) => html`<td>${row[key] && typeof row[key] === "object" ? html`<span class="muted" title=${JSON.stringify(row[key])}>table</span>`
        : html`<${Field} node=${item.properties[key]} path=${[...path, k, key]} value=${row[key]} name=${key} label=${`${words(key)} of ${label} ${k + 1}`} around=${{ ...around, describedBy: id }} hidesLabel=${true} />`}</td>`)}
        <td><button type="button" class="small-button" aria-label=${`Remove ${label} ${k + 1}`} onClick=${() => around.onDelete([...path, k])}>×</button></td></tr>`)}</tbody></table></div>` : null}
    <button type="button" class="small-button" onClick=${() => around.onBegin(path)}>Add ${rows.length ? "a row" : label}</button><${Problems} list=${own} id=${`${id}-problems`} /></fieldset>`;
}

function Group({ tables, path, value, label, around, description }) {
  const table = tables.find((option) => Object.keys(value).every((key) => key in option.properties)) ?? tables[0] ?? { properties: {} };
  const own = at(around.problems, path);
  return html`<fieldset class="group"><legend title=${description}>${label} <button type="button" class="small-button" aria-label=${`Remove ${label}`} onClick=${() => around.onDelete(path)}>×</button></legend>
    <${Fields} table=${table} path=${path} value=${value} around=${around} /><${Problems} list=${own} /></fieldset>`;
}

function Begin({ tables, path, label, around, problems, description, small }) {
  const name = (table) => (tables.length > 1 ? ` (${(table.required ?? Object.keys(table.properties)).map(words).join(", ")})` : "");
  return html`<div class=${small ? "begin small" : "begin"}>${tables.map((table, k) => html`<button type="button" class="small-button" title=${description} onClick=${() => around.onBegin(path, k)}>${small ? label : `Add ${label}`}${name(table)}</button>`)}<${Problems} list=${problems} /></div>`;
}

// The keys of a table: those that stand there, must, or are wrong; the others below "More".
function Fields({ table, path, value, around }) {
  const required = table.required ?? [], keys = Object.keys(table.properties);
  const isNear = (key) => key in value || required.includes(key) || around.problems.some((problem) => startsWith(problem.path, [...path, key]));
  const near = keys.filter(isNear), far = keys.filter((key) => !isNear(key));
  const field = (key) => html`<${Field} key=${key} node=${table.properties[key]} path=${[...path, key]} value=${value[key]} name=${key} label=${words(key)} isRequired=${required.includes(key)} around=${around} />`;
  const strange = Object.keys(value).filter((key) => !(key in table.properties));
  return html`${near.map(field)}
    ${strange.map((key) => html`<${TextField} key=${key} path=${[...path, key]} value=${typeof value[key] === "object" ? JSON.stringify(value[key]) : value[key]} label=${key} problems=${under(around.problems, [...path, key])} onTyped=${around.onTyped} />`)}
    ${far.length ? html`<details class="far" open=${!near.length}><summary>${near.length ? "More" : "Values"} (${far.map(words).join(", ")})</summary>${far.map(field)}</details>` : null}`;
}

// schema: the model's; path: where the table stands; changes: {onTyped, onValue, onList, onAdd, onBegin, onDelete}.
export function Form({ schema, path, value, problems, bodies, ends, changes }) {
  const node = resolved(schema, schema.properties[path[0]]);
  const table = resolved(schema, node.type === "array" ? node.items : node);
  const own = at(problems, path);
  const around = { root: schema, problems, bodies, ends, depth: path.length, ...changes };
  return html`<div class="fields"><${Problems} list=${own} /><${Fields} table=${table} path=${path} value=${value ?? {}} around=${around} /></div>`;
}
