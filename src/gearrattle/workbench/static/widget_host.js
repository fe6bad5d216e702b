// A widget as a component of the page: loaded by its name when it is first shown.

import { html, useEffect, useRef, useState } from "/static/vendor/htm-preact.js";

const loaded = new Map();
export const widget = (name) => {
  if (!loaded.has(name)) loaded.set(name, import(`/widgets/${name}.js`).then((module) => module.default));
  return loaded.get(name);
};

export function Widget({ name, model, label }) {
  const slot = useRef(null);
  const [error, setError] = useState(null);
  useEffect(() => {
    let end = null, isGone = false;
    widget(name).then((made) => { if (!isGone) end = made.render({ model, el: slot.current }); }).catch((problem) => setError(problem.message));
    return () => { isGone = true; if (end) end(); };
  }, [name, model]);
  return html`<div ref=${slot} aria-label=${label} role=${label ? "group" : null}></div>${error ? html`<p role="alert" class="failed">${error}</p>` : null}`;
}
