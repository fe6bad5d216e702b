// The page on which a model is edited: the editor, and the button that runs what it holds.

import { html, useEffect, useRef } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { mountEditor } from "/static/editor.js";

export function Edit({ from, motion, onStarted, onError }) {
  const slot = useRef(null);
  useEffect(() => {
    let editor = null, isGone = false;
    const onRun = (text, { name = "", file = "" } = {}) => api.post("/api/jobs", { task: "run", text, file, options: {}, name, parent: from ?? null }).then(onStarted).catch(onError);
    const open = async () => {
      const path = `/api/jobs/${encodeURIComponent(from)}`, of = motion ? `motions/${encodeURIComponent(motion)}/` : "";
      const [text, job] = from ? await Promise.all([api.get(`${path}/${of}model.toml`), api.get(path)]) : [];
      if (!isGone) editor = mountEditor(slot.current, { api, onRun, onError, text, origin: job?.file });
    };
    open().catch(onError);
    return () => { isGone = true; editor?.destroy?.(); };
  }, [from, motion]);
  return html`<div class="page" ref=${slot}></div>`;
}
