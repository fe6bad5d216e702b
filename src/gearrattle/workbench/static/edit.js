// The page on which a model is edited: the editor, and the button that runs what it holds.

import { html, useEffect, useRef } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { mountEditor } from "/static/editor.js";

export function Edit({ from, motion, onStarted, onError }) {
  const slot = useRef(null);
  useEffect(() => {
    let editor = null, isGone = false;
    const onRun = (text, { name = "", task = "run", options = {} } = {}) => api.post("/api/jobs", { task, text, options, name, parent: from ?? null }).then(onStarted).catch(onError);
    const open = async () => {
      const of = motion ? `motions/${encodeURIComponent(motion)}/` : "";
      const text = from ? await api.get(`/api/jobs/${encodeURIComponent(from)}/${of}model.toml`) : undefined;
      if (!isGone) editor = await mountEditor(slot.current, { api, onRun, onError, text });
    };
    open().catch(onError);
    return () => { isGone = true; editor?.destroy?.(); };
  }, [from, motion]);
  return html`<div class="page" ref=${slot}></div>`;
}
