// needs: host, figure, motions
// A page of a result: figures become interactive as they come into view, tabs choose one, print opens what is folded.
"use strict";
(() => {
  const root = document.documentElement;
  root.classList.add("scripted");
  const dataOf = (key) => JSON.parse(document.getElementById(`${key}-data`).textContent);
  const models = new Map([...document.querySelectorAll("figure[data-key]")].map((drawing) => {
    const { key } = drawing.dataset, el = document.getElementById(`${key}-live`);
    return [key, host.innerModel(null, { chart: null, chosen: null, cursor: null, marked: null, el })];
  }));

  const draw = (drawing) => {
    if (drawing.dataset.state) return;
    drawing.dataset.state = "drawing";
    const { key } = drawing.dataset, model = models.get(key);
    model.set("chart", { ...dataOf(key), caption: "" }); // it stands above
    drawing.classList.add("drawn");
    try {
      figure.render({ model, el: model.get("el") });
    } catch (error) {
      drawing.classList.remove("drawn"); // the static figure stays
      throw error;
    }
  };

  const branches = document.getElementById("motion-at-point");
  if (branches) {
    const known = dataOf("motion-at-point");
    motions.follow(null, known, [...models].filter(([key]) => key in known.levels), branches);
  }

  const MARGIN = 400; // pixels above and below the window
  const inView = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) draw(entry.target);
  }, { rootMargin: `${MARGIN}px` });
  for (const drawing of document.querySelectorAll("figure[data-key]")) {
    if (drawing.classList.contains("later")) drawing.classList.add("hidden");
    else if (drawing.getBoundingClientRect().top < innerHeight + MARGIN) draw(drawing); // before the first frame
    inView.observe(drawing);
  }

  for (const list of document.querySelectorAll(".tabs")) {
    const tabs = [...list.querySelectorAll("[role=tab]")];
    const choose = (chosen) => {
      for (const tab of tabs) {
        const drawing = document.getElementById(tab.getAttribute("aria-controls"));
        const on = tab === chosen;
        tab.setAttribute("aria-selected", String(on));
        tab.tabIndex = on ? 0 : -1;
        drawing.classList.toggle("hidden", !on);
        if (on) draw(drawing);
      }
    };
    tabs.forEach((tab, index) => {
      tab.tabIndex = index === 0 ? 0 : -1;
      tab.addEventListener("click", () => choose(tab));
      tab.addEventListener("keydown", (event) => {
        const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
        if (!step) return;
        const next = tabs[(index + step + tabs.length) % tabs.length];
        choose(next);
        next.focus();
      });
    });
  }

  const opened = [];
  addEventListener("beforeprint", () => {
    for (const details of document.querySelectorAll("details:not([open])")) {
      details.open = true;
      opened.push(details);
    }
  });
  addEventListener("afterprint", () => {
    for (const details of opened.splice(0)) details.open = false;
  });
})();
