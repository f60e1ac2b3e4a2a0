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

  const NARROW = {width: 450, height: 1.2}; // below this width (px) legends need lines of their own
  const PRINTED = {width: 640, height: 0.8}; // px, which A4 and letter hold within their margins; of the height
  const places = [...document.querySelectorAll(".plot")];
  const plotFor = (place) => page.overview[place.id] ?? page.levels[level][place.id];

  const views = new Map(); // place -> the reader's range along x, as plotly takes it; plots without frequency
  let band = null; // the reader's band in Hz, of all plots over frequency; null for the whole
  let unit = "Hz";
  let scale = null; // "log" or "linear"; null for what each plot is
  let printing = false;

  const factor = () => (unit === "Hz" ? 1 : 2 * Math.PI);
  const isLog = (axis) => (scale === null ? axis.type === "log" : scale === "log");
  const inUnit = (text) => text?.replaceAll(" Hz<", ` ${unit}<`);
  const scaled = (values) => values.map((v) => (v === null ? null : v * factor()));

  // The lowest and the highest frequency of a plot (Hz), zero left out.
  const bandOf = (plot) => plot.data.flatMap((trace) => trace.x).filter((f) => f > 0)
    .reduce(([low, high], f) => [Math.min(low, f), Math.max(high, f)], [Infinity, 0]);

  // The axis of a plot over frequency, which is made in Hz, by the switches and the reader's band.
  const frequencyAxis = (plot) => {
    const {type, dtick, tickformat, range, ...axis} = plot.layout.xaxis;
    const log = isLog({type});
    const shown = band ?? (log && range ? range.map((v) => 10 ** v) : null);
    const change = {title: {text: unit === "Hz" ? "frequency (Hz)" : "angular frequency (rad/s)"}};
    if (log) {
      const [low, high] = shown ?? bandOf(plot);
      Object.assign(change, {type: "log", tickformat: "~g"});
      if (high > 3 * low) change.dtick = high > 100 * low ? 1 : "D2";
    }
    if (shown) change.range = scaled(shown).map((v) => (log ? Math.log10(v) : v));
    return {...axis, ...change};
  };

  // A trace in the complex plane, of the band only; a corner of a disc is a point with its frequency.
  const inBand = (trace) => {
    if (!trace.customdata) return trace;
    const kept = trace.customdata.map((f, i) => i).filter((i) =>
      trace.customdata[i] === null || !band || (trace.customdata[i] >= band[0] && trace.customdata[i] <= band[1]));
    const pick = (values) => kept.map((i) => values[i]);
    return {...trace, x: pick(trace.x), y: pick(trace.y), customdata: scaled(pick(trace.customdata)),
      hovertemplate: inUnit(trace.hovertemplate)};
  };

  const inView = (plot) => {
    if (plot.plane) return {...plot, data: plot.data.map(inBand)};
    if (!plot.linked) return plot;
    const data = plot.data.map((trace) => ({...trace, x: scaled(trace.x), hovertemplate: inUnit(trace.hovertemplate)}));
    return {...plot, data, layout: {...plot.layout, xaxis: frequencyAxis(plot)}};
  };

  // What a change of the view says about x: a new range, null for the whole, undefined for nothing.
  const rangeIn = (change) => {
    if (change["xaxis.autorange"]) return null;
    const [low, high] = change["xaxis.range"] ?? [change["xaxis.range[0]"], change["xaxis.range[1]"]];
    return low === undefined ? undefined : [low, high];
  };

  // A zoom along frequency in one plot shows the same band in all others of the page.
  let linking = false;
  const link = (place) => place.on("plotly_relayout", (change) => {
    const range = rangeIn(change);
    if (range === undefined || linking) return;
    const plot = plotFor(place);
    if (!plot?.linked) {
      if (range) views.set(place, range);
      else views.delete(place);
      return;
    }
    const hertz = (v) => (isLog(plot.layout.xaxis) ? 10 ** v : v) / factor();
    show(range && range.map(hertz));
  });

  const show = (wanted) => {
    band = wanted;
    linking = true;
    const followers = places.filter((place) => plotFor(place)?.linked);
    places.filter((place) => plotFor(place)?.plane).forEach((place) => {
      views.delete(place);
      draw(place);
    });
    Promise.all(followers.map((place) => {
      const {range, dtick} = frequencyAxis(plotFor(place));
      const axis = range ? {"xaxis.range": range} : {"xaxis.autorange": true};
      return Plotly.relayout(place, {...axis, "xaxis.dtick": dtick ?? null});
    })).finally(() => { linking = false; });
  };

  // What a plot's place is high; plotly fills it, also when it takes a new width.
  const heightOf = (place) => {
    const higher = place.clientWidth < NARROW.width ? NARROW.height : 1;
    return Math.round(Number(place.dataset.height) * (printing ? PRINTED.height : higher));
  };

  const draw = (place) => {
    const plot = plotFor(place);
    place.closest("figure").hidden = !plot;
    if (!plot) return;
    const {data, layout: given, linked} = inView(plot);
    const height = heightOf(place);
    place.style.height = `${height}px`;
    const layout = layoutOf({layout: given}, height);
    if (printing) layout.width = PRINTED.width;
    if (views.has(place) && !linked) layout.xaxis.range = views.get(place).slice();
    const isNew = !place.on;
    Plotly.react(place, themed(data, ""), layout, config);
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
    press();
    if (page.levels.length > 1) history.replaceState(null, "", `#level=${index}`);
  };

  document.querySelectorAll("button[data-level]").forEach((button) =>
    button.addEventListener("click", () => select(Number(button.dataset.level))));

  // Switches of the frequency axis; the plots' own scale is marked, if all share it, until one is chosen.
  const press = () => {
    const plots = places.map(plotFor).filter((plot) => plot?.linked);
    document.querySelectorAll(".switches button").forEach((button) => {
      const {unit: own, scale: kind} = button.dataset;
      if (own) button.setAttribute("aria-pressed", String(own === unit));
      if (kind) {
        button.setAttribute("aria-pressed", String(plots.every((plot) => isLog(plot.layout.xaxis) === (kind === "log"))));
      }
    });
  };
  document.querySelectorAll(".switches button").forEach((button) => button.addEventListener("click", () => {
    if ("whole" in button.dataset) {
      show(null);
      return;
    }
    unit = button.dataset.unit ?? unit;
    scale = button.dataset.scale ?? scale;
    drawAll();
    press();
  }));

  const wanted = Number(/^#level=(\d+)$/.exec(location.hash)?.[1] ?? 0);
  select(wanted < page.levels.length ? wanted : 0);
  document.querySelectorAll("[id^=all-]").forEach((place) =>
    place.on?.("plotly_click", (event) => {
      const {meta} = event.points[0].data;
      if (meta !== undefined) select(meta);
    }));

  const print = (on) => {
    if (printing === on) return;
    printing = on;
    root.classList.toggle("light", on);
    drawAll();
    if (!on) places.filter((place) => place.on).forEach((place) => Plotly.Plots.resize(place));
  };
  addEventListener("resize", () =>
    places.filter((place) => place.on && place.clientWidth && place.style.height !== `${heightOf(place)}px`).forEach(draw));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => drawAll());
  matchMedia("print").addEventListener("change", (event) => print(event.matches));
  addEventListener("beforeprint", () => print(true));
  addEventListener("afterprint", () => print(false));
})();
