// The selected window: its reason, its errors, both of its trajectories.

const panel = document.getElementById("panel");

function selectResult(index) {
  state.result = index;
  const opened = panel.hidden;
  showPanel();
  if (opened) resizeCharts();
  markSelection();
  markSelectedFailure();
}
function closePanel() {
  if (panel.hidden) return;
  state.result = null;
  panel.hidden = true;
  document.body.classList.remove("with-panel");
  forget("window-trajectory");
  forget("window-height");
  resizeCharts();
  markSelection();
  markSelectedFailure();
}

function showPanel() {
  if (state.result === null) return;
  const result = results[state.result];
  const focused = panel.contains(document.activeElement);
  forget("window-trajectory");
  forget("window-height");
  panel.hidden = false;
  document.body.classList.add("with-panel");
  panel.innerHTML = panelHtml(result);
  for (const button of panel.querySelectorAll("button[data-step]"))
    button.addEventListener("click", () => {
      const [along, across] = button.dataset.step.split(" ").map(Number);
      stepResult(result, along, across);
    });
  panel.querySelector(".close").addEventListener("click", closePanel);
  for (const row of panel.querySelectorAll("tr[data-result]")) row.addEventListener("click", () => selectResult(Number(row.dataset.result)));
  drawTrajectories(result);
  if (focused) panel.focus();
}

function panelHtml(result) {
  const outcome = outcomeNamed.get(outcomeOf(result, STAGES.length - 1));
  const failed = ["false_accept", "inaccurate", "rejected", "refused"].includes(outcome.key);
  const reason = reasonOf(result, STAGES.length - 1);
  return `<button type="button" class="close" title="Close (Esc)">Close</button>
<p class="where">${esc(initializerName(result.initializer))}<br>${esc(sequenceName(result.sequence))}, window ${result.window}</p>
<p class="note">from ${number(result.start, 5)} s, ${esc(shapeName(data.shapes[result.shape]))}</p>
<div class="steps"><button type="button" data-step="-1 0" title="Previous window (left arrow)">← previous</button>
<button type="button" data-step="1 0" title="Next window (right arrow)">next →</button></div>
<div class="reason${failed ? " failed" : ""}" id="window-reason"><b>${esc(outcome.name)}</b> <span class="note">(${esc(outcome.text)})</span><br>status ${esc(result.status)}${reason ? `: ${esc(reason)}` : ""}</div>
<h3>Trajectories</h3>
<p class="note">${result.frame[1] ? "Keyframes, aligned with ground truth in yaw and position" : "No ground truth: keyframes, aligned in yaw and position with the last stage"}</p>
<div class="plot" id="window-trajectory"></div><div class="plot" id="window-height"></div>
<h3>Errors</h3>${errorTable(result)}
<h3>Milliseconds</h3>${timingTable(result)}
${noiseTable(result)}${othersTable(result)}`;
}

function errorTable(result) {
  const rows = metrics
    .map((m, k) => ({ m, values: STAGES.map((name, stage) => errorOf(result, stage, k)) }))
    .filter(({ values }) => values.some((v) => v !== null));
  if (!rows.length) return `<p class="note">${result.stages.some(Boolean) ? "No ground truth." : "No estimate."}</p>`;
  const head = STAGES.map((name) => `<th class="number">${name}</th>`).join("");
  const body = rows.map(({ m, values }) => `<tr><td>${esc(m.title)}</td>${values.map((v) => `<td class="number">${number(v)}</td>`).join("")}</tr>`);
  return `<table class="etalon"><thead><tr><th></th>${head}</tr></thead><tbody>${body.join("")}</tbody></table>`;
}
function timingTable(result) {
  if (!result.timings.length) return '<p class="note">None.</p>';
  const body = result.timings.map((t) => `<tr><td>${esc(t.name)}</td><td class="number">${number(t.ms)}</td></tr>`);
  return `<table class="etalon"><tbody>${body.join("")}</tbody></table>`;
}
function noiseTable(result) {
  if (!result.noise) return "";
  const body = result.noise.map(
    ([chi2, dof], k) => `<tr><td>${NOISE_GROUPS[k]}</td><td class="number">${number(dof > 0 ? chi2 / dof : null)}</td><td class="number">${number(dof)}</td></tr>`,
  );
  return `<h3>Residuals after VI-BA</h3><table class="etalon"><thead><tr><th></th><th class="number">chi-square per degree of freedom</th><th class="number">degrees</th></tr></thead><tbody>${body.join("")}</tbody></table>`;
}
/** All initializers at the same window. */
function othersTable(result) {
  if (initializers.length < 2) return "";
  const rows = initializers
    .map((i) => resultAt(result.sequence, result.shape, result.window, i))
    .filter(Boolean)
    .map((other) => {
      const key = outcomeOf(other, state.stage);
      const mark = markSvg(OUTCOME_SYMBOLS[key], outcomeColour(key), { hollow: key === "inaccurate" || key === "unjudged" });
      return `<tr class="choice${other === result ? " selected" : ""}" data-result="${other.index}"><td>${esc(initializerName(other.initializer))}</td><td>${mark} ${esc(outcomeNamed.get(key).name)}</td><td class="number">${number(errorOf(other, state.stage, state.metric))}</td></tr>`;
    });
  return `<h3>All initializers here (${STAGES[state.stage]})</h3><table class="etalon"><thead><tr><th>initializer</th><th>outcome</th><th class="number">${esc(metrics[state.metric].title)}</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
}

/** Flat x, y, z as points in metres; those that are missing are null. */
function pointsOf(flat) {
  if (!flat) return [];
  const points = [];
  for (let k = 0; k + 2 < flat.length; k += 3)
    points.push(flat[k] === null ? null : [0, 1, 2].map((d) => flat[k + d] * data.position_unit_m));
  return points;
}

function drawTrajectories(result) {
  const [stamps, truth] = result.frame;
  const lines = [
    { name: "ground truth", points: pointsOf(truth), colour: cssColour("--text"), symbol: "circle", size: 4, dash: [4, 3] },
    { name: "init", points: result.stages[0] ? pointsOf(result.stages[0][1]) : [], colour: PALETTE[themeName()][1], symbol: "triangle", size: 8, dash: "solid" },
    { name: "vi_ba", points: result.stages[1] ? pointsOf(result.stages[1][1]) : [], colour: PALETTE[themeName()][0], symbol: "rect", size: 6, dash: "solid" },
  ].filter((line) => line.points.some(Boolean));
  const all = lines.flatMap((line) => line.points.filter(Boolean));
  const trajectory = document.getElementById("window-trajectory");
  const height = document.getElementById("window-height");
  if (!all.length) {
    trajectory.replaceChildren();
    trajectory.style.display = height.style.display = "none";
    return;
  }
  const box = { left: 64, right: 12, top: 30, bottom: 42 };
  const [x, y] = equalScale(all, trajectory.clientWidth - box.left - box.right, trajectory.clientHeight - box.top - box.bottom);
  const series = (valueOf) =>
    lines.map((line) => ({
      type: "line", name: line.name, symbol: line.symbol, symbolSize: line.size, showAllSymbol: true,
      data: line.points.map((p, k) => (p ? valueOf(p, k) : [null, null])),
      lineStyle: { color: line.colour, width: 1.4, type: line.dash }, itemStyle: { color: line.colour },
    }));
  const where = (event) => {
    const line = lines[event.seriesIndex];
    const p = line.points[event.dataIndex];
    const text = `${line.name}, keyframe ${event.dataIndex} (${number(stamps[event.dataIndex])} s)<br>x ${number(p[0], 4)}, y ${number(p[1], 4)}, z ${number(p[2], 4)} m`;
    const other = lines[0].points[event.dataIndex];
    if (lines[0].name !== "ground truth" || event.seriesIndex === 0 || !other) return text;
    return `${text}<br>${number(1000 * Math.hypot(p[0] - other[0], p[1] - other[1], p[2] - other[2]))} mm from ground truth`;
  };
  draw("window-trajectory", {
    legend: { top: 0, textStyle: { color: cssColour("--text") }, selectedMode: false },
    grid: { ...box, outerBoundsMode: "none" },
    xAxis: metreAxis("x [m]", x, { nameGap: 24 }),
    yAxis: metreAxis("y [m]", y, { nameGap: 48 }),
    tooltip: tooltip({ formatter: where }),
    series: series((p) => [p[0], p[1]]),
  });
  draw("window-height", {
    grid: { left: 64, right: 12, top: 10, bottom: 42, outerBoundsMode: "none" },
    xAxis: axis("time in the window [s]", { type: "value", nameGap: 24, max: most(stamps.length ? stamps : [1]) }),
    yAxis: axis("z [m]", { type: "value", scale: true, nameGap: 48, splitNumber: 3, axisLabel: { color: cssColour("--quiet"), fontSize: 11, formatter: (v) => number(v) } }),
    tooltip: tooltip({ formatter: where }),
    series: series((p, k) => [stamps[k], p[2]]),
  });
}

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") closePanel();
});
panel.addEventListener("keydown", (event) => {
  if (state.result !== null) stepByKey(event, results[state.result].sequence);
});
