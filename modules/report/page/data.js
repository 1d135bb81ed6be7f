// The page's data, unpacked from what src/report_data.cpp packs.

const STAGES = data.vi_ba ? ["init", "vi_ba"] : ["init"];
const STAGE_NAMES = { init: "initializer alone (init)", vi_ba: "after VI-BA (vi_ba)" };
const NOISE_GROUPS = ["gyro", "accelerometer", "vision"];
const metrics = data.metrics;

const results = data.results.map((s, index) => ({
  index,
  sequence: s[0],
  shape: s[1],
  window: s[2],
  start: s[3],
  initializer: s[4],
  status: data.statuses[s[5]],
  reason: data.reasons[s[6]],
  frame: data.frames[s[7]],
  judged: s[8], // by stage: 1, 0, or null where it cannot be judged
  timings: s[9].map(([name, ms]) => ({ name: data.timings[name], ms })),
  stages: s[10], // by stage: null, or [errors by metric, positions]
  noise: s[11],
  // Of an accepted estimate of the last stage; null where it cannot be judged.
  outsideClaim: s[12] === null ? null : data.reasons[s[12]],
}));

/** Results by "sequence shape window initializer", to step from one to its neighbours. */
const resultIndex = new Map(results.map((s) => [`${s.sequence} ${s.shape} ${s.window} ${s.initializer}`, s]));
const resultAt = (sequence, shape, window, initializer) =>
  resultIndex.get(`${sequence} ${shape} ${window} ${initializer}`);

const shapeSeconds = (w) => (w[1] ? (w[0] - 1) / w[1] : null);
function shapeName(w) {
  if (!w[1]) return `${w[0]} keyframes`;
  return `${w[0]} keyframes at ${number(w[1])} Hz (${number(shapeSeconds(w))} s)`;
}

/** In the metric's printed unit; null where there is none. */
function errorOf(result, stage, metric) {
  const reached = result.stages[stage];
  const value = reached ? reached[0][metric] : null;
  return value === null ? null : value * metrics[metric].factor;
}

const millisecondsOf = (result, name) => {
  const timing = result.timings.find((t) => t.name === name);
  return timing && timing.ms !== null ? timing.ms : null;
};

// What became of a window in a stage. The order is that of the legend. Only the last stage is accepted or not.
const OUTCOMES = [
  { key: "success", name: "success", text: "accepted, and within the criterion of success" },
  { key: "false_accept", name: "false accept", text: "accepted, but outside the criterion of success or of what its own covariance claims" },
  { key: "inaccurate", name: "inaccurate", text: "an estimate outside the criterion of success" },
  { key: "rejected", name: "not accepted", text: "an estimate that was not accepted" },
  { key: "refused", name: "no estimate", text: "refused or failed without an estimate" },
  { key: "unjudged", name: "not judged", text: "an estimate that ground truth cannot judge" },
];
const outcomeNamed = new Map(OUTCOMES.map((o) => [o.key, o]));
function outcomeOf(result, stage) {
  if (!result.stages[stage]) return "refused";
  if (STAGES[stage] === "vi_ba" && result.status !== "success") return "rejected";
  if (result.judged[stage] === null) return "unjudged";
  const good = result.judged[stage] === 1;
  const accepted = stage === STAGES.length - 1 && result.status === "success";
  if (accepted && (!good || result.outsideClaim)) return "false_accept";
  return good ? "success" : "inaccurate";
}

function quantile(sorted, q) {
  const place = q * (sorted.length - 1);
  const low = Math.floor(place);
  const high = Math.min(low + 1, sorted.length - 1);
  return sorted[low] + (place - low) * (sorted[high] - sorted[low]);
}

/** Wilson's 95 % interval of a share, in percent. */
function wilson(successes, count) {
  const z = 1.96;
  const p = successes / count;
  const middle = p + (z * z) / (2 * count);
  const half = z * Math.sqrt((p * (1 - p)) / count + (z * z) / (4 * count * count));
  const scale = 100 / (1 + (z * z) / count);
  return [Math.max(0, scale * (middle - half)), Math.min(100, scale * (middle + half))];
}
