// needs: host, plot
// Phase planes: rate over deflection, one panel a clearance, with a point that runs along the motion.
// Model key "chart": the figure "phase_plane"; it is redrawn as it changes.

const ROUND = 12; // s for all that is drawn

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
      const k = Math.min(line.x.length - 1, Math.floor(share * line.x.length));
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
    const legend = plot.legend(figure.chart, plot.themeOf(body));
    if (legend) caption.append(legend);
  };
  show();
  model.on("change:chart", show);
  return () => { cancelAnimationFrame(frame); model.off("change:chart", show); figure.destroy(); };
}

export default { render };
