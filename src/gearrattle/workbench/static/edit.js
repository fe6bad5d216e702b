// The page on which a model is edited: the editor, and the button that runs what it holds.

import { html, useEffect, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";

export function Edit({ from, onStarted, onError }) {
  const slot = useRef(null);
  const [isMissing, setMissing] = useState(false);
  useEffect(() => {
    let editor = null, isGone = false;
    const onRun = (text, { name = "", task = "run", options = {} } = {}) => api.post("/api/jobs", { task, text, options, name, parent: from ?? null }).then(onStarted).catch(onError);
    const open = async () => {
      let module;
      try { module = await import("/static/editor.js"); } catch { setMissing(true); return; }
      const text = from ? await api.get(`/api/jobs/${encodeURIComponent(from)}/model.toml`) : undefined;
      if (!isGone) editor = await module.mountEditor(slot.current, { api, onRun, onError, text });
    };
    open().catch(onError);
    return () => { isGone = true; editor?.destroy?.(); };
  }, [from]);
  return html`<div class="page" ref=${slot}></div>${isMissing ? html`<${PlainEditor} from=${from} onStarted=${onStarted} onError=${onError} />` : null}`;
}

// The text alone, where the drawing cannot be loaded.
function PlainEditor({ from, onStarted, onError }) {
  const [text, setText] = useState("");
  const [examples, setExamples] = useState([]);
  useEffect(() => {
    api.get("/api/examples").then(setExamples).catch(onError);
    if (from) api.get(`/api/jobs/${encodeURIComponent(from)}/model.toml`).then(setText).catch(onError);
  }, [from]);
  const open = (name) => name && api.get(`/api/examples/${encodeURIComponent(name)}`).then((example) => setText(example.text)).catch(onError);
  const run = () => api.post("/api/jobs", { task: "run", text, options: {}, name: "", parent: from ?? null }).then(onStarted).catch(onError);
  return html`<section class="page card"><div class="form"><label>Open an example<select onChange=${(event) => open(event.target.value)}><option value="">Choose …</option>
      ${examples.map(({ name, title }) => html`<option value=${name}>${title || name}</option>`)}</select></label><button type="button" class="primary" disabled=${!text.trim()} onClick=${run}>Run</button></div>
    <label><span class="hidden">Model file</span><textarea class="model-text" spellcheck="false" value=${text} onInput=${(event) => setText(event.target.value)}></textarea></label></section>`;
}
