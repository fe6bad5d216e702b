// The page on which a model is edited: the editor, and the button that runs what it holds.

import { html, useEffect, useRef } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { mountEditor, withFile } from "/static/editor.js";

// The model of a run, or of a motion of it, with the file that it came from.
async function runModel(id, motion) {
  const path = `/api/jobs/${encodeURIComponent(id)}`, of = motion ? `motions/${encodeURIComponent(motion)}/` : "";
  const [text, job] = await Promise.all([api.get(`${path}/${of}model.toml`), api.get(path)]);
  return withFile(api, text, job);
}

export function Edit({ from, motion, onStarted, onError }) {
  const slot = useRef(null);
  useEffect(() => {
    let editor = null, isGone = false;
    const onRun = (text, { file, parent }) => api.post("/api/jobs", { task: "run", text, file, options: {}, parent }).then(onStarted).catch(onError);
    const open = async () => {
      const opened = from ? await runModel(from, motion) : null;
      if (isGone) return;
      editor = mountEditor(slot.current, { api, onRun, onError, opened });
      if (from) history.replaceState(null, "", "#/edit"); // a reload shows what is edited, not the run again
    };
    open().catch(onError);
    return () => { isGone = true; editor?.destroy?.(); };
  }, [from, motion]);
  return html`<div class="page" ref=${slot}></div>`;
}
