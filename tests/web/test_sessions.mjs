// Sessions: notes and tags, two side by side, a file from elsewhere, what is fitted to; and work that is cancelled.
import fs from "node:fs";
import path from "node:path";
import {emtb, expect, folder, goTo, newPage, number, open, recordStory, root, runAll, servePage, test, until} from "./harness.mjs";

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
