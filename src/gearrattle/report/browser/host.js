// What a widget asks of its host: a page answers over HTTP, a notebook over its kernel, with the same messages.
// A question is {ask, id, ...}; the answer {id, ...} comes with arrays as buffers, or {id, problems}.

let last = 0;

function ask(model, question, signal) {
  const id = ++last;
  return new Promise((resolve, reject) => {
    const answered = (content, buffers) => {
      if (!content || content.id !== id) return;
      model.off("msg:custom", answered);
      if (content.problems) reject(Object.assign(new Error(content.problems[0].rule), { problems: content.problems }));
      else resolve({ content, buffers: buffers ?? [] });
    };
    model.on("msg:custom", answered);
    if (signal) signal.addEventListener("abort", () => model.off("msg:custom", answered), { once: true });
    model.send({ ...question, id });
  });
}

// Arrays as Python packs them: little-endian float64, how many parts, the length of each, then the arrays of each.
function unpacked(buffer, arraysOfPart) {
  const view = buffer instanceof DataView ? buffer : new DataView(buffer.buffer ?? buffer, buffer.byteOffset ?? 0, buffer.byteLength);
  const values = new Float64Array(view.byteLength / 8);
  for (let k = 0; k < values.length; k++) values[k] = view.getFloat64(8 * k, true);
  const parts = [];
  let at = 1 + values[0];
  for (let p = 0; p < values[0]; p++) {
    const length = values[1 + p], arrays = [];
    for (let a = 0; a < arraysOfPart; a++, at += length) arrays.push(values.subarray(at, at + length));
    parts.push(arrays);
  }
  return parts;
}

// What a widget within another one or a page has for a model: keys of its own, questions handed on.
function innerModel(model, values) {
  const heard = new Map();
  return {
    get: (key) => (key in values ? values[key] : model?.get(key)),
    set: (key, value) => { values[key] = value; (heard.get(`change:${key}`) ?? []).forEach((hear) => hear()); },
    save_changes: () => {},
    send: (content) => model.send(content),
    on: (name, hear) => (name === "msg:custom" ? model.on(name, hear) : heard.set(name, [...(heard.get(name) ?? []), hear])),
    off: (name, hear) => (name === "msg:custom" ? model.off(name, hear) : heard.set(name, (heard.get(name) ?? []).filter((other) => other !== hear))),
  };
}

// An element with attributes, properties and children; text goes in as text.
function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return made;
}

export default { ask, unpacked, element, innerModel };
