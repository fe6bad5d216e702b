"use strict";
(() => {
  const root = document.documentElement;
  root.classList.add("scripted");
  const config = {
    responsive: true, displaylogo: false, showTips: false, plotlyServerURL: "",
    // A closed list: no button of plotly's own may send the data anywhere.
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
  };

  const draw = (figure) => {
    if (figure.dataset.state) return;
    figure.dataset.state = "drawing";
    const key = figure.dataset.key;
    const { data, layout } = JSON.parse(document.getElementById(key + "-data").textContent);
    const live = document.getElementById(key + "-live");
    figure.classList.add("drawn");
    Plotly.newPlot(live, data, layout, { ...config, toImageButtonOptions: { filename: key, scale: 2 } })
      .then(() => document.dispatchEvent(new CustomEvent("figure-drawn", { detail: { key, live } })))
      .catch(() => figure.classList.remove("drawn"));
  };

  const inView = new IntersectionObserver((entries) => {
    for (const entry of entries) if (entry.isIntersecting) draw(entry.target);
  }, { rootMargin: "400px" });
  const figures = [...document.querySelectorAll("figure[data-key]")];
  figures.forEach((figure) => {
    if (figure.classList.contains("later")) figure.classList.add("hidden");
    inView.observe(figure);
  });

  for (const list of document.querySelectorAll(".tabs")) {
    const tabs = [...list.querySelectorAll("[role=tab]")];
    const choose = (chosen) => {
      for (const tab of tabs) {
        const figure = document.getElementById(tab.getAttribute("aria-controls"));
        const on = tab === chosen;
        tab.setAttribute("aria-selected", String(on));
        tab.tabIndex = on ? 0 : -1;
        figure.classList.toggle("hidden", !on);
        if (on) draw(figure);
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
