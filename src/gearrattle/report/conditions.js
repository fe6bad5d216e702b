// The map of a study of conditions as buttons: one shows the row of its condition and plays its sound, in a loop, all
// at one gain. Arrow keys move, Enter or space chooses, Escape stops. It asks nothing of any server.
"use strict";
(() => {
  const FADE = 0.01; // s
  const known = JSON.parse(document.getElementById("conditions-data").textContent);
  const element = (name, attributes, ...children) => {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    made.append(...children);
    return made;
  };

  // sound: whole numbers of 16 bits, of full scale
  let context = null, playing = null;
  const samplesOf = (text) => {
    const bytes = Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0)), view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true) / 32767);
  };
  const stop = () => {
    if (!playing) return;
    const { source, gain } = playing;
    gain.gain.setTargetAtTime(0, context.currentTime, FADE / 3);
    source.stop(context.currentTime + FADE);
    playing = null;
  };
  const play = (text) => {
    context ??= new AudioContext();
    context.resume();
    const samples = samplesOf(text), buffer = context.createBuffer(1, samples.length, known.rate);
    buffer.copyToChannel(samples, 0);
    const source = new AudioBufferSourceNode(context, { buffer, loop: true });
    const gain = new GainNode(context, { gain: 1 });
    source.connect(gain).connect(context.destination);
    source.start();
    playing = { source, gain };
  };

  // the row of the chosen condition
  const row = element("div", { class: "condition-row", "aria-live": "polite" });
  let chosen = null;
  const tell = (k, isHeard) => {
    const cells = known.rows[k].map((text, i) => element("td", known.words.includes(i) ? {} : { class: "n" }, text));
    const heads = known.head.map((text, i) => element("th", { scope: "col", ...(known.words.includes(i) ? {} : { class: "n" }) }, text));
    const table = element("table", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, element("tr", {}, ...cells)));
    const sound = known.sounds.length ? (isHeard ? "It plays; choose it again, or press Escape, to stop." : known.sounds[k] ? "It is stopped." : "It is silent.") : "";
    row.replaceChildren(element("div", { class: "scroll" }, table), element("p", { class: "note" }, sound));
  };
  const choose = (button, k) => {
    const goesOn = !(playing && chosen === button);
    stop();
    if (goesOn && known.sounds[k]) play(known.sounds[k]);
    chosen?.setAttribute("aria-pressed", "false");
    chosen = button;
    button.setAttribute("aria-pressed", String(goesOn));
    tell(k, Boolean(playing));
  };

  // a table of buttons a load
  const panels = known.panels.map((panel) => {
    const buttons = panel.cells.map((line) => line.map((k) => {
      const button = element("button", { type: "button", tabindex: -1, "aria-pressed": "false", title: known.rows[k].join("; ") }, known.cells[k]);
      button.style.background = known.colours[k];
      button.addEventListener("click", () => choose(button, k));
      return button;
    }));
    const focus = (i, j) => {
      const next = buttons[i]?.[j];
      if (!next) return;
      buttons.flat().forEach((button) => { button.tabIndex = button === next ? 0 : -1; });
      next.focus();
    };
    const moves = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
    buttons.forEach((line, i) => line.forEach((button, j) => {
      button.addEventListener("focus", () => buttons.flat().forEach((other) => { other.tabIndex = other === button ? 0 : -1; }));
      button.addEventListener("keydown", (event) => {
        if (!(event.key in moves)) return;
        const [down, right] = moves[event.key];
        focus(i + down, j + right);
        event.preventDefault();
      });
    }));
    if (buttons[0]?.[0]) buttons[0][0].tabIndex = 0;
    // a cell, with a thick edge towards a neighbour on the other side of rattle
    const cell = (i, j) => {
      const isOther = (other) => other !== undefined && known.rattles[other] !== known.rattles[panel.cells[i][j]];
      const edges = { right: isOther(panel.cells[i][j + 1]), below: isOther(panel.cells[i + 1]?.[j]) };
      return element("td", { class: Object.keys(edges).filter((edge) => edges[edge]).join(" ") }, buttons[i][j]);
    };
    const corner = element("th", { scope: "col" }, `${known.row_title} ↓, ${known.column_title} →`);
    const heads = [corner, ...known.column_titles.map((text) => element("th", { scope: "col" }, text))];
    const lines = buttons.map((line, i) => element("tr", {}, element("th", { scope: "row" }, known.row_titles[i]), ...line.map((_, j) => cell(i, j))));
    return element("table", { class: "conditions" },
      element("caption", {}, panel.title), element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...lines));
  });
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !playing) return;
    chosen.click();
  });
  document.getElementById("conditions").replaceChildren(element("p", { class: "note" }, known.note), ...panels.map((panel) => element("div", { class: "scroll" }, panel)), row);
  document.documentElement.classList.add("scripted");
  document.getElementById("map-figure").classList.add("replaced");
})();
