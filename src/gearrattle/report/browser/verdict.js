// needs: host, plot, numerals
// The verdict of a run: headline, numbers, the driveline coloured by severity and regime, every part, and why to trust it.
// Model key "view": the view of a run.

const { element } = host;
const HEADLINES = { quiet: "Quiet", touches: "Touches, no rattle", "single-sided": "Single-sided rattle", "double-sided": "Double-sided rattle" };
const ENLARGED = 1.15;
const SIDES = ["coast", "centre", "drive"];

function svgOf(text) {
  const parsed = new DOMParser().parseFromString(text.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" '), "image/svg+xml");
  return parsed.documentElement.nodeName === "svg" ? document.importNode(parsed.documentElement, true) : null;
}

function shareBar({ shares, contact_share: contact }) {
  if (!shares) return element("span", {}, `in contact ${numerals.numeral(100 * contact, 3)} %`);
  if (!Object.keys(shares).length) return element("small", {}, "always in contact");
  const words = SIDES.map((side) => `${side} ${numerals.numeral(100 * shares[side], 3)} %`).join(", ");
  const bar = element("span", { class: "gr-share", role: "img", "aria-label": words, title: words });
  for (const side of SIDES) {
    const part = element("i", { class: `gr-${side}` });
    part.style.width = `${100 * shares[side]}%`;
    bar.append(part);
  }
  return bar;
}

function partsTable(parts, open) {
  const number = (words) => element("td", { class: "gr-n" }, words);
  const head = ["Part", "Severity", "Regime", "Impacts per cycle", "Fastest approach", "Hardest impact", "Coast · centre · drive"];
  const rows = parts.map((part) => {
    const pill = element("span", { class: `gr-pill gr-${part.rattles ? part.regime : part.severity}` }, part.severity);
    const name = open ? element("button", { class: "gr-link", type: "button", title: `Histories of ${part.name}`, onclick: () => open(part.name) }, part.name) : part.name;
    return element("tr", {},
      element("th", { scope: "row" }, name),
      element("td", {}, pill, part.separates || part.regime === "quiet" ? null : element("small", {}, " changes stage")),
      element("td", {}, part.regime),
      number(numerals.numeral(part.impacts_per_cycle, 3)),
      number(numerals.engineering(part.max_approach_speed, part.speed_unit)),
      number(numerals.engineering(part.max_impact_energy, part.energy_unit)),
      element("td", {}, shareBar(part)));
  });
  const titles = head.map((title, k) => element("th", { scope: "col", class: k > 2 && k < 6 ? "gr-n" : null }, title));
  return element("div", { class: "gr-scroll", tabindex: 0, role: "region", "aria-label": "Parts of the verdict" },
    element("table", {}, element("thead", {}, element("tr", {}, titles)), element("tbody", {}, rows)));
}

function tilesOf(tiles) {
  return element("dl", { class: "gr-tiles" }, tiles.map((tile) =>
    element("div", {}, element("dt", {}, tile.label), element("dd", {}, tile.value), element("dd", { class: "gr-detail" }, tile.detail))));
}

// What is shown of a verdict; open(name): called when a part is chosen.
function content(view, open) {
  const { verdict } = view;
  const parts = [
    element("header", { class: `gr-verdict gr-${verdict.state}` },
      element("p", { class: "gr-headline" }, verdict.headline ?? HEADLINES[verdict.state]),
      element("p", { class: "gr-lead" }, verdict.sentence),
      verdict.cause ? element("p", {}, verdict.cause) : null),
    verdict.tiles ? tilesOf(verdict.tiles) : null,
  ];
  const drawing = verdict.drawing ? svgOf(verdict.drawing) : null;
  if (drawing) drawing.style.maxWidth = `${Math.round(ENLARGED * drawing.viewBox.baseVal.width)}px`; // letters as on the page
  if (drawing) parts.push(element("div", { class: "gr-drawing gr-scroll", tabindex: 0, role: "region", "aria-label": "Driveline, coloured by regime" }, drawing));
  parts.push(partsTable(verdict.parts, open));
  if (verdict.trust) {
    parts.push(element("section", { class: "gr-trust", "aria-label": "How far to trust it" }, element("h2", {}, "How far to trust it"),
      element("ul", {}, [...verdict.trust, ...view.notes].map((words) => element("li", {}, words)))));
  }
  return parts;
}

function render({ model, el }) {
  const body = element("div", { class: "gr-widget" });
  el.replaceChildren(body);
  const show = () => body.replaceChildren(...content(model.get("view")).filter(Boolean));
  show();
  model.on("change:view", show);
  return () => model.off("change:view", show);
}

export default { render, content };
