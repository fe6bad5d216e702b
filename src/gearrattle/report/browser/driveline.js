// A driveline as a drawing that is selected, moved, connected and renamed by pointer and by keys.
// Model keys: drawing; selected ("coupling.0"); positions ({name: [x, y]}); regimes ({element: {regime, words: [...]}});
// problems ({"coupling.0": count}); editable. What the user wants changed is sent as
// {ask: "connect" | "insert" | "delete" | "rename", ...}.

const NS = "http://www.w3.org/2000/svg";
const HALF = 13, MARGIN = 22, LARGEST_SCALE = 1.25, STEP = 12, LINE = 15;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function svg(name, attributes, ...children) {
  const made = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) if (value !== null && value !== undefined && value !== false) made.setAttribute(key, value);
  made.append(...children.flat().filter(Boolean));
  return made;
}

const keyOf = (path) => path.join(".");
const pretty = (text) => text.replace(/\^2/g, "²").replace(/\*/g, " ").replace(/(\d)e(-?\d+)/, "$1·10^$2").replace(/\^(-?\d+)/, (_, power) => [...power].map((digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit] ?? "⁻").join(""));
const plus = (a, b, factor = 1) => ({ x: a.x + factor * b.x, y: a.y + factor * b.y });
const point = ({ x, y }) => `${x.toFixed(1)} ${y.toFixed(1)}`;

// Distance of a point from a segment, as long as it lies beside its inner part.
function beside(p, a, b) {
  const dx = b.x - a.x, dy = b.y - a.y, share = ((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy || 1);
  if (share < 0.08 || share > 0.92) return Infinity;
  return Math.hypot(p.x - a.x - share * dx, p.y - a.y - share * dy);
}

function render({ model, el }) {
  const get = (name, fallback) => model.get(name) ?? fallback;
  const EMPTY = { bodies: [], links: [], axles: [], loads: [] };
  const state = { drawing: EMPTY, at: [], nodes: new Map(), links: [], view: null, scale: 1, isMine: false, connecting: null, drag: null, isLate: false, focus: "" };
  const marks = svg("g", {}), rubber = svg("path", { class: "gr-rubber" });
  const hint = document.createElement("p");
  hint.className = "gr-driveline-hint";
  hint.setAttribute("role", "status");
  const sheet = svg("svg", { class: "gr-sheet", role: "group", "aria-label": "Driveline", tabindex: -1 }, marks, rubber);
  const buttons = document.createElement("div");
  buttons.className = "gr-zoom";
  for (const [sign, words, act] of [["+", "Zoom in", () => zoom(1.25)], ["−", "Zoom out", () => zoom(0.8)], ["⤢", "Show all", () => { state.isMine = false; fit(); }]]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = sign;
    button.setAttribute("aria-label", words);
    button.title = words;
    button.addEventListener("click", act);
    buttons.append(button);
  }
  const frame = document.createElement("div");
  frame.className = "gr-widget gr-driveline";
  frame.append(sheet, buttons, hint);
  el.append(frame);

  const drawing = () => state.drawing;
  const say = (words) => { hint.textContent = words; };
  const ask = (question) => { if (get("editable", false)) model.send(question); };

  // ---- where everything stands

  function settle() {
    const moved = get("positions", {});
    state.at = drawing().bodies.map((body) => (moved[body.name] ? { x: moved[body.name][0], y: moved[body.name][1] } : { x: body.x, y: body.y }));
  }

  function endOf(link, side) {
    const end = link.ends[side], other = link.ends[1 - side];
    if (end.body >= 0) return { ...plus(state.at[end.body], { x: discOf(link, side), y: 0 }), w: HALF, h: drawing().bodies[end.body].height / 2 };
    const home = drawing().bodies[other.body], from = state.at[other.body] ?? { x: 0, y: 0 };
    return { x: end.x + (home ? from.x - home.x : 0), y: end.y + (home ? from.y - home.y : 0), w: HALF, h: 20, missing: end.body === -2, isFrame: true };
  }

  // A mesh hangs from the disc of its own; whatever else begins at the disc that is nearest to its other end.
  function discOf(link, side) {
    const end = link.ends[side], other = link.ends[1 - side], { discs } = drawing().bodies[end.body];
    if (link.along_line || discs.length < 2) return end.offset;
    const towards = other.body >= 0 ? state.at[other.body].x : state.at[end.body].x + other.x - drawing().bodies[end.body].x;
    return discs.reduce((best, x) => (Math.abs(state.at[end.body].x + x - towards) < Math.abs(state.at[end.body].x + best - towards) ? x : best));
  }

  const reach = (end, u) => Math.min(end.w / (Math.abs(u.x) || 1e-9), end.h / (Math.abs(u.y) || 1e-9));

  // The line of a link, where its symbol stands and how it is turned, and where its label stands.
  function shapeOf(link) {
    const a = endOf(link, 0), b = endOf(link, 1), length = Math.hypot(b.x - a.x, b.y - a.y) || 1;
    const u = { x: (b.x - a.x) / length, y: (b.y - a.y) / length };
    const level = Math.abs(u.x) >= Math.abs(u.y);
    const n = level ? { x: 0, y: 1 } : { x: 1, y: 0 };
    const isBlocked = state.at.some((p, k) => link.ends.every((end) => end.body !== k) && beside(p, a, b) < 26);
    const depth = link.lane || isBlocked ? 58 + 40 * Math.max(0, link.lane - (isBlocked ? 0 : 1)) + Math.max(a.h, b.h) * (level ? 0.5 : 0) : 0;
    const from = depth ? plus(a, n, depth) : plus(a, u, reach(a, u)), to = depth ? plus(b, n, depth) : plus(b, u, -reach(b, u));
    const free = Math.hypot(to.x - from.x, to.y - from.y), size = Math.min(1, free / (link.width + 6));
    const middle = { x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 };
    const left = plus(middle, u, -size * link.width / 2), right = plus(middle, u, size * link.width / 2);
    const start = depth ? `M${point(plus(a, n, reach(a, n)))} L${point(from)}` : `M${point(from)}`;
    const last = depth ? ` L${point(plus(b, n, reach(b, n)))}` : "";
    const label = level ? { ...plus(middle, { x: 0, y: 32 }), anchor: "middle" } : { ...plus(middle, { x: 26, y: -2 }), anchor: "start" };
    return { line: `${start} L${point(left)} M${point(right)} L${point(to)}${last}`, hit: `${start} L${point(to)}${last}`, middle, size, angle: Math.atan2(u.y, u.x) * 180 / Math.PI, label, ends: [a, b] };
  }

  // ---- drawing

  function draw() {
    state.drawing = get("drawing", EMPTY);
    settle();
    const seen = new Map();
    const { bodies, links, axles, loads } = drawing();
    for (const link of links) {
      const pair = [...link.ends.map((end) => end.body)].sort().join();
      link.lane = link.ends.some((end) => end.body < 0) ? 0 : seen.get(pair) ?? 0;
      seen.set(pair, (seen.get(pair) ?? 0) + 1);
    }
    state.nodes.clear();
    state.links = links.map(linkNode);
    state.axles = axles.map(([planet, carrier]) => ({ planet, carrier, node: svg("path", { class: "gr-axle" }) }));
    state.bodies = bodies.map((body, k) => bodyNode(body, k, loads.filter((load) => load.body === k)));
    marks.replaceChildren(...state.axles.map((axle) => axle.node), ...state.links.map((link) => link.node), ...state.bodies);
    state.links.forEach(placeLink);
    state.axles.forEach(placeAxle);
    bodies.forEach((_, k) => placeBody(k));
    rove();
    if (!state.isMine) fit();
  }

  function item(key, words, className, ...children) {
    const problems = get("problems", {})[key] ?? 0, isSelected = key === get("selected", "");
    const said = `${words}${problems ? `, ${problems} ${problems === 1 ? "problem" : "problems"}` : ""}`;
    const node = svg("g", { class: `${className}${isSelected ? " gr-selected" : ""}${problems ? " gr-wrong" : ""}`, "data-key": key, role: "button", "aria-description": said, "aria-pressed": isSelected, tabindex: -1 }, ...children);
    if (!state.nodes.has(key)) state.nodes.set(key, node);
    return node;
  }

  function linkNode(link) {
    const regime = get("regimes", {})[link.element];
    const words = [link.name || "unnamed", ...(regime?.words ?? [])];
    const text = svg("text", {}, words.map((word, k) => Object.assign(svg("tspan", { class: k ? "gr-regime" : "gr-name" }), { textContent: word })));
    const parts = { hit: svg("path", { class: "gr-hit" }), line: svg("path", { class: "gr-line" }), symbol: svg("path", { class: "gr-line", d: `M${-link.width / 2} 0 ${link.symbol}` }), grounds: link.ends.map(() => svg("path", { class: "gr-line" })) };
    const ends = link.ends.map((end) => (end.body >= 0 ? drawing().bodies[end.body].name : end.body === -1 ? "ground" : "a body that does not exist"));
    const isFirst = !state.nodes.has(keyOf(link.path));
    const node = item(keyOf(link.path), `${link.noun} ${link.name} between ${ends.join(" and ")}${regime ? `, ${regime.words[0] ?? regime.regime}` : ""}`, `gr-link${regime ? ` gr-${regime.regime}` : ""}${link.sound ? "" : " gr-unsound"}`, parts.hit, parts.line, parts.symbol, parts.grounds, text);
    if (!isFirst) { node.setAttribute("aria-hidden", "true"); node.removeAttribute("role"); }
    return { ...link, node, text, parts };
  }

  function placeLink(link) {
    const shape = shapeOf(link);
    link.parts.hit.setAttribute("d", shape.hit);
    link.parts.line.setAttribute("d", shape.line);
    link.parts.symbol.setAttribute("transform", `translate(${point(shape.middle)}) rotate(${shape.angle.toFixed(1)}) scale(${shape.size.toFixed(3)})`);
    shape.ends.forEach((end, k) => {
      const path = end.missing ? "m-8 -8 l16 16 m0 -16 l-16 16" : `m-13 0 h19 m0 -26 v52${[0, 1, 2, 3, 4].map((row) => ` M6 ${-26 + 10 * row} l9 8`).join("")}`;
      if (end.isFrame) { link.parts.grounds[k].setAttribute("d", end.missing ? `M0 0 ${path}` : `M0 0 ${path}`); link.parts.grounds[k].setAttribute("transform", `translate(${point(end)}) rotate(${turnOf(link, k)})`); }
    });
    link.text.setAttribute("text-anchor", shape.label.anchor);
    [...link.text.children].forEach((line, k) => { line.setAttribute("x", shape.label.x.toFixed(1)); line.setAttribute("y", (shape.label.y + LINE * k).toFixed(1)); });
    link.at = shape.middle;
  }

  // The hatching of ground turns its back to the body.
  function turnOf(link, side) {
    const a = endOf(link, 1 - side), b = endOf(link, side);
    return Math.abs(b.x - a.x) >= Math.abs(b.y - a.y) ? (b.x >= a.x ? 0 : 180) : b.y >= a.y ? 90 : 270;
  }

  function placeAxle(axle) {
    axle.node.setAttribute("d", `M${point(state.at[axle.planet])} L${point(state.at[axle.carrier])}`);
  }

  function bodyNode(body, k, loads) {
    const discs = body.discs.map((x) => svg("rect", { class: "gr-disc", x: x - HALF, y: -body.height / 2, width: 2 * HALF, height: body.height, rx: 4 }));
    const shaft = body.discs.length > 1 ? svg("path", { class: "gr-shaft", d: `M${Math.min(...body.discs)} 0 H${Math.max(...body.discs)}` }) : null;
    const name = Object.assign(svg("text", { class: "gr-name" }), { textContent: body.name || "unnamed" });
    const inertia = Object.assign(svg("text", { class: "gr-size" }), { textContent: body.inertia ? `J = ${pretty(body.inertia)}` : "J = ?" });
    const node = item(keyOf(body.path), `inertia ${body.name}`, "gr-node", shaft, discs, name, inertia);
    node.dataset.body = k;
    const chips = loads.map((load) => {
      const text = Object.assign(svg("text", {}), { textContent: pretty(load.words) || load.path[0] });
      return item(keyOf(load.path), `${load.path[0]} on ${body.name}: ${load.words}`, "gr-load", svg("path", { class: "gr-line", d: `M${-load.width} 0 ${load.symbol}` }), text);
    });
    const handle = get("editable", false) ? svg("g", { class: "gr-handle", "data-handle": k, "aria-hidden": "true" }, svg("circle", { r: 11, class: "gr-hit-disc" }), svg("circle", { r: 6 }), Object.assign(svg("title", {}), { textContent: "Drag to another body to connect" })) : null;
    return svg("g", { "data-place": k }, node, chips, handle);
  }

  function placeBody(k) {
    const { x, y } = state.at[k], body = drawing().bodies[k], half = body.height / 2, group = state.bodies[k];
    group.setAttribute("transform", `translate(${x.toFixed(1)} ${y.toFixed(1)})`);
    let above = false, below = false;
    for (const link of state.links) {
      const side = link.ends.findIndex((end) => end.body === k);
      if (side < 0) continue;
      const own = endOf(link, side), other = endOf(link, 1 - side);
      if (Math.abs(other.y - own.y) > Math.abs(other.x - own.x)) { if (other.y < own.y) above = true; else if (own.x === x) below = true; }
    }
    const [name, inertia] = group.querySelectorAll(".gr-name, .gr-size"), chips = [...group.querySelectorAll(".gr-load")];
    const aside = above && below, count = 2 + chips.length;
    const left = aside ? HALF + 8 : 0, first = aside ? half + 14 : above ? half + 18 : -half - 10 - LINE * (count - 1);
    const anchor = aside ? "start" : "middle";
    [name, inertia].forEach((line, row) => { line.setAttribute("x", left); line.setAttribute("y", first + LINE * row); line.setAttribute("text-anchor", anchor); });
    chips.forEach((chip, row) => {
      const text = chip.querySelector("text"), shift = 0.6;
      text.setAttribute("text-anchor", "start");
      const width = 6.3 * text.textContent.length + 20, start = aside ? left + 20 : -width / 2 + 20;
      text.setAttribute("x", start);
      text.setAttribute("y", first + LINE * (2 + row));
      chip.querySelector("path").setAttribute("transform", `translate(${start - 6} ${first + LINE * (2 + row) - 4}) scale(${shift})`);
    });
    group.querySelector(".gr-handle")?.setAttribute("transform", `translate(${Math.max(...body.discs) + HALF + 14} ${half > 24 ? 12 - half : -half})`);
  }

  function fit() {
    const drawn = marks.childElementCount ? marks.getBBox() : { x: 0, y: 0, width: 0, height: 0 };
    const box = { x: drawn.x - MARGIN, y: drawn.y - MARGIN, w: drawn.width + 2 * MARGIN, h: drawn.height + 2 * MARGIN };
    const size = { w: sheet.clientWidth || 800, h: sheet.clientHeight || 500 };
    const scale = Math.min(LARGEST_SCALE, size.w / box.w, size.h / box.h);
    const w = size.w / scale, h = size.h / scale;
    show({ x: box.x - (w - box.w) / 2, y: box.y - (h - box.h) / 2, w, h });
  }

  function show(view) {
    state.view = view;
    state.scale = view.w / (sheet.clientWidth || 800);
    sheet.setAttribute("viewBox", `${view.x} ${view.y} ${view.w} ${view.h}`);
  }

  // Another size of the sheet shows the whole driveline again, or the part that the user looks at or holds, as large as before.
  function resized() {
    const isHeld = state.isMine || Boolean(state.drag);
    if (!isHeld) fit();
    else if (sheet.clientWidth) show({ ...state.view, w: state.scale * sheet.clientWidth, h: state.scale * sheet.clientHeight });
    state.isLate ||= Boolean(state.drag);
  }

  function zoom(factor, centre) {
    const { x, y, w, h } = state.view, c = centre ?? { x: x + w / 2, y: y + h / 2 };
    state.isMine = true;
    show({ x: c.x - (c.x - x) / factor, y: c.y - (c.y - y) / factor, w: w / factor, h: h / factor });
  }

  // ---- selecting and moving

  function select(key) {
    model.set("selected", key);
    model.save_changes();
  }

  function move(k, to) {
    state.at[k] = to;
    placeBody(k);
    const touched = state.links.filter((link) => link.ends.some((end) => end.body === k));
    touched.forEach(placeLink);
    new Set(touched.flatMap((link) => link.ends.map((end) => end.body)).filter((body) => body >= 0)).forEach(placeBody);
    state.axles.filter((axle) => axle.planet === k || axle.carrier === k).forEach(placeAxle);
  }

  function keep(k) {
    const { x, y } = state.at[k];
    model.set("positions", { ...get("positions", {}), [drawing().bodies[k].name]: [Math.round(x), Math.round(y)] });
    model.save_changes();
  }

  function rove(key = state.focus || get("selected", "")) {
    const chosen = state.nodes.get(key) ?? state.nodes.values().next().value;
    for (const node of state.nodes.values()) node.setAttribute("tabindex", node === chosen ? 0 : -1);
  }

  function focusOn(key) {
    state.focus = key;
    rove(key);
    state.nodes.get(key)?.focus();
  }

  function middleOf(key) {
    const body = drawing().bodies.findIndex((entry) => keyOf(entry.path) === key);
    if (body >= 0) return state.at[body];
    const link = state.links.find((entry) => keyOf(entry.path) === key);
    if (link) return link.at;
    const load = drawing().loads.find((entry) => keyOf(entry.path) === key);
    return plus(state.at[load.body] ?? { x: 0, y: 0 }, { x: 0, y: -64 });
  }

  function neighbour(key, [x, y]) {
    const from = middleOf(key);
    let best = null, least = Infinity;
    for (const other of state.nodes.keys()) {
      if (other === key || (state.connecting !== null && !other.startsWith("inertia."))) continue;
      const to = middleOf(other), along = (to.x - from.x) * x + (to.y - from.y) * y, across = Math.abs((to.x - from.x) * y) + Math.abs((to.y - from.y) * x);
      const cost = along + 2 * across;
      if (along > 4 && along >= 0.6 * across && cost < least) { best = other; least = cost; }
    }
    return best;
  }

  const bodyOf = (key) => (key.startsWith("inertia.") ? Number(key.slice(8)) : null);

  function begin(k) {
    state.connecting = k;
    state.origin = drawing().bodies[k].name;
    frame.classList.add("gr-connecting");
    say(`Connect ${drawing().bodies[k].name}: arrow keys to a body and Enter; G for ground; N for a new inertia; Escape to leave.`);
  }

  function end() {
    state.connecting = null;
    frame.classList.remove("gr-connecting");
    rubber.removeAttribute("d");
    say("");
  }

  function connect(to, at = null) {
    const from = state.connecting;
    end();
    if (to !== from) ask({ ask: "connect", from, to, at });
  }

  function pressed(event) {
    const key = event.target.closest?.("[data-key]")?.dataset.key;
    if (!key) return;
    const body = bodyOf(key), direction = KEYS[event.key], isConnecting = state.connecting !== null;
    const letter = event.ctrlKey || event.metaKey ? "" : event.key.toLowerCase();
    const press = () => (isConnecting ? body !== null && connect(body) : select(key));
    const remove = () => ask({ ask: "delete", path: key });
    const acts = {
      enter: press,
      " ": press,
      escape: () => (isConnecting ? end() : select("")),
      delete: remove,
      backspace: remove,
      f2: () => { select(key); ask({ ask: "rename", path: key }); },
      c: () => body !== null && get("editable", false) && begin(body),
      g: () => isConnecting && connect(-1),
      n: () => (isConnecting ? connect(null) : body !== null && ask({ ask: "connect", from: body, to: null })),
      "+": () => zoom(1.25),
      "-": () => zoom(0.8),
      0: () => { state.isMine = false; fit(); },
    };
    if (direction && event.altKey && body !== null) {
      const step = event.shiftKey ? 4 * STEP : STEP;
      move(body, plus(state.at[body], { x: step * direction[0], y: step * direction[1] }));
      keep(body);
    } else if (direction) {
      const next = neighbour(key, direction);
      if (next) focusOn(next);
    } else if (acts[letter]) acts[letter]();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // ---- pointer

  const placeOf = (event) => { const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(sheet.getScreenCTM().inverse()); return { x: p.x, y: p.y }; };

  function down(event) {
    if (event.button) return;
    const handle = event.target.closest("[data-handle]"), node = event.target.closest("[data-key]");
    const place = node?.closest("[data-place]"), at = placeOf(event);
    sheet.setPointerCapture(event.pointerId);
    const body = node && bodyOf(node.dataset.key) !== null ? Number(place.dataset.place) : null;
    if (handle || (body !== null && event.shiftKey && get("editable", false))) { begin(handle ? Number(handle.dataset.handle) : body); state.drag = { kind: "connect", at }; }
    else if (body !== null) state.drag = { kind: "move", body, at, home: state.at[body], key: node.dataset.key, isMoved: false };
    else if (node) state.drag = { kind: "pick", key: node.dataset.key, at };
    else state.drag = { kind: "pan", at, client: [event.clientX, event.clientY], view: state.view, isMoved: false };
  }

  function dragged(event) {
    const drag = state.drag;
    if (!drag) return;
    const at = placeOf(event), far = Math.hypot(at.x - drag.at.x, at.y - drag.at.y);
    if (drag.kind === "connect") {
      rubber.setAttribute("d", `M${point(state.at[state.connecting])} L${point(at)}`);
      mark(under(event, at));
    } else if (drag.kind === "move" && (drag.isMoved || far > 4)) {
      drag.isMoved = true;
      move(drag.body, plus(drag.home, { x: at.x - drag.at.x, y: at.y - drag.at.y }));
    } else if (drag.kind === "pan") {
      const scale = drag.view.w / sheet.clientWidth, shift = [event.clientX - drag.client[0], event.clientY - drag.client[1]];
      if (!drag.isMoved && Math.hypot(...shift) < 4) return;
      drag.isMoved = state.isMine = true;
      show({ ...drag.view, x: drag.view.x - scale * shift[0], y: drag.view.y - scale * shift[1] });
    }
  }

  // The body below the pointer, -1 over a ground symbol, null elsewhere.
  function under(event, at) {
    const near = state.at.findIndex((p, k) => drawing().bodies[k].discs.some((x) => Math.abs(at.x - p.x - x) < HALF + 12) && Math.abs(at.y - p.y) < drawing().bodies[k].height / 2 + 14);
    if (near >= 0) return near;
    return state.links.some((link) => link.ends.some((end, side) => end.body === -1 && Math.hypot(endOf(link, side).x - at.x, endOf(link, side).y - at.y) < 30)) ? -1 : null;
  }

  function mark(body) {
    state.bodies.forEach((node, k) => node.classList.toggle("gr-target", k === body && k !== state.connecting));
  }

  function up(event) {
    const drag = state.drag, at = placeOf(event);
    state.drag = null;
    if (!drag) return;
    drop(event, drag, at);
    catchUp();
  }

  function drop(event, drag, at) {
    if (drag.kind === "connect") {
      mark(null);
      const isFar = Math.hypot(at.x - drag.at.x, at.y - drag.at.y) > 12, target = under(event, at);
      if (isFar && target !== state.connecting) connect(target, target === null ? [Math.round(at.x), Math.round(at.y)] : null);
      else if (isFar) end();
    } else if (drag.kind === "move" && drag.isMoved) keep(drag.body);
    else if (drag.kind === "pan") { if (!drag.isMoved) { if (state.connecting !== null) end(); select(""); } } else {
      if (state.connecting !== null && drag.kind === "move") { connect(drag.body); return; }
      select(drag.key);
      focusOn(drag.key);
    }
  }

  function wheel(event) {
    if (!event.ctrlKey && !event.metaKey && document.activeElement?.closest?.(".gr-driveline") !== frame) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 400), placeOf(event));
  }

  // While the pointer holds a part nothing moves under it: what changes in the meantime is drawn when it lets go.
  function redraw() {
    if (state.drag) { state.isLate = true; return; }
    state.isLate = false;
    const focused = marks.contains(document.activeElement) ? document.activeElement.dataset.key : "";
    draw();
    if (focused && state.nodes.has(focused)) focusOn(focused);
  }

  const catchUp = () => { if (state.isLate) redraw(); };

  sheet.addEventListener("pointerdown", down);
  sheet.addEventListener("pointermove", dragged);
  sheet.addEventListener("pointerup", up);
  sheet.addEventListener("pointercancel", () => { state.drag = null; catchUp(); });
  sheet.addEventListener("dblclick", (event) => { const node = event.target.closest("[data-key]"); if (node) ask({ ask: "rename", path: node.dataset.key }); });
  sheet.addEventListener("wheel", wheel, { passive: false });
  sheet.addEventListener("keydown", pressed);
  sheet.addEventListener("focusin", (event) => { const key = event.target.closest?.("[data-key]")?.dataset.key; if (key) { state.focus = key; rove(key); } });
  const names = ["drawing", "selected", "positions", "regimes", "problems", "editable"];
  for (const name of names) model.on(`change:${name}`, redraw);
  const lost = () => { if (state.connecting !== null && get("drawing", EMPTY).bodies[state.connecting]?.name !== state.origin) end(); };
  model.on("change:drawing", lost);
  const shown = (message) => { if (message?.focus) focusOn(message.focus); };
  model.on("msg:custom", shown);
  const sized = new ResizeObserver(resized);
  sized.observe(sheet);
  draw();
  return () => {
    for (const name of names) model.off(`change:${name}`, redraw);
    model.off("change:drawing", lost);
    model.off("msg:custom", shown);
    sized.disconnect();
    frame.remove();
  };
}

export default { render };
