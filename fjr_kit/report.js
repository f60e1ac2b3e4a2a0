"use strict";
(() => {
  const page = JSON.parse(document.getElementById("report-data").textContent);
  const root = document.documentElement;
  let level = 0;

  const css = (name) => getComputedStyle(root).getPropertyValue(name).trim();

  // Put the style sheet's value in place of every colour that is named "--variable".
  const themed = (value, key) => {
    if (typeof value === "string") return /color(scale)?$/.test(key) && value.startsWith("--") ? css(value) : value;
    if (Array.isArray(value)) {
      return typeof value[0] === "object" || key === "colorscale" ? value.map((v) => themed(v, key)) : value;
    }
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, themed(v, k)]));
  };

  const layoutOf = (plot, height) => {
    const axis = {gridcolor: "--grid", linecolor: "--muted", zeroline: false, ticks: "outside", tickcolor: "--muted",
      automargin: true, exponentformat: "power"};
    const layout = {
      height, margin: {l: 64, r: 40, t: 8, b: 44}, paper_bgcolor: "--paper", plot_bgcolor: "--paper",
      font: {family: "system-ui, sans-serif", size: 12, color: "--ink"}, hovermode: "closest",
      hoverlabel: {bgcolor: "--panel", bordercolor: "--rule", font: {color: "--ink"}},
      legend: {orientation: "h", x: 0, xanchor: "left", y: 1.01, yanchor: "bottom", bgcolor: "--paper"},
      modebar: {orientation: "v", bgcolor: "--paper", color: "--muted", activecolor: "--accent"},
    };
    for (const [key, value] of Object.entries(plot.layout)) {
      layout[key] = {...(/axis/.test(key) ? axis : layout[key]), ...value};
    }
    return themed(layout, "");
  };

  const config = {responsive: true, displaylogo: false, 
    modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]],
    toImageButtonOptions: {format: "svg", filename: "bla"}};

  const places = [...document.querySelectorAll(".plot")];
  const plotFor = (place) => page.overview[place.id] ?? page.levels[level][place.id];

  const views = new Map(); // place -> the reader's range along x, as plotly takes it

  // What a change of the view says about x: a new range, null for the whole, undefined for nothing.
  const rangeIn = (change) => {
    if (change["xaxis.autorange"]) return null;
    const [low, high] = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    return low === undefined ? undefined : [low, high];
  };

  // A zoom along frequency in one plot of the level shows the same band in the others.
  let linking = false;
  const link = (place) => place.on("plotly_relayout", (change) => {
    const range = rangeIn(change);
    if (range === undefined) return;
    if (range) views.set(place, range);
    else views.delete(place);
    if (linking || !plotFor(place)?.linked) return;
    linking = true;
    const others = places.filter((other) => other !== place && plotFor(other)?.linked);
    const view = () => (range ? {"xaxis.range": range.slice()} : {"xaxis.autorange": true});
    Promise.all(others.map((other) => Plotly.relayout(other, view()))).finally(() => { linking = false; });
  });

  const draw = (place) => {
    const plot = plotFor(place);
    place.closest("figure").hidden = !plot;
    if (!plot) return;
    const layout = layoutOf(plot, Number(place.dataset.height));
    if (views.has(place)) layout.xaxis.range = views.get(place).slice();
    const isNew = !place.on;
    Plotly.react(place, themed(plot.data, ""), layout, config);
    if (isNew) link(place);
  };
  const drawAll = () => places.forEach(draw);

  const select = (index) => {
    level = index;
    document.querySelectorAll("[data-level]").forEach((part) => {
      const own = Number(part.dataset.level) === index;
      if (part.tagName === "BUTTON") part.setAttribute("aria-pressed", String(own));
      else if (part.tagName === "TR") part.classList.toggle("chosen", own && page.levels.length > 1);
      else part.hidden = !own;
    });
    drawAll();
    if (page.levels.length > 1) history.replaceState(null, "", `#level=${index}`);
  };

  document.querySelectorAll("button[data-level]").forEach((button) =>
    button.addEventListener("click", () => select(Number(button.dataset.level))));
  const wanted = Number(/^#level=(\d+)$/.exec(location.hash)?.[1] ?? 0);
  select(wanted < page.levels.length ? wanted : 0);
  document.getElementById("all-bla")?.on?.("plotly_click", (event) => select(event.points[0].data.meta));

  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawAll());
  addEventListener("beforeprint", () => { root.classList.add("light"); drawAll(); });
  addEventListener("afterprint", () => { root.classList.remove("light"); drawAll(); });
})();
