// The drawing of a driveline: bodies as discs, what connects them as symbols. Everything in it can be reached and
// selected by the keyboard; a drag from one body to another connects them.

import { html, useRef, useState } from "/static/vendor/htm-preact.js";

const DISC = 14, MARGIN = 120;

export function Drawing({ drawing, selected, select, connect, problems }) {
  const svg = useRef(null);
  const [drag, setDrag] = useState(null);
  const { bodies, links, loads, axles } = drawing;
  const xs = bodies.flatMap(({ x, discs }) => discs.map((disc) => x + disc)), ys = bodies.map(({ y }) => y);
  const box = [Math.min(...xs) - MARGIN, Math.min(...ys) - MARGIN, Math.max(...xs) - Math.min(...xs) + 2 * MARGIN, Math.max(...ys) - Math.min(...ys) + 2 * MARGIN];
  const isBad = (path) => problems.some((problem) => path.every((key, k) => problem.path?.[k] === key));
  const state = (path) => ({
    class: `${String(path) === String(selected) ? "selected" : ""} ${isBad(path) ? "bad" : ""}`,
    tabindex: 0, role: "button",
    "aria-pressed": String(path) === String(selected),
    onClick: () => select(path),
    onKeyDown: (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); select(path); } },
  });
  const at = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.current.getScreenCTM().inverse());
    return { x: point.x, y: point.y };
  };
  const bodyAt = ({ x, y }) => bodies.findIndex((body) => body.discs.some((disc) => Math.abs(body.x + disc - x) < 26) && Math.abs(body.y - y) < body.height / 2 + 8);
  const begin = (event) => { const from = bodyAt(at(event)); if (from >= 0) setDrag({ from, to: at(event) }); };
  const move = (event) => { if (drag) setDrag({ ...drag, to: at(event) }); };
  const end = (event) => {
    if (!drag) return;
    const to = bodyAt(at(event));
    if (to >= 0 && to !== drag.from) connect(bodies[drag.from].name, bodies[to].name);
    setDrag(null);
  };
  const position = (point, other, below) => {
    if (point.body >= 0) return [bodies[point.body].x + point.offset, bodies[point.body].y];
    const partner = other.body >= 0 ? bodies[other.body] : { x: 0, y: 0 };
    return [partner.x + (other.offset ?? 0), partner.y + below];
  };
  return html`<svg ref=${svg} class="driveline" viewBox=${box.join(" ")} role="group" aria-label="Driveline" onPointerDown=${begin} onPointerMove=${move} onPointerUp=${end} onPointerLeave=${() => setDrag(null)}>
    ${axles.map(([planet, carrier]) => html`<line class="axle" x1=${bodies[planet].x} y1=${bodies[planet].y} x2=${bodies[carrier].x} y2=${bodies[carrier].y} />`)}
    ${links.map((link, k) => html`<${Link} key=${`l${k}`} link=${link} from=${position(link.ends[0], link.ends[1], 60)} to=${position(link.ends[1], link.ends[0], 60)} state=${state(link.path)} />`)}
    ${bodies.map((body, k) => html`<g key=${`b${k}`} ...${state(body.path)} aria-label=${`inertia ${body.name}, ${body.inertia}`}>
      <title>${body.name}: ${body.inertia}</title>
      ${body.discs.length > 1 ? html`<line class="shaft" x1=${body.x + Math.min(...body.discs)} x2=${body.x + Math.max(...body.discs)} y1=${body.y} y2=${body.y} />` : null}
      ${body.discs.map((disc) => html`<rect class="disc" x=${body.x + disc - DISC / 2} y=${body.y - body.height / 2} width=${DISC} height=${body.height} rx="2" />`)}
      <text class="name" x=${body.x + 11} y=${body.y - body.height / 2 + 2}>${body.name}</text></g>`)}
    ${loads.filter(({ body }) => body >= 0).map((load, k) => html`<g key=${`t${k}`} ...${state(load.path)} aria-label=${`torque on ${bodies[load.body].name}: ${load.words}`}><title>${load.words}</title>
      <path class="load" d=${`M${bodies[load.body].x - 34} ${bodies[load.body].y + bodies[load.body].height / 2 + 8} a12 12 0 1 1 20 0 m-7 -1 l7 1 l1 -7`} />
      <text class="small" x=${bodies[load.body].x - 10} y=${bodies[load.body].y + bodies[load.body].height / 2 + 26}>${load.words}</text></g>`)}
    ${drag ? html`<line class="drag" x1=${bodies[drag.from].x} y1=${bodies[drag.from].y} x2=${drag.to.x} y2=${drag.to.y} />` : null}
  </svg>`;
}

// A symbol half way between two points, drawn along the line that joins them.
function Link({ link, from, to, state }) {
  const [x, y] = from, length = Math.hypot(to[0] - x, to[1] - y) || 1;
  const angle = (Math.atan2(to[1] - y, to[0] - x) * 180) / Math.PI;
  const middle = [(x + to[0]) / 2, (y + to[1]) / 2];
  const isUpright = Math.abs(Math.sin((angle * Math.PI) / 180)) > 0.5;
  const path = `M0 0 H${(length - link.width) / 2} ${link.symbol} H${length}`;
  return html`<g ...${state} class=${`link ${state.class}`} aria-label=${`${link.noun} ${link.name}`}><title>${link.noun} ${link.name}</title>
    <g transform=${`translate(${x} ${y}) rotate(${angle})`}><path class="touch" d=${`M0 0 H${length}`} /><path d=${path} /></g>
    <text class=${isUpright ? "beside" : ""} x=${middle[0] + (isUpright ? 28 : 0)} y=${middle[1] + (isUpright ? 4 : 34)}>${link.name}</text></g>`;
}
