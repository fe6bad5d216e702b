"use strict";
(() => {
  // The motion at the point of the branches that is pointed at: phase plane and multipliers, drawn anew at every move.
  const data = JSON.parse(document.getElementById("at-point-data").textContent);
  const slider = document.getElementById("at-point-slider");
  const choice = document.getElementById("at-point-clearance");
  const words = document.getElementById("at-point-words");
  const plane = document.getElementById("at-point-plane");
  const circle = document.getElementById("at-point-circle");
  const SVG = "http://www.w3.org/2000/svg";
  const drawnCharts = new Map();

  const samples = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Int16Array(bytes.buffer);
  };
  for (const clearance of data.clearances) {
    clearance.curves = samples(clearance.curves);
    let first = 0;
    clearance.first = clearance.counts.map((count) => { first += count; return first - count; });
  }

  const add = (parent, name, attributes, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };

  const ticks = ([low, high], most = 4) => {
    const rough = (high - low) / most;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough);
    const values = [];
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) values.push(Number((k * step).toPrecision(6)));
    return values;
  };

  const frame = (svg, box, xRange, yRange, xTitle, yTitle) => {
    svg.replaceChildren();
    const x = (value) => box.left + ((value - xRange[0]) / (xRange[1] - xRange[0])) * box.width;
    const y = (value) => box.top + box.height - ((value - yRange[0]) / (yRange[1] - yRange[0])) * box.height;
    for (const value of ticks(yRange)) {
      add(svg, "path", { d: `M${box.left} ${y(value)}h${box.width}`, class: "grid" });
      add(svg, "text", { x: box.left - 6, y: y(value) + 4, "text-anchor": "end" }, String(value).replace("-", "−"));
    }
    for (const value of ticks(xRange, Math.min(5, box.width / 60))) {
      add(svg, "text", { x: x(value), y: box.top + box.height + 16, "text-anchor": "middle" }, String(value).replace("-", "−"));
    }
    add(svg, "text", { x: box.left + box.width / 2, y: box.top + box.height + 34, "text-anchor": "middle" }, xTitle);
    add(svg, "text", { x: box.left, y: box.top - 8, class: "title" }, yTitle);
    return { x, y };
  };

  const drawPlane = (index) => {
    const clearance = data.clearances[choice ? Number(choice.value) : 0];
    const wide = Math.max(260, Math.min(560, plane.clientWidth || 560)); // letters keep their size
    plane.setAttribute("viewBox", `0 0 ${wide} 330`);
    const box = { left: 62, top: 26, width: wide - 74, height: 254 };
    const at = frame(plane, box, clearance.x_range, clearance.y_range, clearance.x_title, clearance.y_title);
    for (const band of clearance.bands) {
      const low = at.x(band.low === null ? clearance.x_range[0] : Math.max(band.low, clearance.x_range[0]));
      const high = at.x(band.high === null ? clearance.x_range[1] : Math.min(band.high, clearance.x_range[1]));
      if (high > low) {
        add(plane, "rect", { x: low, y: box.top, width: high - low, height: box.height, fill: band.colour, opacity: 0.08 });
      }
    }
    for (const corner of clearance.corners) {
      if (corner < clearance.x_range[0] || corner > clearance.x_range[1]) continue;
      add(plane, "path", { d: `M${at.x(corner)} ${box.top}v${box.height}`, class: "corner" });
    }
    const first = 2 * clearance.first[index];
    const value = (k, range) => range[0] + ((clearance.curves[first + k] + 32767) / 65534) * (range[1] - range[0]);
    const steps = [];
    for (let k = 0; k < clearance.counts[index]; k += 1) {
      steps.push(`${at.x(value(2 * k, clearance.x_range)).toFixed(1)} ${at.y(value(2 * k + 1, clearance.y_range)).toFixed(1)}`);
    }
    add(plane, "path", { d: `M${steps.join("L")}`, class: data.points[index].stable ? "loop" : "loop unstable" });
    for (const start of clearance.starts[index]) {
      const [x, y] = steps[start].split(" ");
      add(plane, "circle", { cx: x, cy: y, r: 4, class: "begin" });
    }
  };

  const drawCircle = (index) => {
    const box = { left: 46, top: 26, width: 254, height: 254 };
    const range = [-data.radius, data.radius];
    const at = frame(circle, box, range, range, "real part", "multipliers, imaginary part");
    add(circle, "circle", { cx: at.x(0), cy: at.y(0), r: at.x(1) - at.x(0), class: "unit" });
    for (const [real, imaginary] of data.points[index].multipliers) {
      if (Math.max(Math.abs(real), Math.abs(imaginary)) > data.radius) continue;
      const outside = Math.hypot(real, imaginary) > 1 + 1e-9;
      const [x, y] = [at.x(real), at.y(imaginary)];
      if (outside) add(circle, "path", { d: `M${x - 5} ${y - 5}l10 10m0 -10l-10 10`, class: "outside" });
      else add(circle, "circle", { cx: x, cy: y, r: 4, class: "inside" });
    }
  };

  const axisName = (letter, panel) => (panel === 0 ? letter : `${letter}${panel + 1}`);
  const mark = (key) => {
    const drawn = drawnCharts.get(key);
    if (!drawn) return;
    const index = Number(slider.value);
    const marks = drawn.traces.map((_, i) => i);
    const xs = marks.map((i) => data.levels[key][i].map(() => data.value[index]));
    const ys = marks.map((i) => data.levels[key][i].map((level) => level[index]));
    Plotly.restyle(drawn.live, { x: xs, y: ys }, drawn.traces);
  };

  let pending = 0;
  const show = (index) => {
    slider.value = String(index);
    words.textContent = data.points[index].words;
    slider.setAttribute("aria-valuetext", data.points[index].words);
    drawPlane(index);
    drawCircle(index);
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(() => drawnCharts.forEach((_, key) => mark(key)));
  };

  const nearest = (key, event) => {
    // Every panel of a chart is over the same value; the pointed one tells which level it is.
    const { x, y, yaxis, xaxis } = event;
    const panel = yaxis._name === "yaxis" ? 0 : Number(yaxis._name.slice(5)) - 1;
    const span = (range) => Math.abs(range[1] - range[0]) || 1;
    let best = [Infinity, 0];
    data.value.forEach((value, index) => {
      for (const level of data.levels[key][panel]) {
        const away = Math.hypot((value - x) / span(xaxis.range), (level[index] - y) / span(yaxis.range));
        if (away < best[0]) best = [away, index];
      }
    });
    return best[1];
  };

  document.addEventListener("figure-drawn", (event) => {
    const { key, live } = event.detail;
    if (!data.levels[key] || drawnCharts.has(key)) return;
    const look = { size: 13, color: "rgba(0,0,0,0)", line: { color: "#a8123e", width: 2.2 } };
    const traces = data.levels[key].map((_, panel) => ({
      x: [], y: [], mode: "markers", marker: look, hoverinfo: "skip", showlegend: false,
      xaxis: axisName("x", panel), yaxis: axisName("y", panel),
    }));
    const first = live.data.length;
    Plotly.addTraces(live, traces).then(() => {
      drawnCharts.set(key, { live, traces: traces.map((_, i) => first + i) });
      mark(key);
    });
    const follow = (hovered) => show(nearest(key, hovered.points[0]));
    live.on("plotly_hover", follow);
    live.on("plotly_click", follow);
  });
  slider.addEventListener("input", () => show(Number(slider.value)));
  const again = () => show(Number(slider.value));
  if (choice) choice.addEventListener("change", again);
  addEventListener("resize", again);
  show(0);
})();
