// A motor with friction that no effect of the library is: what is left is told with a law, and the law is added.
import {axe, expect, newPage, number, open, runAll, serveHump, test, until} from "./harness.mjs";

let page;
const errorHeldOut = () => number(page, "#error-held-out");

test("what no effect explains is told, with a law and its picture", async () => {
  await page.locator("#diagnose").click();
  await page.locator("#discovered").waitFor({timeout: 200_000});
  await page.locator("#discovered canvas").waitFor();
  await page.getByRole("button", {name: "Numbers of The law against"}).click();
  await until("the law's numbers", async () => (await page.locator("#discovered .numbers tbody tr").count()) > 10);
  expect(/speed|omega/.test(await page.locator("#discovered").innerText()), "the card does not say over what the rest lives");
  const violations = await axe(page);
  expect(violations === "", violations);
});

test("the error of the fitted model is one number in verdict, panel and law", async () => {
  const panel = await page.locator("#error-held-out").innerText();
  const verdict = await page.locator("section[aria-label=Verdict]").innerText();
  const law = /Error held out\s+(\S+) →/.exec(await page.locator("#discovered").innerText())?.[1];
  expect(verdict.includes(`${panel} noise floors`), `the panel says ${panel}; the verdict: ${verdict}`);
  expect(law === panel, `the panel says ${panel}, the law ${law}`);
});

test("adding the law makes the error fall; undo brings it back", async () => {
  const before = await errorHeldOut();
  await page.locator("#add-law").click();
  await until("the error falls to less than half", async () => (await errorHeldOut()) < 0.5 * before, 90_000);
  await page.locator("#undo").click();
  await until("the error from before", async () => Math.abs((await errorHeldOut()) - before) < 0.02 * before);
});

test("nothing broke in the page meanwhile", async () => expect(page.wrong.length === 0, page.wrong.join("\n")));

await runAll(async () => {
  const served = await serveHump();
  page = await newPage();
  await open(page, served.url, "diagnose");
});
