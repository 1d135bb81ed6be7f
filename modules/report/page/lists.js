// Windows that failed, and the counts of why.

const FAILURES_AT_ONCE = 200;
let failuresShown = FAILURES_AT_ONCE;

/** Statuses by initializer, of the selected shape and sequence. */
function drawStatusCounts() {
  const list = selected();
  const statuses = [...new Set(list.map((s) => s.status))].sort((a, b) => (b === "success") - (a === "success") || a.localeCompare(b));
  const head = statuses.map((status) => `<th scope="col" class="number">${esc(status)}</th>`).join("");
  const rows = [...byInitializer(list)].map(([i, own]) => {
    const cells = statuses.map((status) => own.filter((s) => s.status === status).length || "–");
    return `<tr><td>${esc(initializerName(i))}</td>${cells.map((n) => `<td class="number">${n}</td>`).join("")}<td class="number">${own.length}</td></tr>`;
  });
  document.getElementById("status-counts").innerHTML =
    `<table class="etalon"><thead><tr><th scope="col">status, number of windows</th>${head}<th scope="col" class="number">all</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
}

function failures() {
  const wanted = document.getElementById("failure-outcome").value;
  const initializer = document.getElementById("failure-initializer").value;
  const text = document.getElementById("failure-text").value.trim().toLowerCase();
  return selected().filter((s) => {
    const outcome = outcomeOf(s, state.stage);
    if (outcome === "success" || outcome === "unjudged") return false;
    if (wanted && outcome !== wanted) return false;
    if (initializer !== "" && s.initializer !== Number(initializer)) return false;
    return !text || `${s.status} ${s.reason} ${sequenceName(s.sequence)}`.toLowerCase().includes(text);
  });
}

/** Why it failed, in words: an accepted estimate that is wrong has no reason of its own. */
function reasonOf(result, stage) {
  if (result.reason) return result.reason;
  const parts = metrics
    .map((m, k) => ({ m, value: errorOf(result, stage, k) }))
    .filter(({ m, value }) => m.limit !== null && value !== null && value >= m.limit * m.factor)
    .map(({ m, value }) => `${m.title}: ${number(value)} is not below the limit of ${number(m.limit * m.factor)}`);
  if (stage === STAGES.length - 1 && result.outsideClaim) parts.push(`outside of what its covariance claims: ${result.outsideClaim}`);
  return parts.join("; ");
}

function drawFailures() {
  const list = failures();
  const shown = list.slice(0, failuresShown);
  document.getElementById("failures").innerHTML = shown
    .map((s) => {
      const cells = [esc(sequenceName(s.sequence)), s.window, number(s.start, 5), esc(initializerName(s.initializer)),
        esc(outcomeNamed.get(outcomeOf(s, state.stage)).name), esc(s.status), esc(reasonOf(s, state.stage))];
      return `<tr data-result="${s.index}">${cells.map((c, k) => `<td${k === 1 || k === 2 ? ' class="number"' : ""}>${c}</td>`).join("")}</tr>`;
    })
    .join("");
  document.getElementById("failure-count").textContent = `${list.length} of ${selected().length} windows${shown.length < list.length ? `, the first ${shown.length} shown` : ""}`;
  document.getElementById("failure-more").hidden = shown.length === list.length;
  markSelectedFailure();
}
function markSelectedFailure() {
  for (const row of document.querySelectorAll("#failures tr")) row.classList.toggle("selected", Number(row.dataset.result) === state.result);
}

function setUpFailures() {
  const options = (entries) => entries.map(([value, text]) => `<option value="${esc(value)}">${esc(text)}</option>`).join("");
  document.getElementById("failure-outcome").innerHTML = options([["", "all"], ...OUTCOMES.filter((o) => !["success", "unjudged"].includes(o.key)).map((o) => [o.key, o.name])]);
  document.getElementById("failure-initializer").innerHTML = options([["", "all"], ...initializers.map((i) => [String(i), initializerName(i)])]);
  for (const id of ["failure-outcome", "failure-initializer", "failure-text"])
    document.getElementById(id).addEventListener("input", () => {
      failuresShown = FAILURES_AT_ONCE;
      drawFailures();
    });
  document.getElementById("failure-more").addEventListener("click", () => {
    failuresShown += 1000;
    drawFailures();
  });
  document.getElementById("failures").addEventListener("click", (event) => {
    const row = event.target.closest("tr[data-result]");
    if (row) selectResult(Number(row.dataset.result));
  });
}
