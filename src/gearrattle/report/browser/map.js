// needs: host, plot
// A map of a study: a click, or Enter at the cursor, chooses a case. Model key "chart": the figure; "chosen" receives
// {panel, x, y} in the units of the axes; "chart" may change while the map fills.

function render({ model, el }) {
  const { element } = host;
  const body = element("div", { class: "gr-figure gr-map" });
  const caption = element("figcaption", {});
  el.replaceChildren(element("figure", { class: "gr-widget" }, body, caption));
  const onClick = (chosen) => { model.set("chosen", chosen); model.save_changes(); };
  const figure = new plot.Figure(body, plot.decoded(model.get("chart")), { onClick });
  const show = () => {
    const chart = plot.decoded(model.get("chart"));
    figure.set(chart);
    caption.textContent = `${chart.caption ?? ""} A click opens the case.`;
    const legend = plot.legend(figure);
    if (legend) caption.append(legend);
  };
  show();
  model.on("change:chart", show);
  return () => { model.off("change:chart", show); figure.destroy(); };
}

export default { render };
