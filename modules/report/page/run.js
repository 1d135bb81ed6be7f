// The report of one run: its flight, its states, its errors beside the predicted ones.

// Columns of data.rows: t, state, x, y, z, true x, y, z, then error and predicted error of each of data.figures.
const COLUMN = { t: 0, state: 1, x: 2, y: 3, trueX: 5, trueY: 6, figures: 8 };
const rows = data.rows;
const hasTruth = rows.some((r) => r[COLUMN.trueX] !== null);
const duration = rows.length ? rows[rows.length - 1][COLUMN.t] : 0;

function trajectoryOption(width, height) {
  const estimate = rows.map((r) => [r[COLUMN.x], r[COLUMN.y]]);
  const truth = rows.map((r) => [r[COLUMN.trueX], r[COLUMN.trueY]]);
  const points = [...estimate, ...truth.filter((p) => p[0] !== null)];
  const [x, y] = equalScale(points, width - 76, height - 82);
  const line = (name, values, colour, style) => ({
    type: "line", name, data: values, showSymbol: false, lineStyle: { color: colour, ...style }, itemStyle: { color: colour },
  });
  const series = [line("estimate", estimate, colourOf(0), { width: 1.6 })];
  if (hasTruth) series.push(line("ground truth", truth, cssColour("--text"), { width: 1.2, type: [4, 3] }));
  const start = rows.find((r) => data.initialized_at_s !== null && r[COLUMN.t] >= data.initialized_at_s);
  if (start)
    series.push({ type: "scatter", name: "initialized", data: [[start[COLUMN.x], start[COLUMN.y]]], symbol: STAR, symbolSize: 15, itemStyle: { color: colourOf(1) } });
  return {
    legend: { top: 0, textStyle: { color: cssColour("--text") }, selectedMode: false },
    grid: { left: 60, right: 16, top: 34, bottom: 48, outerBoundsMode: "none" },
    xAxis: metreAxis("x [m]", x, { nameGap: 28 }),
    yAxis: metreAxis("y [m]", y, { nameGap: 42 }),
    series,
  };
}

const timeAxis = (more = {}) =>
  axis("time since the first image [s]", {
    type: "value", min: 0, max: duration, nameGap: 26, ...more,
    axisLabel: { color: cssColour("--quiet"), fontSize: 11, hideOverlap: true, formatter: (v) => number(v, 4) },
  });

/** The state as a line over time, its events as marks. */
function statesOption() {
  const at = (event) => ({
    value: [event.t, data.states.indexOf(event.state)], event,
    symbol: event.remark ? "circle" : "diamond", symbolSize: event.remark ? 8 : 11,
    itemStyle: { color: event.remark ? colourOf(4) : colourOf(1) },
  });
  return {
    grid: { left: 110, right: 16, top: 24, bottom: 46 },
    xAxis: timeAxis(),
    yAxis: axis("", { type: "category", data: data.states.map((s) => s.replace("_", " ")) }),
    tooltip: tooltip({
      formatter: ({ data: d }) =>
        d && d.event ? `<b>${number(d.event.t, 5)} s: ${esc(d.event.state.replace("_", " "))}</b><br>${esc(d.event.reason)}` : "",
    }),
    series: [
      { type: "line", step: "end", showSymbol: false, silent: true, data: rows.map((r) => [r[COLUMN.t], r[COLUMN.state]]), lineStyle: { color: colourOf(0), width: 2 } },
      { type: "scatter", data: data.events.map(at), z: 5 },
    ],
  };
}

/** Stretches of time in any state but inertial, as ECharts' areas. */
function notInertial() {
  const inertial = data.states.indexOf("inertial");
  const areas = [];
  let from = null;
  rows.forEach((r) => {
    if (r[COLUMN.state] === inertial) {
      if (from !== null) areas.push([{ xAxis: from }, { xAxis: r[COLUMN.t] }]);
      from = null;
    } else if (from === null) {
      from = r[COLUMN.t];
    }
  });
  if (from !== null) areas.push([{ xAxis: from }, { xAxis: duration }]);
  return areas;
}

function errorOption(figure, k, areas) {
  const values = (column) => rows.map((r) => [r[COLUMN.t], r[column] === null ? null : r[column] * figure.factor]);
  const error = COLUMN.figures + 2 * k;
  const line = (name, column, style) => ({
    type: "line", name, data: values(column), showSymbol: false, connectNulls: false,
    lineStyle: { width: 1.4, ...style }, itemStyle: { color: style.color },
  });
  const series = [line("predicted", error + 1, { color: colourOf(1), type: [5, 3] })];
  if (rows.some((r) => r[error] !== null)) series.unshift(line("error", error, { color: colourOf(0) }));
  series[0].markArea = { silent: true, itemStyle: { color: cssColour("--grid") }, data: areas };
  return {
    legend: { top: 0, right: 0, textStyle: { color: cssColour("--text") }, selectedMode: false },
    grid: { left: 64, right: 16, top: 28, bottom: 46 },
    xAxis: timeAxis(),
    yAxis: axis(`${figure.name} [${figure.unit}]`, { type: "value", min: 0, nameGap: 44 }),
    tooltip: tooltip({ trigger: "axis", valueFormatter: (v) => number(v) }),
    series,
  };
}

function drawAll() {
  const plot = document.getElementById("trajectory");
  draw("trajectory", trajectoryOption(plot.clientWidth, plot.clientHeight));
  draw("states", statesOption());
  const areas = notInertial();
  data.figures.forEach((figure, k) => draw(`error-${figure.key}`, errorOption(figure, k, areas)));
}
function resizeCharts() {
  for (const chart of charts.values()) chart.resize();
  drawAll();
}

applyTheme();
setUpPage();
if (rows.length) {
  document.getElementById("charts").hidden = false;
  document.getElementById("truth-note").textContent = hasTruth
    ? "Seen from above: aligned with ground truth in yaw and position." : "No ground truth.";
  document.getElementById("errors").innerHTML = data.figures
    .map((figure) => `<figure><div class="plot small" id="error-${figure.key}"></div></figure>`).join("");
  drawAll();
}
window.etalonReport = { data, charts };
