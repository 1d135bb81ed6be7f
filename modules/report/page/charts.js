// Distributions, success against window length, run time against error.

/** What the controls show; main.js changes it and draws again. */
const state = { metric: 0, stage: 0, shape: 0, sequence: -1, hidden: new Set(), result: null, time: 0 };

const initializers = data.initializer_names.map((name, index) => index);
const shownInitializers = () => initializers.filter((i) => !state.hidden.has(i));
const initializerName = (i) => data.initializer_names[i];
const sequenceName = (s) => data.sequence_names[s];

/** Windows that the controls select, of the initializers that are shown. */
function selected(shape = state.shape) {
  return results.filter(
    (s) =>
      s.shape === shape && (state.sequence < 0 || s.sequence === state.sequence) && !state.hidden.has(s.initializer),
  );
}
function byInitializer(list) {
  const groups = new Map(shownInitializers().map((i) => [i, []]));
  for (const result of list) groups.get(result.initializer).push(result);
  return groups;
}

/** First lines of every tooltip about a window. */
function resultText(result) {
  const outcome = outcomeNamed.get(outcomeOf(result, state.stage));
  let text = `<b>${esc(initializerName(result.initializer))}</b>, ${esc(sequenceName(result.sequence))}, window ${result.window}`;
  text += `, ${number(result.start, 5)} s<br>${esc(outcome.name)}`;
  if (result.status !== "success") text += `: ${esc(result.status)}`;
  if (result.reason) text += `<br>${esc(result.reason)}`;
  const value = errorOf(result, state.stage, state.metric);
  if (value !== null) text += `<br>${esc(metrics[state.metric].title)}: ${number(value)}`;
  return text;
}
const resultTooltip = (event) => (event.data && event.data.result !== undefined ? resultText(results[event.data.result]) : "");

/** The criterion of success and, for one sequence, the least that gyro integration can have; their texts on the side with more room
 * among `values`. */
function limitLines(metric, values) {
  const positive = values.filter((v) => v > 0);
  const middle = Math.sqrt(least(positive) * most(positive));
  const lines = [];
  const m = metrics[metric];
  if (m.limit !== null) lines.push({ at: m.limit * m.factor, name: "criterion" });
  if (m.key === "rre_deg" && state.sequence >= 0 && data.sequences[state.sequence]) {
    const bound = data.sequences[state.sequence].bound_rre_deg[state.shape] ?? null;
    if (bound !== null) lines.push({ at: bound * m.factor, name: "gyro alone, lower bound (median)" });
  }
  return lines.map((line) => ({ ...line, align: line.at > middle ? "right" : "left" }));
}
/** Sorted errors, and the windows behind a cumulative curve: refused ones count, as never reached. */
function distribution(list, metric) {
  const values = [];
  let refused = 0;
  for (const result of list) {
    const value = errorOf(result, state.stage, metric);
    if (value !== null) values.push(value);
    else if (!result.stages[state.stage] && result.judged[state.stage] !== null) refused += 1;
  }
  values.sort((a, b) => a - b);
  return { values, count: values.length + refused };
}

function cdfOption(metric, small) {
  const groups = [...byInitializer(selected())].map(([i, list]) => ({ i, ...distribution(list, metric) }));
  const all = groups.flatMap((g) => g.values);
  if (!all.length) return nothing("no errors: no estimate, or no ground truth");
  const place = onLogAxis(all);
  const series = groups.flatMap(({ i, values, count }) => {
    const points = values.map((v, k) => [place(v), (100 * (k + 1)) / count]);
    const marks = [0.1, 0.3, 0.5, 0.7, 0.9].map((q) => points[Math.floor(q * points.length)]).filter(Boolean);
    const colour = colourOf(i);
    const name = initializerName(i);
    return [
      {
        type: "line", name, data: points, step: "end", showSymbol: false, triggerLineEvent: false,
        lineStyle: { color: colour, width: 1.6, type: dashOf(i) }, itemStyle: { color: colour },
        emphasis: { disabled: true },
      },
      {
        type: "scatter", name, data: marks, symbol: symbolOf(i), symbolSize: small ? 5 : 8, silent: true,
        itemStyle: { color: colour }, tooltip: { show: false },
      },
    ];
  });
  if (series.length) series[0].markLine = markLine(limitLines(metric, all), "xAxis");
  return {
    grid: { left: 56, right: 16, top: 24, bottom: 46 },
    xAxis: logAxis(metrics[metric].title, all, { nameGap: 26 }),
    yAxis: axis(small ? "" : "share of all [%]", { type: "value", min: 0, max: 100, nameGap: 34 }),
    tooltip: tooltip({
      trigger: "axis",
      axisPointer: { type: "line", snap: false, lineStyle: { color: cssColour("--quiet") }, label: { show: false } },
      formatter: (events) => {
        const at = Number(events[0].axisValue);
        const rows = groups.map(({ i, values, count }) => {
          const reached = values.filter((v) => place(v) <= at).length;
          return `${markSvg(symbolOf(i), colourOf(i))} ${esc(initializerName(i))}: ${number((100 * reached) / count)} % (${reached} of ${count})`;
        });
        return `${esc(metrics[metric].title)} at most ${number(at)}<br>${rows.join("<br>")}`;
      },
    }),
    series,
  };
}

function boxOption(metric) {
  const groups = [...byInitializer(selected())].map(([i, list]) => ({ i, list, ...distribution(list, metric) }));
  const all = groups.flatMap((g) => g.values);
  if (!all.length) return nothing("no errors: no estimate, or no ground truth");
  const place = onLogAxis(all);
  const boxes = [];
  const points = [];
  groups.forEach(({ i, list, values }, row) => {
    if (!values.length) return boxes.push({ value: [] });
    const box = [0.05, 0.25, 0.5, 0.75, 0.95].map((q) => quantile(values, q));
    const colour = colourOf(i);
    boxes.push({
      value: box.map(place),
      itemStyle: { color: `${colour}33`, borderColor: colour, borderWidth: 1.6 },
      box, count: values.length, initializer: i,
    });
    for (const result of list) {
      const value = errorOf(result, state.stage, metric);
      if (value === null || (value >= box[0] && value <= box[4])) continue;
      points.push({ value: [place(value), row], result: result.index, symbol: symbolOf(i), itemStyle: { color: colour } });
    }
    return boxes.length;
  });
  return {
    grid: { left: 12, right: 16, top: 24, bottom: 46, outerBoundsMode: "same", outerBoundsContain: "axisLabel" },
    xAxis: logAxis(metrics[metric].title, all, { nameGap: 26 }),
    yAxis: axis("", {
      type: "category", inverse: true, data: groups.map((g) => `${initializerName(g.i)}\nn = ${g.values.length}`),
      splitLine: { show: false }, axisLabel: { color: cssColour("--text"), fontSize: 11, width: 130, overflow: "truncate", lineHeight: 13, interval: 0 },
    }),
    tooltip: tooltip({
      formatter: (event) => {
        if (event.seriesType !== "boxplot" || !event.data.box) return resultTooltip(event);
        const names = ["5 %", "25 %", "median", "75 %", "95 %"];
        const rows = event.data.box.map((v, k) => `${names[k]}: ${number(v)}`).reverse();
        return `<b>${esc(initializerName(event.data.initializer))}</b>, ${event.data.count} estimates<br>${esc(metrics[metric].title)}<br>${rows.join("<br>")}`;
      },
    }),
    series: [
      { type: "boxplot", data: boxes, boxWidth: [6, 22], markLine: markLine(limitLines(metric, all), "xAxis", "start") },
      { type: "scatter", data: points, symbolSize: 4.5 },
    ],
  };
}

function successOption() {
  const shapes = data.shapes.map((w, index) => ({ w, index })).sort((a, b) => shapeSeconds(a.w) - shapeSeconds(b.w) || a.w[0] - b.w[0]);
  const counts = new Map(shownInitializers().map((i) => [i, shapes.map(() => ({ good: 0, judged: 0 }))]));
  const rank = new Map(shapes.map((entry, k) => [entry.index, k]));
  for (const result of results) {
    const judged = result.judged[state.stage];
    if (judged === null || !counts.has(result.initializer) || (state.sequence >= 0 && result.sequence !== state.sequence)) continue;
    const count = counts.get(result.initializer)[rank.get(result.shape)];
    count.judged += 1;
    count.good += judged;
  }
  const rows = [...counts].filter(([, list]) => list.some((c) => c.judged));
  if (!rows.length) return nothing("no ground truth: success cannot be judged");
  return {
    grid: { left: 56, right: 20, top: 24, bottom: 60 },
    xAxis: axis("length of the window", {
      type: "category", nameGap: 40, splitLine: { show: false }, boundaryGap: true,
      axisLabel: { color: cssColour("--quiet"), fontSize: 11, lineHeight: 14, interval: 0 },
      data: shapes.map(({ w }) => (w[1] ? `${number(shapeSeconds(w))} s\n${w[0]} at ${number(w[1])} Hz` : `${w[0]} keyframes`)),
    }),
    yAxis: axis("success [%]", { type: "value", min: 0, max: 100, nameGap: 34 }),
    tooltip: tooltip({
      formatter: (event) => {
        const { i, good, judged } = event.data;
        const [low, high] = wilson(good, judged);
        return `<b>${esc(initializerName(i))}</b><br>${shapeName(shapes[event.dataIndex].w)}<br>${number((100 * good) / judged)} % (${good} of ${judged})<br>95 % interval: ${number(low)} to ${number(high)} %`;
      },
    }),
    series: rows.map(([i, list]) => ({
      type: "line", name: initializerName(i), symbol: symbolOf(i), symbolSize: 9,
      lineStyle: { color: colourOf(i), width: 1.6, type: dashOf(i) }, itemStyle: { color: colourOf(i) },
      data: list.map((c) => (c.judged ? { value: (100 * c.good) / c.judged, i, ...c } : { value: null })),
    })),
  };
}

// What counts as run time. Parts that were not reached count nothing.
const TIMES = [
  { name: "initializer alone", parts: ["initialize"] },
  { name: "with stereo odometry", parts: ["stereo_odometry", "initialize"] },
  { name: "with stereo odometry and VI-BA", parts: ["stereo_odometry", "initialize", "vi_ba"] },
];
function timeOf(result) {
  if (millisecondsOf(result, "initialize") === null) return null;
  return TIMES[state.time].parts.reduce((sum, part) => sum + (millisecondsOf(result, part) || 0), 0);
}
function runtimeOption() {
  const series = [];
  const groups = [...byInitializer(selected())].map(([i, list]) => ({
    i,
    points: list
      .map((result) => ({ result, ms: timeOf(result), error: errorOf(result, state.stage, state.metric) }))
      .filter((p) => p.ms !== null && p.error !== null),
  }));
  const times = groups.flatMap((g) => g.points.map((p) => p.ms));
  const errors = groups.flatMap((g) => g.points.map((p) => p.error));
  if (!times.length) return nothing("no errors: no estimate, or no ground truth");
  const placeTime = onLogAxis(times);
  const placeError = onLogAxis(errors);
  const medianOf = (values) => quantile([...values].sort((a, b) => a - b), 0.5);
  for (const { i, points } of groups) {
    if (!points.length) continue;
    series.push({
      type: "scatter", name: initializerName(i), symbol: symbolOf(i), symbolSize: 4.5,
      itemStyle: { color: colourOf(i), opacity: 0.45 },
      data: points.map((p) => ({ value: [placeTime(p.ms), placeError(p.error)], result: p.result.index })),
    });
    const ms = medianOf(points.map((p) => p.ms));
    const error = medianOf(points.map((p) => p.error));
    series.push({
      type: "scatter", name: initializerName(i), symbol: symbolOf(i), symbolSize: 15, z: 5,
      itemStyle: { color: colourOf(i), borderColor: cssColour("--page"), borderWidth: 1.5 },
      data: [{ value: [placeTime(ms), placeError(error)], median: { i, ms, error, count: points.length } }],
    });
  }
  return {
    grid: { left: 64, right: 16, top: 14, bottom: 46 },
    xAxis: logAxis(`${TIMES[state.time].name} [ms]`, times, { nameGap: 26 }),
    yAxis: logAxis(metrics[state.metric].title, errors, { nameGap: 44 }),
    tooltip: tooltip({
      formatter: (event) => {
        if (!event.data.median) return `${resultTooltip(event)}<br>${number(timeOf(results[event.data.result]))} ms`;
        const { i, ms, error, count } = event.data.median;
        return `<b>${esc(initializerName(i))}</b>, medians of ${count} estimates<br>${number(ms)} ms<br>${esc(metrics[state.metric].title)}: ${number(error)}`;
      },
    }),
    series,
  };
}
