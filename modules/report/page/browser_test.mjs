// Opens the reports in headless Chromium: browser_test.mjs CHROMIUM FOLDER
// FOLDER holds benchmark.html, run.html and trial.html (tests/write_report_examples.cpp); screenshots and a PDF go there, too.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [executablePath, folder] = process.argv.slice(2);
const profile = mkdtempSync(join(tmpdir(), "etalon-report-"));
const args = [
  "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
];
const messages = [];

/** A page that collects whatever it complains about, and every request but its own file. */
async function open(context, name, size) {
  const page = await context.newPage();
  await page.setViewportSize(size);
  const url = pathToFileURL(join(folder, name)).href;
  page.on("console", (message) => messages.push(`${name}: console ${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => messages.push(`${name}: ${error.stack}`));
  page.on("requestfailed", (request) => messages.push(`${name}: failed: ${request.url()}`));
  page.on("request", (request) => {
    const asked = request.url();
    if (asked !== url && !asked.startsWith("data:")) messages.push(`${name}: asked for ${asked}`);
  });
  await page.goto(url, { waitUntil: "load" });
  return page;
}

/** Number of drawn shapes of every chart that is on the page. */
const shapes = (page) =>
  page.evaluate(() =>
    Object.fromEntries(
      [...window.etalonReport.charts].map(([id]) => [id, document.getElementById(id).querySelectorAll("svg path").length]),
    ),
  );

// Charts in a <details> are drawn when its toggle event arrives, which is some time after the click.
async function expectCharts(page, ids) {
  await page.waitForFunction((names) => names.every((id) => window.etalonReport.charts.has(id)), ids, { timeout: 5000 });
  const drawn = await shapes(page);
  for (const id of ids) assert.ok(drawn[id] > 10, `chart ${id} has ${drawn[id]} shapes`);
}

/** Clicks the mark of a window in the lane of its initializer, with the mouse. */
// Charts that come into view may still move what lies below them: then the click goes astray and is repeated.
async function clickResult(page, index) {
  for (let attempt = 0; attempt < 10; ++attempt) {
    await clickWhereResultIs(page, index);
    const chosen = await page
      .waitForFunction((i) => window.etalonReport.state.result === i, index, { timeout: 3000 })
      .then(() => true, () => false);
    if (chosen) return;
  }
  assert.fail(`a click on result ${index} does not choose it`);
}

async function clickWhereResultIs(page, index) {
  const place = await page.evaluate((resultNumber) => {
    const { charts, results } = window.etalonReport;
    const result = results[resultNumber];
    const id = `timeline-${result.sequence}`;
    const chart = charts.get(id);
    chart.getDom().scrollIntoView({ block: "center" });
    const lane = [...new Set(results.map((s) => s.initializer))].indexOf(result.initializer);
    const [x, y] = chart.convertToPixel({ xAxisIndex: 1, yAxisIndex: 1 }, [result.start, lane]);
    const box = chart.getDom().getBoundingClientRect();
    return { x: box.x + x, y: box.y + y };
  }, index);
  await page.mouse.click(place.x, place.y);
}

const shot = (page, name, more = {}) => page.screenshot({ path: join(folder, `${name}.png`), ...more });

async function testBenchmark(context) {
  const page = await open(context, "benchmark.html", { width: 1280, height: 900 });
  await expectCharts(page, ["timeline-0", "timeline-5", "cdf", "box", "success", "runtime"]);
  assert.ok((await page.locator("table.etalon tbody tr").count()) > 20, "tables");
  await shot(page, "light", { fullPage: true });

  // A refused window is on its lane; a click tells why.
  const refused = await page.evaluate(() => {
    const { results, state } = window.etalonReport;
    return results.find((s) => s.shape === state.shape && s.window > 4 && s.stages[0] === null).index;
  });
  await clickResult(page, refused);
  const reason = await page.evaluate((i) => window.etalonReport.results[i].reason, refused);
  assert.ok(reason.length > 10);
  assert.ok((await page.locator("#window-reason").innerText()).includes(reason), "the panel tells the reason");

  // One with an estimate shows both trajectories and the truth.
  const estimated = await page.evaluate(() => {
    const { results, state } = window.etalonReport;
    return results.find((s) => s.shape === state.shape && s.window > 4 && s.stages[1] && s.status === "success").index;
  });
  await clickResult(page, estimated);
  assert.equal(await page.evaluate(() => window.etalonReport.state.result), estimated);
  const names = await page.evaluate(() => window.etalonReport.charts.get("window-trajectory").getOption().series.map((s) => s.name));
  assert.deepEqual(names, ["ground truth", "init", "vi_ba"]);
  await expectCharts(page, ["window-trajectory", "window-height"]);
  await shot(page, "panel");

  // An accepted window that its own covariance does not allow is a false accept, and says of what.
  const falseAccept = await page.evaluate(() => {
    const { results, state } = window.etalonReport;
    return results.find((s) => s.shape === state.shape && s.window > 4 && s.judged[1] === 1 && s.outsideClaim).index;
  });
  await clickResult(page, falseAccept);
  const told = await page.locator("#window-reason").innerText();
  assert.ok(told.includes("false accept"), told);
  assert.match(told, /outside of what its covariance claims: (tilt|velocity)/);
  await shot(page, "false-accept");
  await clickResult(page, estimated);

  // Arrow keys go on from there.
  const timeline = await page.evaluate((i) => `timeline-${window.etalonReport.results[i].sequence}`, estimated);
  await page.locator(`#${timeline}`).focus();
  await page.keyboard.press("ArrowRight");
  const [before, after] = await page.evaluate(
    (i) => [window.etalonReport.results[i].window, window.etalonReport.results[window.etalonReport.state.result].window], estimated);
  assert.equal(after, before + 1);

  // Dark, with another selection of everything.
  const colour = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  const light = await colour();
  await page.click("#theme");
  assert.notEqual(await colour(), light);
  for (const select of ["sequence", "metric", "stage", "shape", "time"]) {
    const options = await page.locator(`#${select} option`).evaluateAll((list) => list.map((o) => o.value));
    for (const value of options) await page.selectOption(`#${select}`, value);
    await page.selectOption(`#${select}`, options[select === "sequence" ? 2 : 0]);
  }
  await expectCharts(page, ["timeline-1", "cdf", "box", "success", "runtime"]);
  await page.click("#all-metrics summary");
  await expectCharts(page, ["metric-0", "metric-3"]);
  await shot(page, "dark", { fullPage: true });
  await page.keyboard.press("Escape");
  assert.ok(await page.locator("#panel").isHidden());

  // A legend's button hides, the list of failures filters.
  await page.locator("#legend button").first().click();
  assert.equal(await page.locator("#legend button[aria-pressed=false]").count(), 1);
  await page.locator("#legend button").first().click();
  const rows = await page.locator("#failures tr").count();
  assert.ok(rows > 0);
  await page.fill("#failure-text", "too_little_motion");
  const texts = await page.locator("#failures tr").allInnerTexts();
  assert.ok(texts.length > 0 && texts.length < rows && texts.every((t) => t.includes("too_little_motion")));
  await page.fill("#failure-text", "");
  await page.selectOption("#sequence", "-1");

  // Paper is light, whatever the screen is, and its charts have their new size before the browser goes on.
  const cut = await page.evaluate(() => {
    window.dispatchEvent(new Event("beforeprint"));
    const wide = [];
    for (const [id, chart] of window.etalonReport.charts) {
      const right = chart.getDom().getBoundingClientRect().right;
      for (const shape of chart.getDom().querySelectorAll("svg path, svg text"))
        if (shape.getBoundingClientRect().right > right + 1) wide.push(id);
    }
    window.dispatchEvent(new Event("afterprint"));
    return [...new Set(wide)];
  });
  assert.deepEqual(cut, [], "charts that are cut on paper");
  await page.pdf({ path: join(folder, "print.pdf"), format: "A4" });
  await page.emulateMedia({ media: "print" });
  // The page hears of it some time after the browser has changed.
  await page.waitForFunction((expected) => getComputedStyle(document.body).backgroundColor === expected, light, { timeout: 5000 });
  assert.ok(await page.locator("#theme").isHidden());
  await page.setViewportSize({ width: 720, height: 1000 });
  await shot(page, "print", { fullPage: true });
  await page.close();
}

async function testNarrow(context) {
  const page = await open(context, "benchmark.html", { width: 420, height: 800 });
  await expectCharts(page, ["timeline-0", "cdf"]);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(wide <= 0, `${wide} px wider than the window`);
  await shot(page, "narrow", { fullPage: true });
  await page.evaluate(() => window.etalonReport.selectResult(300));
  await shot(page, "narrow-panel");
  await page.close();
}

async function testRun(context) {
  const page = await open(context, "run.html", { width: 1280, height: 900 });
  await expectCharts(page, ["trajectory", "states", "error-position", "error-tilt", "error-velocity"]);
  const text = await page.locator("main").innerText();
  for (const expected of ["no image <came>", "still inertial", "front end", "Errors and what was predicted"])
    assert.ok(text.includes(expected), `the run's report lacks "${expected}"`);
  await shot(page, "run", { fullPage: true });
  await page.close();
}

async function testTrial(context) {
  const page = await open(context, "trial.html", { width: 1280, height: 900 });
  await expectCharts(page, ["faults", "after-start", "trajectories", "errors"]);
  const parts = await page.locator("#part option").allInnerTexts();
  assert.equal(parts.length, 4);
  await page.selectOption("#part", "3");
  await page.selectOption("#fault", "1");
  assert.ok((await page.locator("#flight-note").innerText()).includes("silent: off by 0.62 m"), "why the run failed");
  const names = await page.evaluate(() => window.etalonReport.charts.get("trajectories").getOption().series.map((s) => s.name));
  assert.deepEqual(names, ["ground truth", "one", "two"]);
  assert.ok((await page.locator("table.etalon tbody tr").count()) > 10, "tables");
  await shot(page, "trial", { fullPage: true });
  await page.close();
}

const context = await chromium.launchPersistentContext(profile, { executablePath, headless: true, args, offline: true });
try {
  await testBenchmark(context);
  await testNarrow(context);
  await testRun(context);
  await testTrial(context);
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
assert.deepEqual(messages, []);
assert.ok(readFileSync(join(folder, "print.pdf")).length > 20000, "the PDF is empty");
console.log(`report: opened, clicked, printed; pictures in ${folder}`);
