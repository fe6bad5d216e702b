// needs: host, plot, numerals, verdict, histories, phase_plane, map, figure, mode_shapes, motions
// A result of any kind: what came out first, then its parts as tabs. Model key "view": what views.py writes;
// figures and histories are asked for when their tab is opened. The same text runs on the page and in a notebook.

const { ask, element, innerModel } = host;
const WIDGETS = { phase_plane, figure, map };

function tableOf(table, caption) {
  const isWord = (k) => table.words.includes(k);
  const head = table.head.map((cell, k) => element(cell ? "th" : "td", { scope: cell ? "col" : null, class: isWord(k) ? null : "gr-n" }, cell));
  const rows = table.rows.map((row) => element("tr", {}, row.map((cell, k) =>
    (k === 0 ? element("th", { scope: "row" }, cell) : element("td", { class: isWord(k) ? null : "gr-n" }, cell)))));
  const made = element("table", {}, element("caption", {}, table.title || element("span", { class: "gr-hidden" }, caption)), element("thead", {}, element("tr", {}, head)), element("tbody", {}, rows));
  return element("div", { class: "gr-table" },
    element("div", { class: "gr-scroll", tabindex: 0, role: "region", "aria-label": table.title || caption }, made),
    table.note ? element("p", { class: "gr-note" }, table.note) : null);
}

class ResultView {
  constructor(model, el) {
    this.model = model;
    this.el = el;
    this.ends = [];
    this.view = model.get("view");
    this.body = element("div", { class: "gr-tabpanel", role: "tabpanel", tabindex: -1 });
    this.tabs = this.parts();
    this.list = element("div", { class: "gr-tabs", role: "tablist", "aria-label": "Parts of the result" },
      this.tabs.map((tab, k) => element("button", { type: "button", role: "tab", id: `gr-tab-${tab.key}`, onclick: () => this.open(k) }, tab.title)));
    this.list.addEventListener("keydown", (event) => this.key(event));
    el.replaceChildren(element("div", { class: "gr-widget gr-result" }, this.list, this.body));
    const asked = this.tabs.findIndex((tab) => tab.key === model.get("tab"));
    this.open(Math.max(0, asked));
  }

  // The tabs: the verdict of a run, its histories, then every section of the page; short ones stand together.
  parts() {
    const { view } = this, tabs = [];
    const sections = view.sections.filter((section) => section.key !== "notes");
    if (view.verdict) tabs.push({ key: "verdict", title: "Verdict", show: (into) => this.showVerdict(into) });
    else {
      const first = sections.length && sections[0].key === "summary" ? sections.shift() : null;
      const isBare = !first?.tables.length && !first?.figures.length; // the answer is what follows
      const beside = sections.length && (isBare || sections[0].figures.length) ? sections.shift() : null;
      tabs.push({ key: "summary", title: "Summary", show: (into) => this.showSummary(into, [first, beside].filter(Boolean)) });
    }
    if (this.model.get("has_histories")) tabs.push({ key: "histories", title: "Histories", show: (into) => this.widget(into, histories, {}) });
    const still = ["overview", "angle", "speed", "acceleration", "deflection", "force"]; // what the histories show, and zoom
    for (const section of sections) {
      const figures = section.figures.filter((entry) => !this.model.get("has_histories") || !still.includes(entry.key));
      if (section.figures.length && !figures.length && !section.tables.length) continue;
      const isOneOfSeveral = figures.length === 1 && section.figures.length > 1 && figures[0].tab;
      tabs.push({ key: section.key, title: figures.length > 1 && figures[0].tab ? "Figures" : isOneOfSeveral ? figures[0].tab : section.title, show: (into) => this.showSection(into, { ...section, figures }) });
    }
    const at = tabs.findIndex((tab) => tab.key === "linear");
    if (view.modes) tabs.splice(at < 0 ? 1 : at, 0, { key: "shapes", title: "Mode shapes", show: (into) => this.widget(into, mode_shapes, { modes: view.modes }) });
    if (this.model.get("has_sound")) tabs.push({ key: "sound", title: "Sound", show: (into) => this.showSound(into) });
    return tabs;
  }

  open(number) {
    this.close();
    const buttons = [...this.list.children];
    buttons.forEach((button, k) => { button.setAttribute("aria-selected", String(k === number)); button.tabIndex = k === number ? 0 : -1; });
    this.shown = number;
    this.body.setAttribute("aria-labelledby", buttons[number].id);
    this.body.replaceChildren();
    this.model.set("tab", this.tabs[number].key);
    this.tabs[number].show(this.body);
  }

  key(event) {
    const moves = { ArrowRight: 1, ArrowLeft: -1, Home: -this.shown, End: this.tabs.length - 1 - this.shown };
    if (!(event.key in moves)) return;
    event.preventDefault();
    const number = (this.shown + moves[event.key] + this.tabs.length) % this.tabs.length;
    this.open(number);
    this.list.children[number].focus();
  }

  close() { this.ends.splice(0).forEach((end) => end()); }

  widget(into, widget, values) {
    const el = element("div", {});
    into.append(el);
    const end = widget.render({ model: innerModel(this.model, values), el });
    if (end) this.ends.push(end);
  }

  showVerdict(into) {
    const openPart = (name) => { this.model.set("selected", [`deflection.${name}`, `force.${name}`]); this.open(this.tabs.findIndex((tab) => tab.key === "histories")); };
    const hasHistories = this.tabs.some((tab) => tab.key === "histories");
    into.append(...verdict.content(this.view, hasHistories ? openPart : null).filter(Boolean));
    if (this.view.verdict.scores) into.append(tableOf(this.view.verdict.scores, "What was forecast"));
  }

  showSummary(into, sections) {
    into.append(element("p", { class: "gr-lead" }, this.view.sentence));
    for (const section of sections) this.showSection(into, { ...section, lead: "" });
    if (this.view.notes.length) into.append(element("section", { class: "gr-trust" }, element("h2", {}, "Notes"), element("ul", {}, this.view.notes.map((note) => element("li", {}, note)))));
  }

  showSection(into, section) {
    if (section.lead) into.append(element("p", { class: "gr-lead" }, section.lead));
    into.append(...section.words.map((words) => element("p", {}, words)));
    if (section.notes.length) into.append(element("ul", {}, section.notes.map((note) => element("li", {}, note))));
    if (this.view.kind === "branches" && section.key === "branches") this.showBranches(into, section.figures);
    else if (section.figures.length) this.showFigures(into, section.figures);
    const tables = section.tables.map((table) => tableOf(table, section.title));
    if (tables.length) into.append(element("div", { class: section.in_columns ? "gr-columns" : null }, tables));
    if (section.text) into.append(element("details", {}, element("summary", {}, section.text.title), element("pre", { tabindex: 0 }, section.text.content)));
  }

  // Figures in tabs of their own are chosen by a word; others follow each other.
  showFigures(into, figures) {
    const isChosen = (entry) => entry.tab && figures.length > 1, chosen = figures.filter(isChosen);
    for (const entry of figures.filter((other) => !isChosen(other))) this.showFigure(into, entry);
    if (!chosen.length) return;
    const box = element("div", {}), select = element("select", { "aria-label": "Figure" }, chosen.map((entry, k) => element("option", { value: k }, entry.tab || entry.title)));
    select.addEventListener("change", () => { box.replaceChildren(); this.showFigure(box, chosen[select.value]); });
    into.append(element("label", { class: "gr-choice" }, "Show ", select), box);
    this.showFigure(box, chosen[0]);
  }

  // Branches, with the motion of the point that is pointed at beside them.
  async showBranches(into, figures) {
    const left = element("div", {}), right = element("div", {}), box = element("div", { class: "gr-beside" }, left, right);
    into.append(box);
    const drawn = figures.map((entry) => this.showFigure(left, entry));
    try {
      const { motions: known } = (await ask(this.model, { ask: "motions" })).content;
      const models = (await Promise.all(drawn)).map((own, k) => [figures[k].key, own]).filter(([, own]) => own);
      if (known && box.isConnected) this.ends.push(motions.follow(this.model, known, models, right));
    } catch (error) {
      right.append(element("p", { class: "gr-note" }, `No motions beside the branches: ${error.message}.`));
    }
  }

  // Returns the model of the figure's widget; null where there is none.
  async showFigure(into, entry) {
    const el = element("div", { class: "gr-slot" }), links = this.model.get("links");
    into.append(el);
    try {
      const { content } = await ask(this.model, { ask: "figure", name: entry.key, is_chart: entry.is_chart });
      if (!el.isConnected) return null;
      if (content.svg) { el.append(element("img", { src: content.svg, alt: entry.caption, class: "gr-picture" })); return null; }
      const kind = entry.key === "phase_plane" ? "phase_plane" : this.model.get("has_cases") && content.chart.panels.some((panel) => panel.heat || panel.cells.length) ? "map" : "figure";
      const inner = element("div", {});
      el.append(inner);
      const own = innerModel(this.model, { chart: content.chart, chosen: null, cursor: null, marked: null, el: inner });
      if (this.view.kind !== "branches") own.on("change:chosen", () => { this.model.set("chosen", { figure: entry.key, ...own.get("chosen") }); this.model.save_changes(); });
      const end = WIDGETS[kind].render({ model: own, el: inner });
      if (end) this.ends.push(end);
      if (links) el.append(element("p", { class: "gr-links" }, "For print: ", ["svg", "pdf"].map((form) => element("a", { href: `${links}/figures/${entry.key}.${form}`, download: `${entry.key}.${form}` }, form.toUpperCase()))));
      return own;
    } catch (error) {
      el.append(element("p", { role: "alert" }, `${entry.title}: ${error.message}`));
      return null;
    }
  }

  async showSound(into) {
    into.append(element("p", {}, "The force on the casing, or without bearings the impacts of all gear meshes, through an assumed path: take no level from it."));
    const state = element("p", { role: "status" }, "…");
    into.append(state);
    try {
      const { content, buffers } = await ask(this.model, { ask: "sound" });
      const source = content.url ?? URL.createObjectURL(new Blob([buffers[0]], { type: "audio/wav" }));
      state.before(element("p", {}, `${content.gain ? `The highest peak of this run is half of full scale, which is ${numerals.engineering(1 / content.gain, "Pa")}.` : "Nothing is heard: there are no impacts."} Two runs heard so are not at one gain; Compare and gr.listen give all designs the same.`));
      state.replaceWith(element("audio", { controls: true, src: source, "aria-label": "Sound of the run" }), element("p", { class: "gr-links" }, element("a", { href: source, download: "rattle.wav" }, "Download WAV (24 bit)")));
    } catch (error) {
      state.textContent = error.problems ? error.problems.map((problem) => problem.rule).join("; ") : error.message;
    }
  }
}

function render({ model, el }) {
  let shown = new ResultView(model, el);
  const changed = () => { shown.close(); shown = new ResultView(model, el); };
  model.on("change:view", changed);
  return () => { model.off("change:view", changed); shown.close(); };
}

export default { render, tableOf };
