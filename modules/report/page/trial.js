// The report of a trial: ATE by fault, errors after the start, trajectories of one part of a recording.

// A run: part, variant, fault, status, causal ATE, reason, event, [[t, x, y, error], ...] or null.
const runs = data.runs.map(([part, variant, fault, status, ate, reason, event, path]) => ({ part, variant, fault, status, ate, reason, event, path }));
const partName = (p) => `${data.parts[p].recording} from ${number(data.parts[p].from_s, 4)} s`;
const isGood = (run) => ["survived", "not judged", "fault not met"].includes(run.status);

const selected = { part: 0, fault: 0 };

function legend() {
  return { top: 0, textStyle: { color: cssColour("--text") }, data: data.variants };
}

function faultsOption() {
  const known = runs.map((r) => r.ate).filter((v) => v !== null);
  if (!known.length) return nothing("no run has an ATE");
  const shown = onLogAxis(known);
  const spread = (v) => (data.variants.length > 1 ? (v / (data.variants.length - 1) - 0.5) * 0.6 : 0);
  return {
    legend: legend(),
    grid: { left: 70, right: 16, top: 34, bottom: 90 },
    xAxis: axis("", {
      type: "value", min: -0.5, max: data.faults.length - 0.5, interval: 1, splitLine: { show: false },
      axisTick: { show: false }, axisLabel: { show: false }, splitNumber: data.faults.length,
    }),
    yAxis: logAxis("ATE [m]", known, { nameGap: 48 }),
    tooltip: tooltip({
      formatter: ({ data: d }) => {
        if (!d || d.run === undefined) return "";
        const run = runs[d.run];
        return `<b>${esc(partName(run.part))}</b>, ${esc(data.variants[run.variant])}, ${esc(data.faults[run.fault])}<br>ATE ${number(run.ate)} m` +
          (run.reason ? `<br>${esc(run.status)}: ${esc(run.reason)}` : "") + (run.event ? `<br>reported: ${esc(run.event)}` : "");
      },
    }),
    series: [
      ...data.variants.map((name, v) => ({
        type: "scatter", name, itemStyle: { color: colourOf(v) },
        data: runs.map((run, i) => ({ run, i })).filter(({ run }) => run.variant === v && run.ate !== null).map(({ run, i }) => ({
          value: [run.fault + spread(v), shown(run.ate)], run: i,
          symbol: isGood(run) ? symbolOf(v) : CROSS, symbolSize: isGood(run) ? 6 : 12,
        })),
      })),
      {
        type: "scatter", silent: true, symbolSize: 0,
        data: data.faults.map((name, f) => ({ value: [f, 10 ** Math.floor(Math.log10(least(known.filter((v) => v > 0))))], name })),
        label: { show: true, position: "bottom", rotate: 35, align: "right", distance: 8, color: cssColour("--text"), fontSize: 11, formatter: (e) => e.name },
      },
    ],
  };
}

function afterStartOption() {
  const times = data.after_start.times.map((t) => (t > 0 ? `${t} s` : "end"));
  return {
    legend: legend(),
    grid: { left: 70, right: 16, top: 34, bottom: 46 },
    xAxis: axis("since the start", { type: "category", data: times, nameGap: 26 }),
    yAxis: axis("ATE [m]", { type: "value", min: 0, nameGap: 48 }),
    tooltip: tooltip({ trigger: "axis", valueFormatter: (v) => number(v) }),
    series: data.variants.map((name, v) => ({
      type: "line", name, data: data.after_start.ate_m[v], symbol: symbolOf(v), symbolSize: 7,
      lineStyle: { color: colourOf(v), type: dashOf(v) }, itemStyle: { color: colourOf(v) },
    })),
  };
}

const shownRuns = () => runs.filter((r) => r.part === selected.part && r.fault === selected.fault && r.path);

function trajectoriesOption(width, height) {
  const truth = data.parts[selected.part].truth || [];
  const points = [...truth, ...shownRuns().flatMap((r) => r.path.map((p) => [p[1], p[2]]))];
  if (!points.length) return nothing("no trajectory is at hand");
  const [x, y] = equalScale(points, width - 76, height - 82);
  const line = (name, values, colour, style) => ({
    type: "line", name, data: values, showSymbol: false, lineStyle: { color: colour, ...style }, itemStyle: { color: colour },
  });
  return {
    legend: { top: 0, textStyle: { color: cssColour("--text") } },
    grid: { left: 60, right: 16, top: 34, bottom: 48, outerBoundsMode: "none" },
    xAxis: metreAxis("x [m]", x, { nameGap: 28 }),
    yAxis: metreAxis("y [m]", y, { nameGap: 42 }),
    series: [
      ...(truth.length ? [line("ground truth", truth, cssColour("--text"), { width: 1.2, type: [4, 3] })] : []),
      ...shownRuns().map((r) => line(data.variants[r.variant], r.path.map((p) => [p[1], p[2]]), colourOf(r.variant), { width: 1.6 })),
    ],
  };
}

function errorsOption() {
  if (!shownRuns().some((r) => r.path.some((p) => p[3] !== null))) return nothing("no errors are known");
  return {
    legend: { top: 0, textStyle: { color: cssColour("--text") } },
    grid: { left: 64, right: 16, top: 34, bottom: 46 },
    xAxis: axis("time since the first image [s]", { type: "value", nameGap: 26 }),
    yAxis: axis("", { type: "value", min: 0 }),
    tooltip: tooltip({ trigger: "axis", valueFormatter: (v) => number(v) }),
    series: shownRuns().map((r) => ({
      type: "line", name: data.variants[r.variant], showSymbol: false, data: r.path.map((p) => [p[0], p[3]]),
      lineStyle: { width: 1.4, color: colourOf(r.variant) }, itemStyle: { color: colourOf(r.variant) },
    })),
  };
}

function drawFlight() {
  const plot = document.getElementById("trajectories");
  draw("trajectories", trajectoriesOption(plot.clientWidth, plot.clientHeight));
  draw("errors", errorsOption());
  document.getElementById("flight-note").textContent = runs
    .filter((r) => r.part === selected.part && r.fault === selected.fault && !isGood(r))
    .map((r) => `${data.variants[r.variant]}: ${r.reason}.`).join(" ");
}
function drawAll() {
  draw("faults", faultsOption());
  draw("after-start", afterStartOption());
  drawFlight();
}
function resizeCharts() {
  for (const chart of charts.values()) chart.resize();
  drawAll();
}
function choose(id, key, names) {
  const select = document.getElementById(id);
  select.innerHTML = names.map((name, i) => `<option value="${i}">${esc(name)}</option>`).join("");
  select.addEventListener("change", () => {
    selected[key] = Number(select.value);
    drawFlight();
  });
}

applyTheme();
setUpPage();
choose("part", "part", data.parts.map((_, p) => partName(p)));
choose("fault", "fault", data.faults);
drawAll();
window.etalonReport = { data, charts };
