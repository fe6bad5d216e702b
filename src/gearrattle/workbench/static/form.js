// Forms made from the JSON Schema of a model file: a component that is new on the shelf needs nothing here.

import { html, useState } from "/static/vendor/htm-preact.js";

const UNKNOWN = {};

// The schema of a value, with references followed.
export function resolved(schema, node) {
  const reference = node?.$ref ?? node?.allOf?.[0]?.$ref;
  return reference ? { ...schema.$defs[reference.split("/").at(-1)], description: node.description ?? schema.$defs[reference.split("/").at(-1)].description } : node ?? UNKNOWN;
}

export function schemaAt(schema, path) {
  return path.reduce((node, key) => {
    const known = resolved(schema, node);
    return resolved(schema, typeof key === "number" ? known.prefixItems?.[key] ?? known.items : known.properties?.[key] ?? tableIn(schema, known)?.properties?.[key]);
  }, schema);
}

// Of a value that may have several forms, the one that is a table.
const tableIn = (schema, node) => (node.anyOf ?? node.oneOf ?? []).map((option) => resolved(schema, option)).find((option) => option.properties);

export function Row({ schema, tables, path, value, problems, bodies, edit }) {
  const table = path[0], known = schemaAt(schema, path);
  const own = problems.filter((problem) => String(problem.path) === String(path));
  const rename = (to) => edit({ op: "rename", table, name: value.name, to });
  return html`<fieldset class="row-form"><legend>${known.title ?? table}${value.name ? html` <span class="path">${value.name}</span>` : null}</legend>
    ${own.map((problem) => html`<p class="failed small">${problem.rule} ${problem.remedy}</p>`)}
    <${Fields} schema=${schema} known=${known} path=${path} value=${value} problems=${problems} bodies=${bodies} edit=${edit} rename=${path.length === 2 ? rename : null} /></fieldset>`;
}

// The fields that a table has, and a choice of those that it may have.
function Fields({ schema, known, path, value, problems, bodies, edit, rename }) {
  const all = Object.entries(known.properties ?? {});
  const isShown = ([name]) => name in value || (known.required ?? []).includes(name) || problems.some((problem) => String(problem.path?.slice(0, path.length + 1)) === String([...path, name]));
  const [more, setMore] = useState([]);
  const shown = all.filter((entry) => isShown(entry) || more.includes(entry[0]));
  const hidden = all.filter((entry) => !shown.includes(entry));
  return html`${shown.map(([name, node]) => html`<${Field} key=${name} schema=${schema} name=${name} node=${resolved(schema, node)} path=${[...path, name]} value=${value[name]} problems=${problems} bodies=${bodies} edit=${edit} rename=${name === "name" ? rename : null} />`)}
    ${hidden.length ? html`<label class="more"><span class="hidden">More</span><select aria-label="Add a value" value="" onChange=${(event) => { setMore([...more, event.target.value]); event.target.value = ""; }}><option value="">More …</option>
      ${hidden.map(([name, node]) => html`<option value=${name} title=${resolved(schema, node).description}>${name.replaceAll("_", " ")}</option>`)}</select></label>` : null}`;
}

function Field({ schema, name, node, path, value, problems, bodies, edit, rename }) {
  const shared = { schema, path, problems, bodies, edit };
  const table = node.properties ? node : tableIn(schema, node);
  if (Array.isArray(value) || node.type === "array") return html`<${List} ...${shared} name=${name} node=${node} value=${value ?? []} />`;
  if (table && (value === undefined || typeof value === "object")) {
    return html`<fieldset class="inner"><legend title=${node.description}>${name.replaceAll("_", " ")}</legend><${Fields} ...${shared} known=${table} value=${value ?? {}} /></fieldset>`;
  }
  return html`<${Scalar} name=${name} node=${node} path=${path} value=${value} problems=${problems} bodies=${bodies} edit=${edit} rename=${rename} />`;
}

// Values one after the other, or rows of a table.
function List({ schema, name, node, path, value, problems, bodies, edit }) {
  const shared = { schema, problems, bodies, edit };
  const item = (k) => resolved(schema, node.prefixItems?.[k] ?? node.items);
  const isFixed = node.minItems !== undefined && node.minItems === node.maxItems;
  const count = Math.max(value.length, isFixed ? node.minItems : 0);
  const isBody = BODIES.has(name);
  const fresh = item(value.length).properties ? Object.fromEntries((item(value.length).required ?? []).map((key) => [key, 1])) : isBody ? bodies[0] ?? "ground" : 1;
  return html`<fieldset class="inner"><legend title=${node.description}>${name.replaceAll("_", " ")}</legend>
    ${Array.from({ length: count }, (_, k) => html`<div class="entry" key=${k}>
      <${Field} ...${shared} name=${`${name} ${k + 1}`} node=${isBody ? { ...item(k), isBody } : item(k)} path=${[...path, k]} value=${value[k]} />
      ${isFixed ? null : html`<button type="button" class="plain" aria-label=${`Remove ${name} ${k + 1}`} onClick=${() => edit({ op: "delete", path: [...path, k] })}>Remove</button>`}</div>`)}
    ${isFixed ? null : html`<button type="button" onClick=${() => edit({ op: "set", path, value: [...value, fresh] })}>Add</button>`}</fieldset>`;
}

const BODIES = new Set(["between", "on", "sun", "ring", "carrier", "planets", "reference"]);

function Scalar({ name, node, path, value, problems, bodies, edit, rename }) {
  const own = problems.filter((problem) => problem.path?.length && String(problem.path) === String(path));
  const key = path.filter((part) => typeof part === "string").at(-1);
  const written = value === undefined ? "" : typeof value === "object" ? JSON.stringify(value) : String(value);
  const options = node.enum ?? (node.isBody || BODIES.has(key) ? [...bodies, "ground"] : node.type === "boolean" ? [true, false] : null);
  const change = (typed) => {
    if (typed === written) return;
    if (rename && value) rename(typed); else edit({ op: "set", path, ...(node.type === "boolean" ? { value: typed === "" ? null : typed === "true" } : { typed }) });
  };
  const example = node.anyOf?.flatMap((option) => option.examples ?? [])[0] ?? (node.default === undefined || node.default === null || typeof node.default === "object" ? "" : String(node.default));
  const id = `field-${path.join("-")}`;
  const shared = { id, "aria-invalid": own.length > 0, "aria-describedby": `${id}-help`, onChange: (event) => change(event.target.value) };
  return html`<div class="field"><label for=${id}>${name.replaceAll("_", " ")}</label>
    ${options ? html`<select ...${shared} value=${written}>${written === "" || !node.enum ? html`<option value=""></option>` : null}${options.map((option) => html`<option value=${String(option)} selected=${String(option) === written}>${String(option)}</option>`)}</select>`
      : html`<input ...${shared} value=${written} placeholder=${example} autocomplete="off" spellcheck="false" />`}
    <p id=${`${id}-help`} class=${own.length ? "failed small" : "muted small"}>${own.length ? own.map((problem) => `${problem.rule}${problem.remedy ? ` (${problem.remedy})` : ""}`).join("; ") : node.description ?? ""}</p></div>`;
}
