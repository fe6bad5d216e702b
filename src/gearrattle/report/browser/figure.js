// needs: host, plot
// One figure of any result: model key "chart" holds it; "chosen" receives where it was clicked, "cursor" where the
// pointer is or null; "marked" holds points to mark, a list a panel.

function render({ model, el }) {
  const chart = plot.decoded(model.get("chart"));
  const body = host.element("div", { class: "gr-figure" });
  const caption = host.element("figcaption", {}, chart.caption ?? "");
  el.replaceChildren(host.element("figure", { class: "gr-widget" }, body, caption));
  const onClick = (chosen) => { model.set("chosen", chosen); model.save_changes(); };
  const onCursor = (value, panel) => model.set("cursor", value && { ...value, panel: panel.index, limits: panel.now });
  const figure = new plot.Figure(body, chart, { onClick, onCursor });
  const legend = plot.legend(figure);
  if (legend) caption.append(legend);
  const changed = () => figure.set(plot.decoded(model.get("chart")));
  const mark = () => figure.mark(model.get("marked"));
  model.on("change:chart", changed);
  model.on("change:marked", mark);
  mark();
  return () => { model.off("change:chart", changed); model.off("change:marked", mark); figure.destroy(); };
}

export default { render };
