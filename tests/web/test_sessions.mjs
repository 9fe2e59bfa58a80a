// Sessions: notes and tags, two side by side, a file from elsewhere, what is fitted to; and work that is cancelled.
import fs from "node:fs";
import path from "node:path";
import {axe, emtb, expect, folder, goTo, newPage, number, open, recordStory, root, runAll, servePage, test, until} from "./harness.mjs";

let sessions, served, page;
const row = (name) => page.locator("tbody tr", {hasText: name});

test("a note and tags are kept, as text, and found again", async () => {
  await open(page, served.url, "sessions");
  await row("step_low.h5").waitFor();
  for (const box of await page.locator("tbody input[type=checkbox]").all()) if (await box.isChecked()) await box.uncheck();
  await row("step_low.h5").locator("input[type=checkbox]").check();
  await page.getByLabel("Note").fill("<b>cold</b> motor");
  await page.getByLabel("Tags, with commas between").fill("cold, brushes new");
  await page.getByRole("button", {name: "Save note and tags"}).click();
  await until("the tags in the list", async () => (await row("step_low.h5").locator(".tag").count()) === 2);
  await page.reload();
  await until("the note after a reload", async () => (await row("step_low.h5").innerText().catch(() => "")).includes("<b>cold</b> motor"));
  await page.getByLabel("Filter").fill("brushes");
  await until("the filter finds the tag", async () => (await page.locator("tbody tr").count()) === 1);
  await page.getByLabel("Filter").fill("");
});

test("two sessions stand side by side in one plot", async () => {
  for (const name of ["step_low.h5", "step_mid.h5"]) await row(name).locator("input[type=checkbox]").setChecked(true);
  await until("both names in the key of the plot", async () => {
    const key = await page.locator(".figure header").first().innerText().catch(() => "");
    return key.includes("step_low.h5") && key.includes("step_mid.h5");
  });
});

test("a CSV is imported, and one that is none is named as such", async () => {
  const elsewhere = path.join(folder, "elsewhere");  // no folder of a session
  fs.mkdirSync(elsewhere);
  const csv = path.join(elsewhere, "from-elsewhere.csv");
  emtb("export", sessions.step_high, "--out", csv);
  await page.locator("#import-file").setInputFiles(csv);
  await row("from-elsewhere.csv").waitFor();
  await until("its length is known", async () => /30\s*s/.test(await row("from-elsewhere.csv").innerText()));
  fs.writeFileSync(path.join(elsewhere, "nonsense.csv"), "a,b\n=1+1,<script>\n");
  await page.locator("#import-file").setInputFiles(path.join(elsewhere, "nonsense.csv"));
  await until("it is named as not readable", async () => (await row("nonsense.csv").locator(".tag.bad").count()) === 1);
  await page.locator("dialog.columns").waitFor();
  await page.keyboard.press("Escape");
  await until("Esc closes the question about its columns", async () => (await page.locator("dialog").count()) === 0);
});

test("each session has a picture in the list, which says what it is of", async () => {
  const picture = row("step_low.h5").locator(".thumbnail svg");
  expect(/^Speed, .* to .* rad\/s$/.test((await picture.getAttribute("aria-label")).replaceAll("\u00a0", " ")), `its words: ${await picture.getAttribute("aria-label")}`);
  const corners = (await picture.locator(".trace").getAttribute("points")).trim().split(" ");
  const heights = corners.map((corner) => Number(corner.split(",")[1]));
  expect(corners.length > 40 && Math.max(...heights) - Math.min(...heights) > 15, `the picture is flat: ${corners.length} corners`);
});

/// Shows this session alone.
async function showAlone(name) {
  for (const box of await page.locator("tbody input[type=checkbox]").all()) if (await box.isChecked()) await box.uncheck();
  await row(name).locator("input[type=checkbox]").check();
  await until(`${name} is drawn`, async () => (await page.locator(".figure header").first().innerText().catch(() => "")).includes(name));
}

/// [s] As the list says it.
const length = async (name) => Number(/([0-9.]+)\s*s$/.exec(await row(name).locator("td.n").innerText())?.[1]);

test("a part that is dragged across a plot becomes a session; the recording stays as it is", async () => {
  const before = fs.readFileSync(sessions.step_mid);
  await showAlone("step_mid.h5");
  const plot = page.locator(".figure .u-over").first();
  await plot.scrollIntoViewIfNeeded();
  const box = await plot.boundingBox();
  await page.mouse.move(box.x + 0.25 * box.width, box.y + 40);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.75 * box.width, box.y + 40, {steps: 5});
  await page.mouse.up();
  await until("the ends of the part", async () => Math.abs(Number(await page.locator("#part-from").inputValue()) - 5.5) < 0.5 && Math.abs(Number(await page.locator("#part-to").inputValue()) - 16.5) < 0.5);
  await page.locator("#part-keep").click();
  await until("the part in the list", async () => (await row(/^\s*step_mid_5.*s\.h5/).count()) === 1);
  const part = await length(/^\s*step_mid_5.*s\.h5/);
  expect(Math.abs(part - 11) < 1, `the part lasts ${part} s`);
  expect(before.equals(fs.readFileSync(sessions.step_mid)), "the recording was changed");
});

test("a session is split where one types, and its pieces are fitted to and held out", async () => {
  await showAlone("step_low.h5");
  await page.locator("#part-to").fill("8");
  await page.locator("#part-to").press("Enter");
  await until("Split is allowed", () => page.locator("#part-split").isEnabled());
  await page.locator("#part-split").click();
  await until("both pieces", async () => (await row("step_low_0-8s.h5").count()) === 1 && (await row(/step_low_8-18.*s\.h5/).count()) === 1);
  expect(Math.abs((await length("step_low_0-8s.h5")) - 8) < 0.1, "the first piece does not last 8 s");
  expect(Math.abs((await length(/step_low_8-18.*s\.h5/)) - 10) < 0.1, "the second piece does not last 10 s");
  await row("step_low_0-8s.h5").locator("select").selectOption("train");
  await goTo(page, "compare");
  await until("it is among the runs", async () => (await page.locator("main select").first().innerText()).includes("step_low_0-8s.h5"));
  await goTo(page, "sessions");
  await row("step_low_0-8s.h5").locator("select").selectOption("");
});

test("columns of a foreign CSV are named by clicking them", async () => {
  const csv = path.join(folder, "elsewhere", "drehzahl.csv");
  const rows = Array.from({length: 400}, (_, n) => `${10 * n};${(n < 100 ? 0 : 1000 * (1 - Math.exp((100 - n) / 60))).toFixed(2)};${n < 100 ? 0 : 150};x`.replaceAll(".", ","));
  fs.writeFileSync(csv, `zeit;n;"strom <i>";bemerkung\n${rows.join("\n")}\n`);
  await page.locator("#import-file").setInputFiles(csv);
  const dialog = page.locator("dialog.columns");
  await dialog.waitFor();
  const violations = await axe(page);
  expect(violations === "", violations);
  const mean = async (column, what, unit) => {
    await dialog.getByRole("button", {name: column}).click();
    await dialog.locator(".chips").getByRole("button", {name: what, exact: true}).click();
    if (unit) await dialog.locator("#column-unit").selectOption(unit);
  };
  expect(await page.locator("#columns-read").isDisabled(), "it can be read before anything is named");
  await mean(/^zeit/, "time", "ms");
  await mean(/^n /, "angular velocity", "rpm");
  await mean(/^strom <i>/, "armature current", "mA");
  const [mapping] = await Promise.all([page.waitForEvent("download"), dialog.getByRole("button", {name: "Save the mapping file"}).click()]);
  await mapping.saveAs(path.join(folder, "mapping.yaml"));
  await page.locator("#columns-read").click();
  await until("the session that was made", async () => (await row("drehzahl.h5").count()) === 1 && (await row(/^\s*drehzahl\.csv/).count()) === 0);
  expect(Math.abs((await length("drehzahl.h5")) - 4) < 0.1, "ms were not taken as ms");
  const told = path.join(folder, "info.json");
  const fastest = (file, ...more) => emtb("info", file, ...more, "--json", told) && JSON.parse(fs.readFileSync(told, "utf8"))[0].runs[0].signals.omega.max;
  const expected = (1000 * (1 - Math.exp(-299 / 60)) * Math.PI) / 30;
  for (const found of [fastest(path.join(folder, "state/emtb/imports/drehzahl.h5")), fastest(csv, "--map", path.join(folder, "mapping.yaml"))]) expect(Math.abs(found - expected) < 0.01, `the speed is ${found} rad/s, not ${expected}`);
});

test("what is imported can be held out, and is compared with", async () => {
  await row("from-elsewhere.csv").locator("select").selectOption("held_out");
  await goTo(page, "compare");
  await until("it is among the runs", async () => (await page.locator("main select").first().innerText()).includes("from-elsewhere.csv"));
});

test("a diagnosis is cancelled, and the work is as before", async () => {
  await goTo(page, "diagnose");
  const before = await number(page, "#error-train");
  await page.locator("#diagnose").click();
  await page.getByRole("button", {name: "Cancel"}).click();
  await until("it says that it was cancelled", async () => (await page.locator("section[aria-label=Verdict] .bad").count()) === 1);
  expect((await number(page, "#error-train")) === before, "the error changed");
  await until("Diagnose can be asked for again", () => page.locator("#diagnose").isEnabled());
});

test("a locked parameter stays as it is in a fit", async () => {
  await goTo(page, "compare");
  await page.getByLabel("Lock R_a: leave it out of a fit").check();
  await until("the lock", () => page.locator("#undo").isEnabled());
  const entry = page.getByLabel(/^R_a, value/), value = await entry.inputValue();
  const before = await number(page, "#error-train");
  await page.locator("#fit").click();
  await until("the fit", async () => (await number(page, "#error-train")) < before);
  expect((await entry.inputValue()) === value, `R_a went from ${value} to ${await entry.inputValue()}`);
});

test("nothing broke in the page meanwhile", async () => expect(page.wrong.length === 0, page.wrong.join("\n")));

await runAll(async () => {
  sessions = await recordStory(["step_low", "step_mid", "step_high"]);
  served = await servePage([path.join(root, "config/models/fh2.yaml"), sessions.step_low, "--held-out", sessions.step_mid]);
  page = await newPage();
});
