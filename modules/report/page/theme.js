// Colours, symbols and what all charts have in common.

// Okabe and Ito's palette and relatives: distinct with any colour vision. By theme.
const PALETTE = {
  light: ["#0072b2", "#d55e00", "#009e73", "#aa4499", "#b8860b", "#56b4e9", "#555555", "#882255", "#117733", "#332288"],
  dark: ["#56a9e8", "#f0803c", "#2fc095", "#e08fcb", "#e6b422", "#a6d8fa", "#bbbbbb", "#d9728f", "#7fc97f", "#a09ae8"],
};
const DOWN = "path://M0,0 L10,0 L5,9 Z";
const STAR = "path://M5,0 L6.3,3.5 L10,3.6 L7.1,5.9 L8.1,9.5 L5,7.4 L1.9,9.5 L2.9,5.9 L0,3.6 L3.7,3.5 Z";
const PLUS = "path://M3.5,0 L6.5,0 L6.5,3.5 L10,3.5 L10,6.5 L6.5,6.5 L6.5,10 L3.5,10 L3.5,6.5 L0,6.5 L0,3.5 L3.5,3.5 Z";
const CROSS = "path://M1.5,0 L5,3.5 L8.5,0 L10,1.5 L6.5,5 L10,8.5 L8.5,10 L5,6.5 L1.5,10 L0,8.5 L3.5,5 L0,1.5 Z";
const SYMBOLS = ["circle", "rect", "triangle", "diamond", DOWN, STAR, PLUS];
const DASHES = ["solid", [6, 3], [2, 2]];
const OUTCOME_COLOURS = {
  light: { success: "#56a3d9", false_accept: "#aa2288", inaccurate: "#e69f00", rejected: "#d55e00", refused: "#1b1f24", unjudged: "#9aa4b0" },
  dark: { success: "#3f7fb5", false_accept: "#f06fc4", inaccurate: "#e6b422", rejected: "#f0803c", refused: "#ffffff", unjudged: "#6b7480" },
};
const OUTCOME_SYMBOLS = { success: "rect", false_accept: STAR, inaccurate: "diamond", rejected: "triangle", refused: CROSS, unjudged: "circle" };

const root = document.documentElement;
const systemDark = window.matchMedia("(prefers-color-scheme: dark)");
let chosenTheme = null; // by the button; else the system's
let printing = false;

const themeName = () => (printing ? "light" : chosenTheme || (systemDark.matches ? "dark" : "light"));
function applyTheme() {
  root.dataset.theme = themeName();
  document.getElementById("theme").textContent = themeName() === "dark" ? "Light" : "Dark";
}
const cssColour = (name) => getComputedStyle(root).getPropertyValue(name).trim();

const colourOf = (initializer) => PALETTE[themeName()][initializer % 10];
const symbolOf = (initializer) => SYMBOLS[initializer % SYMBOLS.length];
const dashOf = (initializer) => DASHES[Math.floor(initializer / SYMBOLS.length) % DASHES.length];
const outcomeColour = (key) => OUTCOME_COLOURS[themeName()][key];
const outcomeStyle = (key) => {
  const hollow = key === "inaccurate" || key === "unjudged";
  const colour = outcomeColour(key);
  return hollow ? { color: "transparent", borderColor: colour, borderWidth: 1.6 } : { color: colour };
};

/** A symbol of the charts as inline SVG for legends. */
function markSvg(symbol, colour, { line = null, hollow = false } = {}) {
  const shapes = {
    circle: '<circle cx="5" cy="5" r="4.6"/>',
    rect: '<rect x="0.6" y="0.6" width="8.8" height="8.8"/>',
    triangle: '<path d="M5,0 L10,9 L0,9 Z"/>',
    diamond: '<path d="M5,-0.5 L10.5,5 L5,10.5 L-0.5,5 Z"/>',
  };
  const shape = shapes[symbol] || `<path d="${symbol.replace("path://", "")}"/>`;
  const dash = Array.isArray(line) ? ` stroke-dasharray="${line.join(" ")}"` : "";
  const stroke = line ? `<line x1="-8" y1="5" x2="18" y2="5" stroke="${colour}" stroke-width="1.6"${dash}/>` : "";
  const fill = hollow ? `fill="none" stroke="${colour}" stroke-width="1.6"` : `fill="${colour}"`;
  return `<svg class="mark" viewBox="-8 -2 26 14" aria-hidden="true">${stroke}<g ${fill}>${shape}</g></svg>`;
}

const charts = new Map(); // by id of the element

/** Draws `option` in the element; the chart is made when it is first drawn. */
function draw(id, option) {
  const element = document.getElementById(id);
  let chart = charts.get(id);
  if (chart && chart.getDom() !== element) {
    chart.dispose();
    chart = null;
  }
  if (!chart) {
    chart = echarts.init(element, null, { renderer: "svg" });
    chart.on("click", (event) => {
      if (event.data && event.data.result !== undefined) selectResult(event.data.result);
    });
    charts.set(id, chart);
  }
  if (chart.getWidth() !== element.clientWidth || chart.getHeight() !== element.clientHeight) chart.resize();
  // This draws at once, which resize() does not: paper is printed before the next frame.
  chart.setOption({ ...common(), ...option }, { notMerge: true });
  return chart;
}
function forget(id) {
  if (charts.has(id)) charts.get(id).dispose();
  charts.delete(id);
}

function common() {
  return {
    animation: false,
    backgroundColor: "transparent",
    textStyle: { color: cssColour("--text"), fontFamily: getComputedStyle(document.body).fontFamily, fontSize: 12 },
    tooltip: tooltip(),
  };
}
function tooltip(more = {}) {
  return {
    trigger: "item",
    confine: true,
    transitionDuration: 0,
    backgroundColor: cssColour("--raised"),
    borderColor: cssColour("--line"),
    textStyle: { color: cssColour("--text"), fontSize: 12 },
    extraCssText: "white-space: normal; max-width: 380px; overflow-wrap: anywhere;",
    ...more,
  };
}
/** An axis in the page's colours. `name` is its title with the unit. */
function axis(name, more = {}) {
  const line = { lineStyle: { color: cssColour("--quiet") } };
  return {
    name,
    nameLocation: "middle",
    nameTextStyle: { color: cssColour("--text"), fontSize: 12 },
    axisLine: { show: true, onZero: false, ...line },
    axisTick: { show: true, ...line },
    axisLabel: { color: cssColour("--quiet"), fontSize: 11, hideOverlap: true },
    splitLine: { show: true, lineStyle: { color: cssColour("--grid") } },
    ...more,
  };
}
/** A logarithmic axis that ends at whole decades around `values`. */
function logAxis(name, values, more = {}) {
  const positive = values.filter((v) => v > 0);
  const low = positive.length ? Math.floor(Math.log10(least(positive)) + 1e-9) : -1;
  const high = positive.length ? Math.ceil(Math.log10(most(positive)) - 1e-9) : 1;
  const base = axis(name, { type: "log", min: 10 ** low, max: 10 ** Math.max(high, low + 1), ...more });
  return {
    minorTick: { show: high - low <= 5, splitNumber: 9 },
    ...base,
    axisLabel: { ...base.axisLabel, formatter: decade },
  };
}
const least = (values) => values.reduce((a, b) => Math.min(a, b), Infinity);
const most = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity);
function decade(value) {
  const exponent = Math.round(Math.log10(value));
  if (exponent >= -3 && exponent <= 4) return String(Number(value.toPrecision(2)));
  return `1e${exponent}`;
}
/** What a logarithmic axis can show: an exact zero is put at the least positive value. */
function onLogAxis(values) {
  const lowest = least(values.filter((v) => v > 0));
  return (value) => (value === null ? null : value > 0 ? value : Number.isFinite(lowest) ? lowest : 1e-12);
}
/** Text in the middle of an empty chart. */
const nothing = (text) => ({
  graphic: { type: "text", left: "center", top: "middle", style: { text, fill: cssColour("--quiet"), font: "13px sans-serif" } },
});

function markLine(lines, key, position = "end") {
  return {
    silent: true,
    symbol: "none",
    lineStyle: { color: cssColour("--quiet"), type: "dashed", width: 1 },
    label: { color: cssColour("--quiet"), fontSize: 11, position, formatter: (event) => event.name },
    data: lines.map((line) => ({ [key]: line.at, name: line.name, label: line.align && key === "xAxis" ? { align: line.align } : {} })),
  };
}

/** Ranges of x and y so that a metre is as long on both axes of a plot of width x height pixels. */
function equalScale(points, width, height) {
  const xs = points.map((p) => p[0]);
  const ys = points.map((p) => p[1]);
  const middle = [(least(xs) + most(xs)) / 2, (least(ys) + most(ys)) / 2];
  const perPixel = Math.max((most(xs) - least(xs)) / width, (most(ys) - least(ys)) / height, 1e-6) * 1.1;
  const range = (centre, pixels) => ({ min: centre - (perPixel * pixels) / 2, max: centre + (perPixel * pixels) / 2 });
  return [range(middle[0], width), range(middle[1], height)];
}
/** Axis of a top view: round labels, ends that are not round have none. */
const metreAxis = (name, range, more = {}) =>
  axis(name, {
    type: "value", ...range, ...more,
    axisLabel: { color: cssColour("--quiet"), fontSize: 11, showMinLabel: false, showMaxLabel: false, hideOverlap: true, formatter: (v) => number(v, 4) },
  });

function setPrinting(on) {
  if (printing === on) return;
  printing = on;
  document.body.classList.toggle("printing", on);
  applyTheme();
  drawAll();
}

/** Theme, printing and the size of the window. The page's last script has drawAll() and resizeCharts(). */
function setUpPage() {
  document.getElementById("theme").addEventListener("click", () => {
    chosenTheme = themeName() === "dark" ? "light" : "dark";
    applyTheme();
    drawAll();
  });
  systemDark.addEventListener("change", () => {
    applyTheme();
    drawAll();
  });
  window.addEventListener("beforeprint", () => setPrinting(true));
  window.addEventListener("afterprint", () => setPrinting(false));
  window.matchMedia("print").addEventListener("change", (event) => setPrinting(event.matches));
  let pending = 0;
  window.addEventListener("resize", () => {
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(() => {
      if (!printing) resizeCharts();
    });
  });
}
