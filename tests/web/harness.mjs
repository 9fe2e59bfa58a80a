// What the page's tests share: a bench, `emtb page` before it, a browser, and tests that run one after the other.
import {execFileSync, spawn} from "node:child_process";
import fs from "node:fs";
import {createRequire} from "node:module";
import os from "node:os";
import path from "node:path";

// EMTB_WEB names a folder with another build of the page.
const modules = createRequire(path.join(process.env.EMTB_WEB_TESTS ?? "", "package.json"));
const {chromium} = modules("playwright-core");
export const axeSource = fs.readFileSync(modules.resolve("axe-core/axe.min.js"), "utf8");
export const root = path.resolve(path.dirname(new URL(import.meta.url).pathname), "../..");
export const bin = process.env.EMTB_BIN ?? path.join(root, "build/release/bin");
export const folder = process.env.EMTB_TEST_FOLDER ?? fs.mkdtempSync(path.join(os.tmpdir(), "emtb-web-"));
export const patience = 20_000;  // [ms] for any condition to come true

const children = new Set();
const environment = {...process.env, XDG_STATE_HOME: path.join(folder, "state"), XDG_RUNTIME_DIR: folder};

/// Waits until `condition` gives something, looking often; says what it waited for when it does not come.
export async function until(what, condition, within = patience) {
  const end = Date.now() + within;
  for (;;) {
    const value = await condition();
    if (value) return value;
    if (Date.now() > end) throw new Error(`this did not come true within ${within / 1000} s: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 25));
  }
}

/// Starts a program and keeps what it prints.
export function start(program, args, env = {}) {
  const child = spawn(program, args, {env: {...environment, ...env}, stdio: ["ignore", "pipe", "pipe"]});
  child.text = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (data) => (child.text += data));
  children.add(child);
  child.on("exit", () => children.delete(child));
  return child;
}

export async function end(child, signal = "SIGTERM") {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const gone = new Promise((resolve) => child.on("exit", resolve));
  child.kill(signal);
  await gone;
}

export function emtb(...args) {
  return execFileSync(path.join(bin, "emtb"), args, {env: environment, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"]});
}

/// A simulated bench as shipped, with lines of its file changed: [[from, to], ...].
export function benchFile(name, changes = []) {
  let text = fs.readFileSync(path.join(root, "config/benches/fh2-simulated.yaml"), "utf8").replaceAll("../models/", `${root}/config/models/`);
  for (const [from, to] of changes) {
    if (!text.includes(from)) throw new Error(`the bench file has no "${from}"`);
    text = text.replace(from, to);
  }
  const file = path.join(folder, name);
  fs.writeFileSync(file, text);
  return file;
}

export class Bench {
  constructor(file, pace = "1", name = "bench") {
    Object.assign(this, {file, pace, socket: path.join(folder, `${name}.sock`), data: path.join(folder, `${name}-data`)});
    fs.mkdirSync(this.data, {recursive: true});
  }
  async start() {
    this.daemon = start(path.join(bin, "emtbd"), ["--config", this.file, "--socket", this.socket, "--data", this.data, "--pace", this.pace]);
    await until("emtbd listens", () => fs.existsSync(this.socket) && tryStatus(this.socket));
    return this;
  }
  stop(signal) {
    return end(this.daemon, signal);
  }
}

function tryStatus(socket) {
  try {
    return emtb("--socket", socket, "status");
  } catch {
    return null;
  }
}

/// `emtb page`; its address with the token.
export async function servePage(args, global = []) {
  const child = start(path.join(bin, "emtb"), [...global, "page", "--port", "0", ...(process.env.EMTB_WEB ? ["--web", process.env.EMTB_WEB] : []), ...args]);
  const url = await until("emtb page prints its address", () => {
    if (child.exitCode !== null) throw new Error(`emtb page ended: ${child.text}`);
    return /http:\/\/\S+#token=\S+/.exec(child.text)?.[0];
  });
  return {child, url, origin: new URL(url).origin};
}

/// Six experiments as story.sh makes them, at full speed.
export async function recordStory(runs) {
  const bench = await new Bench(benchFile("story.yaml"), "max", "story").start();
  emtb("--socket", bench.socket, "reset");
  const sessions = {};
  for (const run of runs) {
    sessions[run] = path.join(folder, `${run}.h5`);
    fs.renameSync(emtb("--socket", bench.socket, "run", `fh2_${run}`).trim().split("\n").pop(), sessions[run]);
  }
  await bench.stop();
  return sessions;
}

/// `emtb page` over four sessions of a motor that drags most around 70 rad/s.
export function serveHump() {
  const model = path.join(root, "config/models/fh2.yaml"), truth = path.join(folder, "truth.yaml"), linear = fs.readFileSync(model, "utf8");
  const hump = '{torque: "-a*tanh(omega/2)*exp(-((abs(omega) - 70)/15)^2)", parameters: {a: {value: 0.05, min: 0, max: 1, unit: N m}}}';
  if (!/^effects: \{\}$/m.test(linear)) throw new Error("the shipped model has effects");
  fs.writeFileSync(truth, linear.replace(/^effects: \{\}$/m, `effects:\n  hump: ${hump}`));
  const [ramp, random, mid, low] = ["fh2_ramp", "fh2_random", "fh2_step_mid", "fh2_step_low"].map((profile) => {
    const session = path.join(folder, `${profile}.csv`);
    emtb("simulate", truth, profile, "--rate", "50", "--out", session);
    return session;
  });
  return servePage([model, ramp, random, "--held-out", mid, low]);
}

let browser;
export async function newPage(options = {}) {
  browser ??= await chromium.launch({executablePath: process.env.EMTB_CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"]});
  const context = await browser.newContext({viewport: {width: 1280, height: 720}, reducedMotion: "reduce", acceptDownloads: true, ...options});
  const page = await context.newPage();
  page.setDefaultTimeout(patience);
  page.wrong = [];
  page.leaving = 0;  // times that it asked before it was left
  page.on("pageerror", (error) => page.wrong.push(error.message));
  page.on("dialog", (dialog) => dialog.type() === "beforeunload" ? (++page.leaving, dialog.accept()) : (page.wrong.push(`a dialog: ${dialog.message()}`), dialog.dismiss()));
  return page;
}

/// The next page starts another.
export async function closeBrowser() {
  await browser?.close();
  browser = undefined;
}

export async function open(page, url, view) {
  await page.goto(url);
  await page.locator("nav.views a").first().waitFor();
  if (view) await goTo(page, view);
}

export async function goTo(page, view) {
  await page.locator(`nav.views a[href="#${view}"]`).click();
  await page.locator(`main.view-${view}`).waitFor();
}

export async function number(page, selector) {
  return Number((await page.locator(selector).first().innerText()).replace("−", "-"));
}

/// Violations of WCAG 2.2 A and AA, as text.
export async function axe(page) {
  await page.evaluate(axeSource);
  const result = await page.evaluate(() => globalThis.axe.run(document, {runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]}));
  return result.violations.map((v) => `${v.id}: ${v.help}: ${v.nodes.slice(0, 3).map((n) => `${n.html.slice(0, 160)} ${(n.any[0]?.message ?? "").slice(0, 200)}`).join(" | ")}`).join("\n");
}

/// Clicks one of a plot's buttons and reads the file that it gives.
export async function saved(page, button) {
  const [download] = await Promise.all([page.waitForEvent("download"), button.click()]);
  const file = path.join(folder, download.suggestedFilename());
  await download.saveAs(file);
  return fs.readFileSync(file);
}

export const isPng = (bytes) => bytes.length > 500 && bytes.subarray(1, 4).toString() === "PNG";

export function expect(condition, what) {
  if (!condition) throw new Error(what);
}

const tests = [];
export function test(name, body) {
  tests.push({name, body});
}

/// Runs the tests; the process's exit code says how it went.
export async function runAll(prepare = async () => undefined) {
  let wrong = 0;
  try {
    await prepare();
    for (const {name, body} of tests) {
      const begun = Date.now();
      try {
        await body();
        console.log(`ok    ${name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
      } catch (error) {
        ++wrong;
        console.log(`WRONG ${name}\n${error.stack}`);
      }
    }
  } catch (error) {
    ++wrong;
    console.log(`WRONG before the tests\n${error.stack}`);
  }
  await closeBrowser();
  for (const child of [...children]) await end(child, "SIGKILL");
  fs.rmSync(folder, {recursive: true, force: true});
  process.exit(wrong ? 1 : 0);
}
