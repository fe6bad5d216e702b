// needs: host, plot, numerals
// Mode shapes that move: every body a disc that turns by its share of the mode, much enlarged.
// Model key "modes": {names, frequencies [Hz, or 1], unit, shapes: modes of bodies, damping}.

const { element } = host;
const SVG = "http://www.w3.org/2000/svg";
const LARGEST = 60; // degrees of the body that turns most
const SLOWEST = 0.4, FASTEST = 1.6; // turns of the drawing a second: slow modes move slowly, all can be followed
const PITCH = 118, RADIUS = 34;

function drawn(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

function render({ model, el }) {
  const modes = model.get("modes"), count = modes.names.length;
  const columns = Math.min(count, 8), rows = Math.ceil(count / columns);
  const svg = drawn("svg", { viewBox: `0 0 ${columns * PITCH} ${rows * (PITCH + 24)}`, class: "gr-modes", role: "img" });
  svg.style.maxWidth = `${1.25 * columns * PITCH}px`;
  const spokes = modes.names.map((name, k) => {
    const x = (k % columns + 0.5) * PITCH, y = (Math.floor(k / columns) + 0.42) * (PITCH + 24);
    const spoke = drawn("g", {}, drawn("line", { x1: x, y1: y, x2: x, y2: y - RADIUS, class: "gr-spoke" }), drawn("circle", { cx: x, cy: y - RADIUS, r: 4, class: "gr-tip" }));
    const value = drawn("text", { x, y: y + RADIUS + 34, class: "gr-value" });
    svg.append(drawn("circle", { cx: x, cy: y, r: RADIUS, class: "gr-body" }), drawn("line", { x1: x, y1: y, x2: x, y2: y - RADIUS, class: "gr-rest" }), spoke, drawn("text", { x, y: y + RADIUS + 18, class: "gr-name" }, name), value);
    return { spoke, value, x, y };
  });
  const label = (k) => `${modes.frequencies[k] < 1e-6 * Math.max(...modes.frequencies) ? "rigid" : `${numerals.numeral(modes.frequencies[k], 4)} ${modes.unit}`}`;
  const select = element("select", { "aria-label": "Mode" }, modes.frequencies.map((_, k) => element("option", { value: k }, `${k + 1}: ${label(k)}`)));
  const play = element("button", { type: "button", "aria-pressed": "true" }, "❚❚ Pause");
  const words = element("span", { class: "gr-state" });
  el.replaceChildren(element("div", { class: "gr-widget" }, element("div", { class: "gr-toolbar" }, element("label", {}, "Mode ", select), play, words), svg));
  let frame = 0, begin = performance.now(), shown = 0;
  const isStill = matchMedia("(prefers-reduced-motion: reduce)").matches;

  const turn = (share) => spokes.forEach(({ spoke, x, y }, k) => spoke.setAttribute("transform", `rotate(${LARGEST * share * scaled(k)} ${x} ${y})`));
  const scaled = (k) => modes.shapes[shown][k] / Math.max(...modes.shapes[shown].map(Math.abs), 1e-300);
  const step = (now) => {
    const share = modes.frequencies[shown] / (Math.max(...modes.frequencies) || 1);
    turn(Math.cos(2 * Math.PI * (SLOWEST + (FASTEST - SLOWEST) * Math.sqrt(share)) * ((now - begin) / 1000)));
    frame = requestAnimationFrame(step);
  };
  const show = (k) => {
    shown = k;
    spokes.forEach(({ value }, body) => { value.textContent = numerals.numeral(Math.abs(scaled(body)) < 5e-4 ? 0 : scaled(body), 3); });
    words.textContent = modes.damping?.[k] > 0 ? `damping ratio ${numerals.numeral(100 * modes.damping[k], 3)} %` : "";
    svg.setAttribute("aria-label", `Mode ${k + 1}, ${label(k)}: ${modes.names.map((name, body) => `${name} ${numerals.numeral(scaled(body), 2)}`).join(", ")}`);
    turn(1);
  };
  const run = (isRunning) => {
    cancelAnimationFrame(frame);
    play.setAttribute("aria-pressed", String(isRunning));
    play.textContent = isRunning ? "❚❚ Pause" : "▶ Play";
    if (isRunning) { begin = performance.now(); frame = requestAnimationFrame(step); } else turn(1);
  };
  select.addEventListener("change", () => show(Number(select.value)));
  play.addEventListener("click", () => run(play.getAttribute("aria-pressed") !== "true"));
  const first = Math.max(0, modes.frequencies.findIndex((f) => f > 1e-6 * Math.max(...modes.frequencies)));
  select.value = String(first);
  show(first);
  run(!isStill);
  return () => cancelAnimationFrame(frame);
}

export default { render };
