// needs: host, plot
// One figure of any result: model key "chart" holds it; "chosen" receives where it was clicked.

function render({ model, el }) {
  const chart = plot.decoded(model.get("chart"));
  const body = host.element("div", { class: "gr-figure" });
  const caption = host.element("figcaption", {}, chart.caption ?? "");
  el.replaceChildren(host.element("figure", { class: "gr-widget" }, body, caption));
  const onClick = (chosen) => { model.set("chosen", chosen); model.save_changes(); };
  const figure = new plot.Figure(body, chart, { onClick });
  const legend = plot.legend(chart, plot.themeOf(body));
  if (legend) caption.append(legend);
  const changed = () => figure.set(plot.decoded(model.get("chart")));
  model.on("change:chart", changed);
  return () => { model.off("change:chart", changed); figure.destroy(); };
}

export default { render };
