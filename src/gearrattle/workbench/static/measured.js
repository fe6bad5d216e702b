// Measured over simulated: histories, spectra and orders of a recording laid over those of a run.

import { html, useEffect, useMemo, useRef, useState } from "/static/vendor/htm-preact.js";
import { api } from "/static/api.js";
import { fileAnswers, jobAnswers, standIn } from "/static/model_stand_in.js";
import { Widget } from "/static/widget_host.js";
import { Fit } from "/static/fit.js";

const READ = ".csv,.mat,.h5,.hdf5,.mf4,.uff,.unv,.wav,.nc,.toml";
const MOTIONS = ["run", "simulate"];
const MEASURED = "#d55e00";

export function Measured({ jobs, query, onStarted, onError }) {
  const motions = (jobs ?? []).filter((job) => job.state === "done" && MOTIONS.includes(job.task));
  const [asked, setJob] = useState(query.get("job") ?? "");
  const job = motions.some(({ id }) => id === asked) ? asked : motions[0]?.id ?? "";
  const [files, setFiles] = useState([]);
  const [file, setFile] = useState(query.get("file") ?? "");
  const [known, setKnown] = useState({ simulated: null, measured: null });
  const [pair, setPair] = useState({ simulated: "", measured: "", shift: 0 });
  const [peak, setPeak] = useState(null);
  const picker = useRef(null);
  const list = () => api.get("/api/files").then((all) => setFiles(all.filter((entry) => READ.split(",").some((end) => entry.path.toLowerCase().endsWith(end))))).catch(onError);
  useEffect(() => { list(); }, []);
  useEffect(() => { if (job) api.get(`/api/jobs/${job}/traces`).then((simulated) => setKnown((old) => ({ ...old, simulated }))).catch(onError); }, [job]);
  useEffect(() => {
    setKnown((old) => ({ ...old, measured: null }));
    if (file) api.get(`/api/measured?file=${encodeURIComponent(file)}`).then((measured) => setKnown((old) => ({ ...old, measured }))).catch(onError);
  }, [file]);
  useEffect(() => { if (known.simulated && known.measured) setPair({ ...matching(known), shift: 0 }); }, [known.simulated, known.measured]);
  const upload = async (event) => {
    const [chosen] = event.target.files;
    if (!chosen) return;
    const path = `/api/files/${encodeURIComponent(chosen.name)}`;
    try {
      await api.put(path, chosen).catch((error) => {
        if (error.status !== 412) throw error;
        return confirm(`${chosen.name} ${error.problems[0].rule}. Overwrite it?`) ? api.replace(path, chosen) : null;
      });
      await list();
      setFile(chosen.name);
    } catch (error) { onError(error); }
    event.target.value = "";
  };
  const align = async () => {
    const query = new URLSearchParams({ job, file, simulated: pair.simulated, measured: pair.measured });
    try { const { shift } = await api.get(`/api/measured/shift?${query}`); setPair((before) => ({ ...before, shift: Number(shift.toPrecision(8)) })); } catch (error) { onError(error); }
  };
  return html`<div class="page">
    <section class="card"><h1>Measured over simulated</h1>
      <div class="form">
        <label>Run<select value=${job} onChange=${(event) => setJob(event.target.value)}>${motions.length ? null : html`<option value="">no finished run</option>`}${motions.map((entry) => html`<option value=${entry.id}>${entry.label}</option>`)}</select></label>
        <label>Measured file<select value=${file} onChange=${(event) => setFile(event.target.value)}><option value="">Choose …</option>${files.map((entry) => html`<option value=${entry.path}>${entry.path}</option>`)}</select></label>
        <button type="button" onClick=${() => picker.current.click()}>Import a file …</button>
        <input ref=${picker} class="hidden" type="file" accept=${READ} aria-label="Measured file to import" tabindex="-1" onChange=${upload} />
      </div>
      ${file && known.simulated && known.measured ? html`<${Pair} known=${known} pair=${pair} align=${align} set=${(changes) => setPair((before) => ({ ...before, ...changes }))} />`
        : html`<p class="muted">CSV, MAT, HDF5, ASAM MDF, UFF, WAV, or a measurement.toml that names the channels; up to 20 MB.</p>`}
    </section>
    ${job && file && known.simulated && known.measured && pair.simulated && pair.measured ? html`<${Overlay} key=${`${job}|${file}|${pair.simulated}|${pair.measured}|${pair.shift}`} job=${job} file=${file} known=${known} pair=${pair} onPeak=${setPeak} />` : null}
    <${Fit} job=${job} files=${files} file=${file} known=${known} pair=${pair} peak=${file ? peak : null} onStarted=${onStarted} onError=${onError} />
  </div>`;
}

// The first measured channel with a simulated one of its quantity and subject, or of its quantity.
function matching({ simulated, measured }) {
  for (const isSame of [(a, b) => a.quantity === b.quantity && a.label === b.label, (a, b) => a.quantity === b.quantity, (a, b) => a.unit === b.unit]) {
    for (const channel of measured.channels) {
      const partner = channel.quantity || channel.unit ? simulated.channels.find((other) => isSame(other, channel)) : null;
      if (partner) return { simulated: partner.name, measured: channel.name };
    }
  }
  return { simulated: simulated.channels[0]?.name ?? "", measured: measured.channels[0]?.name ?? "" };
}

function Pair({ known, pair, set, align }) {
  const select = (side, words) => html`<label>${words}<select value=${pair[side]} onChange=${(event) => set({ [side]: event.target.value })}>
    ${known[side].channels.map((channel) => html`<option value=${channel.name}>${channel.name}${channel.unit ? ` [${channel.unit}]` : ""}</option>`)}</select></label>`;
  const units = ["simulated", "measured"].map((side) => known[side].channels.find((channel) => channel.name === pair[side])?.unit);
  return html`<div class="form">${select("simulated", "Simulated channel")}${select("measured", "Measured channel")}
    <label>Shift of the measured time [s]<input type="text" inputmode="decimal" value=${pair.shift} onChange=${(event) => set({ shift: Number(event.target.value) || 0 })} /></label>
    <button type="button" title="The shift with which both agree best, within the judged part of the run" onClick=${align}>Align</button></div>
    ${units[0] && units[1] && units[0] !== units[1] ? html`<p class="failed small">The units differ: ${units[0]} and ${units[1]}. The values are laid over as they are.</p>` : null}`;
}

function Overlay({ job, file, known, pair, onPeak }) {
  const [spectra, setSpectra] = useState(null);
  const [error, setError] = useState(null);
  const histories = useMemo(() => {
    const measured = fileAnswers(file);
    const answers = jobAnswers(job, { overlay: (question) => measured.trace({ ...question, channels: [question.channel] }) });
    const { begin, end } = known.measured, window = [Math.max(known.simulated.begin, begin + pair.shift), Math.min(known.simulated.end, end + pair.shift)];
    return standIn({ selected: [pair.simulated], window: window[0] < window[1] ? window : null, overlay: [{ over: pair.simulated, channel: pair.measured, label: "measured", shift: pair.shift }] }, answers);
  }, []);
  useEffect(() => {
    Promise.all([
      api.get(`/api/jobs/${job}/spectrum?channel=${encodeURIComponent(pair.simulated)}`),
      api.get(`/api/measured/spectrum?file=${encodeURIComponent(file)}&channel=${encodeURIComponent(pair.measured)}`),
    ]).then((both) => { setSpectra(both); onPeak(highest(both[1])); }).catch(setError);
    return () => onPeak(null);
  }, []);
  return html`<section class="card" aria-label="Histories"><h2>Histories</h2><${Widget} name="histories" model=${histories} /></section>
    ${spectra ? html`<${Spectra} spectra=${spectra} />` : html`<section class="card" aria-label="Spectra"><h2>Spectra</h2>${error ? html`<p class="failed" role="alert">${error.message}</p>` : html`<p class="loading">Computing …</p>`}</section>`}`;
}

// The highest peak of a measured spectrum, its mean left out, as a text with its unit.
function highest({ channel, frequency, psd, frequency_unit: unit }) {
  const at = psd.reduce((best, value, k) => (k > 1 && value > psd[best] ? k : best), Math.min(2, psd.length - 1));
  return { channel, text: `${Number(frequency[at].toPrecision(4))} ${unit}` };
}

function Spectra({ spectra }) {
  const [simulated, measured] = spectra, [isOrders, setOrders] = useState(false);
  const model = useMemo(() => {
    const shaft = isOrders && simulated.shaft ? simulated.shaft / (2 * Math.PI) : 1;
    const line = ({ frequency, psd }, name, colour) => ({ x: frequency.map((f) => f / shaft), y: psd, name, colour, legend: true });
    const high = Math.min(simulated.frequency.at(-1), measured.frequency.at(-1)) / shaft;
    const panel = { title: "Power spectral density", unit: `[${simulated.unit}]`, x_title: isOrders && simulated.shaft ? "order of the shaft" : `frequency [${simulated.frequency_unit}]`, y_log: true, x_range: [0, high],
      lines: [line(simulated, "simulated", "#0b5c8f"), line(measured, "measured", MEASURED)] };
    return standIn({ chart: { title: "Spectra", caption: "Densities of both, by the same estimate (Hann window, averaged).", panels: [panel], panel_height: 320, share_x: true } });
  }, [isOrders]);
  return html`<section class="card" aria-label="Spectra"><div class="head"><h2 class="title">Spectra</h2>
    ${simulated.shaft ? html`<label><input type="checkbox" checked=${isOrders} onChange=${(event) => setOrders(event.target.checked)} /> over orders</label>` : null}</div>
    <${Widget} name="figure" model=${model} /></section>`;
}
