// needs: host, plot
// Phase planes: rate over deflection, one panel a clearance, with a point that runs along the motion.
// Model key "chart": the figure "phase_plane"; it is redrawn as it changes.

const ROUND = 12; // s for all that is drawn
const known = new WeakMap();

// When each point of a line is passed, as a share of the whole: a way takes its length across over its mean rate.
function instants({ x, y }) {
  if (known.has(x)) return known.get(x);
  const ways = Array.from({ length: Math.max(0, x.length - 1) }, (_, k) => (2 * (x[k + 1] - x[k])) / (y[k] + y[k + 1]));
  const sound = ways.filter((way) => way > 0 && Number.isFinite(way)).sort((a, b) => a - b);
  const usual = sound[sound.length >> 1] || 1, longest = sound[Math.floor(0.99 * sound.length)] || 1; // where the rate vanishes
  let sum = 0;
  const sums = [0, ...ways.map((way) => (sum += way > 0 && Number.isFinite(way) ? Math.min(way, longest) : usual))];
  known.set(x, sums.map((at) => at / (sum || 1)));
  return known.get(x);
}

function indexAt(shares, share) {
  let low = 0, high = shares.length - 1;
  while (high - low > 1) { const middle = (low + high) >> 1; if (shares[middle] <= share) low = middle; else high = middle; }
  return low;
}

function render({ model, el }) {
  const { element } = host;
  const body = element("div", { class: "gr-figure" });
  const play = element("button", { type: "button", "aria-pressed": "false", title: "Let a point run along the motion" }, "▶ Play");
  const caption = element("figcaption", {});
  el.replaceChildren(element("figure", { class: "gr-widget" }, element("div", { class: "gr-toolbar" }, play), body, caption));
  const figure = new plot.Figure(body, plot.decoded(model.get("chart")));
  let frame = 0, begin = 0;

  const step = (now) => {
    const share = ((now - begin) / 1000 / ROUND) % 1;
    for (const panel of figure.panels) {
      const line = panel.panel.lines[0];
      if (!line?.x.length) continue;
      const k = indexAt(instants(line), share);
      panel.cursor = { x: line.x[k], points: [{ x: line.x[k], y: line.y[k], colour: "#d55e00" }] };
      panel.draw();
    }
    frame = requestAnimationFrame(step);
  };
  play.addEventListener("click", () => {
    const isRunning = play.getAttribute("aria-pressed") === "true";
    cancelAnimationFrame(frame);
    play.setAttribute("aria-pressed", String(!isRunning));
    play.textContent = isRunning ? "▶ Play" : "❚❚ Pause";
    if (isRunning) figure.leave();
    else { begin = performance.now(); frame = requestAnimationFrame(step); }
  });

  const show = () => {
    const chart = plot.decoded(model.get("chart"));
    figure.set(chart);
    caption.textContent = chart.caption ?? "";
    const legend = plot.legend(figure);
    if (legend) caption.append(legend);
  };
  show();
  model.on("change:chart", show);
  return () => { cancelAnimationFrame(frame); model.off("change:chart", show); figure.destroy(); };
}

export default { render };
