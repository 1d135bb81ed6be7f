// Errors along each sequence, and the lanes that tell what became of every window.

const timelineId = (sequence) => `timeline-${sequence}`;
const LANE = 17; // px

function shownSequences() {
  const used = new Set(results.map((s) => s.sequence));
  return data.sequence_names.map((name, s) => s).filter((s) => used.has(s) && (state.sequence < 0 || s === state.sequence));
}

/** The figures of the sequences on show; their charts are drawn by drawTimeline(). */
function layTimelines() {
  const holder = document.getElementById("timelines");
  const wanted = shownSequences().map(timelineId).join(" ");
  if (holder.dataset.of === wanted) return;
  holder.dataset.of = wanted;
  for (const id of [...charts.keys()].filter((key) => key.startsWith("timeline-"))) forget(id);
  holder.replaceChildren(
    ...shownSequences().map((sequence) => {
      const figure = document.createElement("figure");
      figure.className = "timeline";
      figure.innerHTML = `<figcaption></figcaption><div class="plot" id="${timelineId(sequence)}" tabindex="0" role="application"></div>`;
      const plot = figure.lastChild;
      plot.setAttribute("aria-label", `windows of ${sequenceName(sequence)}; arrow keys select`);
      plot.addEventListener("keydown", (event) => stepByKey(event, sequence));
      return figure;
    }),
  );
}

function drawTimeline(sequence) {
  const id = timelineId(sequence);
  const list = results.filter((s) => s.shape === state.shape && s.sequence === sequence && !state.hidden.has(s.initializer));
  const lanes = shownInitializers();
  const plot = document.getElementById(id);
  const upper = printing ? 120 : 170;
  plot.style.height = `${14 + upper + 26 + LANE * Math.max(1, lanes.length) + 44}px`;
  const judged = list.filter((s) => s.judged[state.stage] !== null);
  const good = judged.filter((s) => s.judged[state.stage] === 1).length;
  const count = (outcome) => list.filter((s) => outcomeOf(s, state.stage) === outcome).length;
  plot.previousSibling.innerHTML = `<b>${esc(sequenceName(sequence))}</b>: ${good} successes of ${judged.length} judged, ${count("false_accept")} false accepts, ${count("refused")} without an estimate`;
  draw(id, timelineOption(sequence, list, lanes, upper));
}

function timelineOption(sequence, list, lanes, upper) {
  const metric = metrics[state.metric];
  const lane = new Map(lanes.map((i, row) => [i, row]));
  const errors = list.map((s) => errorOf(s, state.stage, state.metric)).filter((v) => v !== null);
  const place = onLogAxis(errors);
  const ends = list.map((s) => s.start);
  const seconds = shapeSeconds(data.shapes[state.shape]) || 0;
  const margin = Math.max(0.5, 0.012 * (most(ends) - least(ends)));
  const time = list.length ? { min: Math.min(0, least(ends)) - margin, max: most(ends) + margin } : { min: 0, max: 1 };
  const ticks = { axisLabel: { color: cssColour("--quiet"), fontSize: 11, showMinLabel: false, showMaxLabel: false, formatter: (v) => number(v, 5) } };
  const width = document.getElementById(timelineId(sequence)).clientWidth;
  const left = width < 600 ? 100 : 150;
  const columns = new Set(list.map((s) => s.window)).size;
  const size = Math.max(3, Math.min(7.5, (0.85 * (width - left)) / Math.max(1, columns)));
  const series = [];
  for (const [i, own] of byInitializer(list)) {
    const colour = colourOf(i);
    // Later ones are smaller, so that equal errors do not hide each other.
    series.push({
      type: "line", name: initializerName(i), symbol: symbolOf(i), symbolSize: Math.max(3.5, size * (0.95 - 0.06 * i)), showAllSymbol: true, connectNulls: false,
      lineStyle: { color: colour, width: 1, type: dashOf(i), opacity: 0.7 }, itemStyle: { color: colour },
      emphasis: { focus: "series", lineStyle: { width: 2 } },
      data: own.map((s) => ({ value: [s.start, place(errorOf(s, state.stage, state.metric))], result: s.index })),
    });
  }
  for (const { key } of OUTCOMES) {
    series.push({
      type: "scatter", name: key, xAxisIndex: 1, yAxisIndex: 1, symbol: OUTCOME_SYMBOLS[key], symbolSize: key === "refused" ? 1.2 * size : size,
      itemStyle: outcomeStyle(key),
      data: list.filter((s) => outcomeOf(s, state.stage) === key).map((s) => ({ value: [s.start, lane.get(s.initializer)], result: s.index })),
    });
  }
  series.push(selectionSeries(sequence));
  if (series[0] && errors.length)
    series[0].markLine = markLine(limitLines(state.metric, errors), "yAxis", "insideEndTop");
  return {
    grid: [
      { left, right: 16, top: 14, height: upper, outerBoundsMode: "none" },
      { left, right: 16, top: 14 + upper + 26, height: LANE * Math.max(1, lanes.length), outerBoundsMode: "none" },
    ],
    xAxis: [
      axis("", { type: "value", gridIndex: 0, ...time, ...ticks, axisLabel: { show: false } }),
      axis(width < 600 ? "start [s]" : `start of the window since the first image [s]${seconds ? `; it lasts ${number(seconds)} s` : ""}`, { type: "value", gridIndex: 1, nameGap: 26, ...time, ...ticks }),
    ],
    yAxis: [
      logAxis(metric.title, errors, { gridIndex: 0, nameGap: 46 }),
      axis("", {
        type: "category", gridIndex: 1, inverse: true, data: lanes.map(initializerName), splitLine: { show: true, interval: 0, lineStyle: { color: cssColour("--grid") } },
        axisTick: { show: false }, axisLabel: { color: cssColour("--text"), fontSize: 11, width: left - 14, overflow: "truncate", interval: 0 },
      }),
    ],
    axisPointer: { link: [{ xAxisIndex: "all" }] },
    tooltip: tooltip({ formatter: resultTooltip }),
    graphic: errors.length ? [] : [{ type: "text", left: "center", top: 14 + upper / 2, style: { text: "no errors: no estimate, or no ground truth", fill: cssColour("--quiet"), font: "13px sans-serif" } }],
    series,
  };
}

/** A ring around the selected window's mark in its lane and its error. */
function selectionSeries(sequence) {
  const result = state.result === null ? null : results[state.result];
  const row = result ? shownInitializers().indexOf(result.initializer) : -1;
  const here = result && result.sequence === sequence && result.shape === state.shape && row >= 0;
  return {
    id: "selection", type: "scatter", xAxisIndex: 1, yAxisIndex: 1, symbol: "circle", symbolSize: 15, silent: true, z: 10, tooltip: { show: false },
    itemStyle: { color: "transparent", borderColor: cssColour("--text"), borderWidth: 1.5 },
    data: here ? [[result.start, row]] : [],
    markLine: { ...markLine(here ? [{ at: result.start, name: "" }] : [], "xAxis"), lineStyle: { color: cssColour("--text"), type: "solid", width: 1, opacity: 0.5 } },
  };
}
function markSelection() {
  for (const sequence of shownSequences()) {
    const chart = charts.get(timelineId(sequence));
    if (chart) chart.setOption({ series: [selectionSeries(sequence)] });
  }
}

/** Arrow keys in a timeline or the panel. `sequence` is where to begin if nothing is selected. */
function stepByKey(event, sequence) {
  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const step = steps[event.key];
  if (!step || event.altKey || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  const from = state.result === null ? null : results[state.result];
  if (!from || from.shape !== state.shape || from.sequence !== sequence) {
    const first = results.find((s) => s.sequence === sequence && s.shape === state.shape && !state.hidden.has(s.initializer));
    if (first) selectResult(first.index);
    return;
  }
  stepResult(from, step[0], step[1]);
}
function stepResult(from, along, across) {
  const lanes = shownInitializers();
  const row = lanes.indexOf(from.initializer);
  const initializer = across ? lanes[row + across] : from.initializer;
  if (initializer === undefined) return;
  const lane = results.filter((s) => s.sequence === from.sequence && s.shape === from.shape && s.initializer === initializer);
  const next = across
    ? lane.find((s) => s.window === from.window)
    : lane[lane.findIndex((s) => s.window === from.window) + along];
  if (next) selectResult(next.index);
}
