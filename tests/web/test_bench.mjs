// The bench, live: start, watch, stop, a fault, two pages, a daemon that comes back, a connection that is lost.
import fs from "node:fs";
import path from "node:path";
import {axe, Bench, benchFile, expect, folder, goTo, isPng, newPage, open, patience, runAll, saved, servePage, test, until} from "./harness.mjs";

let bench, served, page;
const state = (p) => p.locator("#state .word").innerText();
const value = async (p, n) => Number((await p.locator(".strip .value").nth(n).innerText()).replace("−", "-"));

async function startRun(p, profile) {
  await p.locator("#profile").selectOption(profile);
  await until("the start is allowed", () => p.locator("#start").isEnabled());
  await p.locator("#start").click();
  const dialog = p.locator("dialog");
  const text = await dialog.innerText();
  expect(text.includes(profile) && text.includes("fh2-simulated"), `the question names neither bench nor profile: ${text}`);
  await dialog.getByRole("button", {name: "Start the run"}).click();
  await until("the run is on", async () => (await state(p)) === "Running");
}

async function arm(p) {
  const armed = async () => (await state(p)) === "Armed";
  const ask = async () => {
    await p.locator("#arm").click();
    await p.locator("dialog").getByRole("button", {name: "Arm"}).click();
    return until("the bench is armed", armed, patience / 4);
  };
  // A reset is refused while a cause still stands, as the end of a lost client's connection may for a moment.
  await ask().catch(() => ask());
}

test("the page shows the latched bench and arms it after a question", async () => {
  await open(page, served.url, "bench");
  await until("the state", async () => (await state(page)) === "Latched");
  await arm(page);
});

test("a run starts after a question, and the trace moves", async () => {
  await startRun(page, "fh2_step_high");
  await until("the speed rises", async () => (await value(page, 2)) > 5 || (await value(page, 3)) > 5);
  const picture = () => page.locator(".strip canvas").nth(1).evaluate((c) => c.toDataURL());
  const first = await picture();
  await until("the strip moves", async () => (await picture()) !== first);
  expect(/this page/.test(await page.locator("#controller").innerText()), "who controls is not said");
});

test("a second page sees the run, cannot begin another, and stops it", async () => {
  const other = await newPage();
  await open(other, served.url, "bench");
  await until("the run is seen", async () => (await state(other)) === "Running");
  expect(!/this page/.test(await other.locator("#controller").innerText()), "both pages say that they control");
  await other.getByRole("button", {name: "Numbers, PNG and CSV of the signals"}).click();
  await other.getByRole("button", {name: "Numbers of Speed", exact: true}).click();
  const first = Number((await other.locator(".strip .numbers tbody td").first().innerText()).replace("−", "-"));
  expect(first < -3, `what was measured before the page was opened is not there: its first reading is ${first} s old`);
  expect(isPng(await saved(other, other.getByRole("button", {name: "PNG of Speed", exact: true}))), "a strip's PNG is none");
  const csv = (await saved(other, other.getByRole("button", {name: "CSV of Speed", exact: true}))).toString();
  expect(/^t \[s\],.*\[rad\/s\]/.test(csv) && csv.split("\n").length > 100, `a strip's CSV: ${csv.slice(0, 100)}`);
  const begun = Date.now();
  await other.locator(".stop").click();
  await until("the stop is answered", async () => /reference safe/.test(await other.locator(".stop").innerText()));
  console.log(`      click to "reference safe": ${Date.now() - begun} ms`);
  await until("the first page sees the end", async () => (await state(page)) !== "Running");
  await until("the run's end is told", async () => /stopped/.test(await page.locator("#last-run").innerText()));
  await other.context().close();
});

test("Esc stops a run, in a text field too", async () => {
  await startRun(page, "fh2_step_low");
  await goTo(page, "sessions");
  await page.locator("input[type=search]").focus();
  await page.keyboard.press("Escape");
  await until("the stop is answered", async () => /reference safe/.test(await page.locator(".stop").innerText()));
  await goTo(page, "bench");
  await until("the run is over", async () => (await state(page)) === "Armed");
});

test("a profile asks the operator before and in mid-run, and goes on when told", async () => {
  await page.locator("#profile").selectOption("fh2_ask");
  await until("what it needs is said", async () => /motor is at rest/.test(await page.locator("main").innerText()));
  expect((await page.locator("section[aria-label=Run]").innerText()).includes("set the brake to <b>2 A</b>"), "the pause is not announced beforehand, as text");
  await until("the motor is at rest", async () => /^−?0\.[0-4]/.test(await page.locator(".strip", {hasText: "Speed"}).locator(".value").innerText()));
  await until("the start is allowed", () => page.locator("#start").isEnabled());
  await page.locator("#start").click();
  expect((await page.locator("dialog").innerText()).includes("set the brake to <b>2 A</b>"), "the question does not name the pause");
  await page.locator("dialog").getByRole("button", {name: "Start the run"}).click();
  const prompt = page.locator(".prompt", {hasText: "set the brake to <b>2 A</b>"});
  await until("the run waits for its operator", async () => (await prompt.isVisible()) || ((await page.locator(".notice.bad").count()) && expect(false, await page.locator(".notices").innerText())));
  const violations = await axe(page);
  expect(violations === "", violations);
  const far = () => page.locator("section[aria-label=Run] progress").evaluate((bar) => bar.value);
  await until("the run waits", async () => {
    const before = await far();
    await page.waitForTimeout(400);
    return (await far()) === before;
  });
  await goTo(page, "sessions");
  await until("the other views say it, too", async () => (await page.locator(".prompt-bar").innerText()).includes("waits for you: set the brake to <b>2 A</b>"));
  await page.getByRole("link", {name: "To the bench"}).click();
  await page.locator("#confirm").focus();
  await page.waitForTimeout(1200);
  expect(await page.locator("#confirm").evaluate((button) => button === document.activeElement), "the button loses the focus while the run waits");
  await page.keyboard.press("Enter");
  await until("the prompt is gone", async () => (await prompt.count()) === 0 || !(await prompt.isVisible()));
  await until("the run is done", async () => /fh2_ask is done/.test(await page.locator("#last-run").innerText().catch(() => "")));
});

test("live estimates are shown while a run is on", async () => {
  await startRun(page, "fh2_step_low");
  await goTo(page, "estimates");
  await until("values of the parameters", async () => (await page.locator("tbody tr").count()) >= 4);
  await until("the innovation", async () => (await page.locator(".figure canvas").count()) >= 1);
  await page.keyboard.press("Escape");
  await goTo(page, "bench");
  await until("the run is over", async () => (await state(page)) === "Armed");
});

test("what guards what, and how late the loop is, are told with their numbers", async () => {
  await page.getByText("What guards what").click();
  await until("the guard of the speed", async () => /limits\.omega/.test(await page.locator("details[open] ul").first().innerText()));
  await page.getByText("The loop: lateness and real time").click();
  await page.getByRole("button", {name: "Numbers of Lateness of the loop"}).click();
  await until("the histogram's numbers", async () => (await page.locator("details[open] .numbers tbody tr").count()) > 3);
  expect(isPng(await saved(page, page.getByRole("button", {name: "PNG of Lateness of the loop"}))), "its PNG is none");
});

test("a tab in the background does not end its run", async () => {
  const other = await newPage();
  await open(other, served.url, "bench");
  await until("ready", async () => (await state(other)) === "Armed");
  await startRun(other, "fh2_step_low");
  const devtools = await other.context().newCDPSession(other);
  await devtools.send("Page.setWebLifecycleState", {state: "frozen"});  // none of its scripts is run any more
  await page.waitForTimeout(4500);  // longer than a lost page's 3 s
  expect((await state(page)) === "Running", `the bench is ${await state(page)}`);
  await devtools.send("Page.setWebLifecycleState", {state: "active"});
  await other.locator(".stop").click();
  await until("the run is over", async () => (await state(page)) === "Armed");
  await other.context().close();
});

test("a page that is left in mid-run asks first; its run has lost its client", async () => {
  const other = await newPage();
  await open(other, served.url, "bench");
  await until("ready", async () => (await state(other)) === "Armed");
  expect(other.leaving === 0, "it asks without a run");
  await startRun(other, "fh2_step_low");
  await other.reload();
  expect(other.leaving === 1, `it asked ${other.leaving} times`);
  await until("the fault is named", async () => /client_lost/.test(await page.locator(".fault-bar").first().innerText().catch(() => "")));
  await other.context().close();
  await arm(page);
});

test("a restart of the daemon is told and overcome", async () => {
  await bench.stop();
  await until("the page says that the daemon is gone", async () => /emtbd/.test(await page.locator(".fault-bar").first().innerText().catch(() => "")));
  await bench.start();
  await until("the page sees the new daemon", async () => (await state(page)) === "Latched");
});

test("a lost connection greys the values with their age, and STOP says that nothing answers", async () => {
  await until("readings", async () => Number.isFinite(await value(page, 1)));
  served.child.kill("SIGSTOP");  // a server that does not answer, rather than one that is gone
  await page.locator(".lost-bar").waitFor();
  expect(/old/.test(await page.locator(".lost-bar").innerText()), "the age of what is shown is not said");
  await page.locator(".stop").click();
  await until("STOP tells the truth", async () => /NO ANSWER/.test(await page.locator(".stop").innerText()));
  served.child.kill("SIGCONT");
  await until("the connection comes back", async () => page.locator(".lost-bar").isHidden());
});

test("nothing broke in the page meanwhile", async () => expect(page.wrong.length === 0, page.wrong.join("\n")));

await runAll(async () => {
  fs.mkdirSync(path.join(folder, "profiles"));
  fs.writeFileSync(path.join(folder, "profiles/fh2_ask.yaml"), `name: fh2_ask\nkind: step\nlevel: 1\nbefore: 1\nhold: 1\nafter: 1\nneeds: {at_rest: true}\npauses: [{at: 0.5, say: "set the brake to <b>2 A</b>"}]\n`);
  bench = await new Bench(benchFile("bench.yaml")).start();
  served = await servePage([], ["--socket", bench.socket]);
  page = await newPage();
});
