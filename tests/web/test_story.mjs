// The whole story on files: compare, drag, diagnose, add, see the error fall, undo, save a report.
import fs from "node:fs";
import path from "node:path";
import {axe, end, expect, folder, goTo, isPng, newPage, number, open, recordStory, root, runAll, saved, servePage, test, until} from "./harness.mjs";

let sessions, served, page;
const model = path.join(root, "config/models/fh2.yaml");
const serve = () => servePage([model, sessions.step_low, sessions.step_high, "--held-out", sessions.step_mid]);

test("the page opens on files with the first picture of the model over the measurement", async () => {
  await open(page, served.url, "compare");
  await page.locator(".figure canvas").first().waitFor();
  expect(await page.locator(".stop").isHidden(), "there is a STOP button without a bench");
});

test("a fit leaves an error that is far above the noise floor", async () => {
  await page.locator("#fit").click();
  await until("the error of the linear model", async () => (await number(page, "#error-held-out")) > 5 && page.locator("#fit").isEnabled());
});

test("dragging a slider redraws the simulation while it is dragged", async () => {
  const slider = page.locator('input[type=range][data-parameter="J"]');
  const picture = () => page.locator(".figure canvas").first().evaluate((c) => c.toDataURL());
  await slider.scrollIntoViewIfNeeded();
  const before = await picture(), error = await number(page, "#error-run"), whole = await number(page, "#error-train");
  const box = await slider.boundingBox();
  await page.mouse.move(box.x + box.width * 0.4, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.85, box.y + box.height / 2, {steps: 8});
  await until("another picture while dragging", async () => (await picture()) !== before);
  await until("a larger error while dragging", async () => (await number(page, "#error-run")) > error);
  await page.mouse.up();
  await until("undo of the drag", () => page.locator("#undo").isEnabled());
  await page.locator("#undo").click();
  await until("the error from before", async () => Math.abs((await number(page, "#error-train")) - whole) < 0.02 * whole);
});

test("arrow keys and typed numbers move a parameter, within its bounds", async () => {
  const entry = page.getByLabel(/^R_a, value/);
  await entry.fill("4000");
  await entry.press("Enter");
  await until("a value beyond the bounds is marked", async () => (await entry.getAttribute("aria-invalid")) === "true");
  await entry.fill("40");
  await entry.press("Enter");
  await until("the typed value is set", async () => page.locator("#undo").isEnabled());
  await page.locator("#undo").click();
  const slider = page.locator('input[type=range][data-parameter="R_a"]');
  await slider.focus();
  const was = await slider.inputValue();
  await slider.press("ArrowRight");
  await until("an arrow key moves the slider", async () => (await slider.inputValue()) !== was);
  await until("the change is kept", () => page.locator("#undo").isEnabled());
  await page.locator("#undo").click();
});

test("what the model misses is told against the speed, and each residual map with its standard errors", async () => {
  await page.getByRole("button", {name: "Numbers of Missing torque against speed"}).click();
  const table = (title) => page.locator("figure", {has: page.getByRole("button", {name: `Numbers of ${title}`})}).locator("table");
  await until("the missing torque's numbers", async () => (await table("Missing torque against speed").locator("tbody tr").count()) > 5);
  await page.getByText("Residual maps").click();
  await page.getByRole("button", {name: "Numbers of Speed against speed"}).click();
  await until("the map's numbers", async () => (await table("Speed against speed").locator("tbody tr").count()) > 5);
  const head = await table("Speed against speed").locator("thead").innerText();
  expect(/standard error/.test(head) && /rad\/s/.test(head), `the columns of a map: ${head}`);
  const violations = await axe(page);
  expect(violations === "", violations);
});

test("a worker that dies is told, and nothing is lost", async () => {
  const error = await number(page, "#error-train");
  process.kill(Number(fs.readFileSync(`/proc/${served.child.pid}/task/${served.child.pid}/children`, "utf8").trim().split(" ")[0]), "SIGKILL");
  const notice = page.locator(".notice.bad", {hasText: "it was ended by signal 9"});
  await notice.first().waitFor();
  await page.reload();
  await until("the work as it was", async () => (await number(page, "#error-train")) === error);
});

test("the diagnosis names dry friction, with cards", async () => {
  await goTo(page, "diagnose");
  await page.locator("#diagnose").click();
  await page.locator("#verdict").waitFor({timeout: 60_000});
  expect(/^Found/.test(await page.locator("#verdict").innerText()), `the verdict is: ${await page.locator("#verdict").innerText()}`);
  expect((await page.locator(".card.best").count()) === 1, "one card is marked as missing");
  const violations = await axe(page);
  expect(violations === "", violations);
  const tools = (what) => page.locator(".card.best").getByRole("button", {name: new RegExp(`^${what} of Signature`)});
  expect(isPng(await saved(page, tools("PNG"))), "the PNG of a signature is none");
  expect((await saved(page, tools("CSV"))).toString().startsWith("t [s],"), "the CSV of a signature has no time");
});

test("adding it makes the error fall to the floor; undo brings it back; redo", async () => {
  const before = await number(page, "#error-held-out");
  await page.locator(".card.best button[data-add]").click();
  await until("the error falls", async () => (await number(page, "#error-held-out")) < 1.3, 60_000);
  expect(before > 5, `the error was only ${before}`);
  await until("the staircase has another step", async () => (await page.locator("#staircase tbody tr").count()) >= 2);
  expect(isPng(await saved(page, page.getByRole("button", {name: "PNG of The falling error"}))), "the PNG of the staircase is none");
  expect(/coulomb friction/i.test((await saved(page, page.getByRole("button", {name: "CSV of The falling error"}))).toString()), "the CSV of the staircase names no step");
  await page.locator("#undo").click();
  await until("the error from before", async () => (await number(page, "#error-held-out")) > 5);
  await page.locator("#redo").click();
  await until("the fallen error", async () => (await number(page, "#error-held-out")) < 1.3);
});

test("the work outlives a reload and the server's end", async () => {
  await page.reload();
  await until("the fallen error after a reload", async () => (await number(page, "#error-held-out")) < 1.3);
  await end(served.child);
  await page.locator(".lost-bar").waitFor();
  served = await serve();
  await open(page, served.url, "diagnose");
  await until("the fallen error after a restart", async () => (await number(page, "#error-held-out")) < 1.3);
});

test("a formula is scored, and a wrong one says why", async () => {
  await goTo(page, "formula");
  await page.locator("#formula").fill("-c*omega*abs(omega)");
  await until("a score", async () => /held out/.test(await page.locator("#formula-answer").innerText()), 60_000);
  await page.locator("#formula").fill("-T*tanh(omega/");
  await until("what is wrong with the formula", async () => (await page.locator("#formula-answer .bad").count()) > 0, 60_000);
});

test("the report and the model are saved, the shipped model is untouched", async () => {
  const original = fs.readFileSync(model, "utf8");
  await goTo(page, "report");
  const [report] = await Promise.all([page.waitForEvent("download", {timeout: 60_000}), page.locator("#report").click()]);
  const file = path.join(folder, "report.html");
  await report.saveAs(file);
  expect(/<html/i.test(fs.readFileSync(file, "utf8")) && fs.statSync(file).size > 50_000, "the report is no page");
  const phone = await newPage({viewport: {width: 360, height: 740}});
  await phone.goto(`file://${file}`);
  const over = await phone.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(over <= 0, `on a phone the report is ${over} px too wide`);
  const violations = await axe(phone);
  expect(violations === "", violations);
  await phone.context().close();
  const [saved] = await Promise.all([page.waitForEvent("download"), page.locator("#save-model").click()]);
  await saved.saveAs(path.join(folder, "saved.yaml"));
  expect(/effects:/.test(fs.readFileSync(path.join(folder, "saved.yaml"), "utf8")), "the model file has no effects");
  expect(fs.readFileSync(model, "utf8") === original, "the MODEL was overwritten");
});

test("a plot gives its numbers, its CSV and its PNG", async () => {
  await goTo(page, "compare");
  const figure = page.locator(".figure").first();
  await figure.locator("canvas").waitFor();
  await figure.getByRole("button", {name: "Numbers of"}).click();
  await until("a table of numbers", async () => (await figure.locator("tbody tr").count()) > 50);
  expect(isPng(await saved(page, figure.getByRole("button", {name: "PNG"}))), "the PNG is none");
  const csv = (await saved(page, figure.getByRole("button", {name: "CSV"}))).toString();
  expect(/^t \[s\],.*measured/.test(csv) && csv.split("\n").length > 50, `the CSV: ${csv.slice(0, 200)}`);
});

test("nothing broke in the page meanwhile", async () => expect(page.wrong.length === 0, page.wrong.join("\n")));

await runAll(async () => {
  sessions = await recordStory(["step_low", "step_mid", "step_high"]);
  served = await serve();
  page = await newPage();
});
