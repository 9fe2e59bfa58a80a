// The pictures of docs/page.md: every view, as it stands in the middle of the story.
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import {Bench, benchFile, emtb, folder, goTo, newPage, open, recordStory, root, runAll, serveHump, servePage, test, until} from "./harness.mjs";

const out = process.env.EMTB_PICTURES;
let served, bench;
async function shot(page, name, height = 720) {
  await page.mouse.move(4, 700);  // nothing under the pointer
  await page.evaluate(() => globalThis.scrollTo(0, 0));
  await page.evaluate((user) => {  // whoever draws them is of no interest
    for (const place of document.querySelectorAll("#controller, .session-notes p")) place.textContent = place.textContent.replaceAll(user, "operator").replace(/process \d+/, "process 1234");
  }, os.userInfo().username);
  await page.screenshot({path: path.join(out, `page-${name}.png`), clip: {x: 0, y: 0, width: page.viewportSize().width, height}});
}

/// All pictures of the page have the size of a small screen.
const small = {viewport: {width: 1280, height: 720}};

test("pictures", async () => {
  const page = await newPage(small);
  await open(page, served.url, "compare");
  await page.locator("#fit").click();
  await until("the fit", async () => Number(await page.locator("#error-held-out").innerText()) > 5 && page.locator("#fit").isEnabled());
  await page.locator(".figure canvas").nth(1).waitFor();
  await shot(page, "compare");

  await goTo(page, "formula");
  await until("the score", async () => /held out/.test(await page.locator("#formula-answer").innerText()), 60_000);
  await shot(page, "formula");

  await goTo(page, "diagnose");
  await page.locator("#diagnose").click();
  await page.locator("#verdict").waitFor({timeout: 90_000});
  await page.locator(".card.best button[data-add]").click();
  await until("the fallen error", async () => Number(await page.locator("#error-held-out").innerText()) < 1.3, 60_000);
  await shot(page, "diagnose", 650);

  await goTo(page, "sessions");
  await page.locator("tbody input[type=checkbox]").nth(1).check();
  await page.locator(".figure canvas").first().waitFor();
  await shot(page, "sessions");

  const csv = path.join(folder, "logger.csv");
  const reading = (n) => `${20 * n};${(n < 100 ? 0 : 1450 * (1 - Math.exp((100 - n) / 60))).toFixed(1)};${n < 100 ? 12 : 480};ok`;
  fs.writeFileSync(csv, `clock;speed 1;shunt;remark\n${Array.from({length: 500}, (_, n) => reading(n + 97)).join("\n")}\n`);
  await page.locator("#import-file").setInputFiles(csv);
  const dialog = page.locator("dialog.columns");
  for (const [column, what, unit] of [["clock", "time", "ms"], ["speed 1", "angular velocity", "rpm"], ["shunt", "armature current", "mA"]]) {
    await dialog.getByRole("button", {name: column}).click();
    await dialog.locator(".chips").getByRole("button", {name: what, exact: true}).click();
    await dialog.locator("#column-unit").selectOption(unit);
  }
  await shot(page, "columns");
  await page.keyboard.press("Escape");

  await goTo(page, "report");
  await page.locator("pre").waitFor();
  await shot(page, "report");

  await goTo(page, "bench");
  await page.locator("#arm").click();
  await page.locator("dialog").getByRole("button", {name: "Arm"}).click();
  await page.locator("#profile").selectOption("fh2_step_high");
  await until("the start is allowed", () => page.locator("#start").isEnabled());
  await page.locator("#start").click();
  await page.locator("dialog").getByRole("button", {name: "Start the run"}).click();
  await until("nine seconds of the run", async () => JSON.parse(emtb("--socket", bench.socket, "status", "--json", "-")).run?.t > 9).catch(() => undefined);
  await shot(page, "bench");
  await goTo(page, "estimates");
  await page.locator(".figure canvas").nth(1).waitFor();
  await until("some seconds of innovation", async () => JSON.parse(emtb("--socket", bench.socket, "status", "--json", "-")).run?.t > 22).catch(() => undefined);
  await shot(page, "estimates");

  const law = await newPage(small);
  await open(law, (await serveHump()).url, "diagnose");
  await law.locator("#diagnose").click();
  await law.locator("#discovered").waitFor({timeout: 200_000});
  await shot(law, "law");

  const phone = await newPage({viewport: {width: 360, height: 740}, hasTouch: true});
  await open(phone, served.url, "bench");
  await until("readings", async () => Number.isFinite(Number((await phone.locator(".strip .value").nth(1).innerText()).replace("−", "-"))));
  await shot(phone, "phone", 740);
  const dark = await newPage({...small, colorScheme: "dark"});
  await open(dark, served.url, "bench");
  await until("readings", async () => Number.isFinite(Number((await dark.locator(".strip .value").nth(1).innerText()).replace("−", "-"))));
  await shot(dark, "dark");
});

await runAll(async () => {
  const s = await recordStory(["step_low", "step_mid", "step_high", "staircase"]);
  bench = await new Bench(benchFile("pictures.yaml")).start();
  served = await servePage([path.join(root, "config/models/fh2.yaml"), s.step_low, s.step_high, "--held-out", s.step_mid, s.staircase], ["--socket", bench.socket]);
});
