// Controls and legend; draws everything.

const metricIndex = (key) => metrics.findIndex((m) => m.key === key);
const metricHasData = (k) => results.some((s) => STAGES.some((name, stage) => errorOf(s, stage, k) !== null));

function fillSelect(id, entries, value, changed) {
  const select = document.getElementById(id);
  select.innerHTML = entries.map(([v, text]) => `<option value="${v}">${esc(text)}</option>`).join("");
  select.value = String(value);
  select.parentElement.classList.add("shown");
  const note = () => {
    select.parentElement.dataset.value = select.selectedOptions.length ? select.selectedOptions[0].textContent : "";
  };
  note();
  select.addEventListener("change", () => {
    changed(Number(select.value));
    note();
    drawAll();
  });
}

function setUpControls() {
  const shown = metrics.map((m, k) => k).filter(metricHasData);
  const preferred = ["velocity_mps", "gravity_deg", "ate_m"].map(metricIndex).find((k) => shown.includes(k));
  state.metric = preferred ?? shown[0] ?? 0;
  state.stage = STAGES.length - 1;
  state.shape = Math.max(0, data.shapes.findIndex((w) => w[0] === 10 && w[1] === 4)); // that of the papers
  fillSelect("metric", (shown.length ? shown : [0]).map((k) => [k, metrics[k].title]), state.metric, (v) => { state.metric = v; });
  fillSelect("stage", STAGES.map((name, k) => [k, STAGE_NAMES[name]]), state.stage, (v) => { state.stage = v; });
  fillSelect("shape", data.shapes.map((w, k) => [k, shapeName(w)]), state.shape, (v) => {
    state.shape = v;
    if (state.result === null) return;
    const result = results[state.result];
    const same = resultAt(result.sequence, v, result.window, result.initializer);
    if (same) state.result = same.index;
    else closePanel();
  });
  fillSelect("sequence", [[-1, "all"], ...data.sequence_names.map((name, s) => [s, name])], -1, (v) => { state.sequence = v; });
  fillSelect("time", TIMES.map((t, k) => [k, t.name]), 0, (v) => { state.time = v; });
}

function drawLegend() {
  const legend = document.getElementById("legend");
  legend.replaceChildren(
    ...initializers.map((i) => {
      const button = document.createElement("button");
      button.type = "button";
      button.title = "Click: hide or show. Double-click: this one alone, or all";
      button.setAttribute("aria-pressed", String(!state.hidden.has(i)));
      button.innerHTML = `${markSvg(symbolOf(i), colourOf(i), { line: dashOf(i) })}${esc(initializerName(i))}`;
      button.addEventListener("click", (event) => {
        if (event.detail >= 2) showAlone(i);
        else if (!state.hidden.delete(i)) state.hidden.add(i);
        drawAll();
        legend.children[i].focus();
      });
      return button;
    }),
  );
  document.getElementById("outcomes").innerHTML = OUTCOMES.map(
    ({ key, name, text }) => `<span title="${esc(text)}">${markSvg(OUTCOME_SYMBOLS[key], outcomeColour(key), { hollow: key === "inaccurate" || key === "unjudged" })} ${name}</span>`,
  ).join("");
}
/** The second click of a double click: the first has hidden or shown it already. */
let alone = null;
function showAlone(i) {
  state.hidden.clear();
  if (alone !== i) initializers.filter((j) => j !== i).forEach((j) => state.hidden.add(j));
  alone = alone === i ? null : i;
}

function drawMetrics() {
  const holder = document.getElementById("metric-plots");
  if (!document.getElementById("all-metrics").open) return;
  if (!holder.children.length)
    holder.innerHTML = metrics.map((m, k) => (metricHasData(k) ? `<figure><figcaption>${esc(m.name)}</figcaption><div class="plot small" id="metric-${k}"></div></figure>` : "")).join("");
  metrics.forEach((m, k) => {
    if (metricHasData(k)) draw(`metric-${k}`, cdfOption(k, true));
  });
}

function drawAll() {
  drawLegend();
  layTimelines();
  for (const sequence of shownSequences()) drawTimeline(sequence);
  draw("cdf", cdfOption(state.metric, false));
  draw("box", boxOption(state.metric));
  draw("success", successOption());
  draw("runtime", runtimeOption());
  drawMetrics();
  drawStatusCounts();
  drawFailures();
  showPanel();
}
function resizeCharts() {
  for (const chart of charts.values()) chart.resize();
}

/** Long names of columns may break at their underscores. */
function breakColumnNames() {
  for (const cell of document.querySelectorAll("table.etalon thead th.number"))
    cell.innerHTML = esc(cell.textContent).replaceAll("_", "_<wbr>");
}

applyTheme();
setUpPage();
document.getElementById("all-metrics").addEventListener("toggle", drawMetrics);
breakColumnNames();
if (results.length) {
  document.getElementById("charts").hidden = false;
  setUpControls();
  setUpFailures();
  drawAll();
}
window.etalonReport = { data, results, charts, state, selectResult };
