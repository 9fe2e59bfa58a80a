// A motor with friction that no effect of the library is: what is left is told with a law, and the law is added.
import fs from "node:fs";
import path from "node:path";
import {axe, emtb, expect, folder, newPage, number, open, root, runAll, servePage, test, until} from "./harness.mjs";

/// A session of a motor that drags most around 70 rad/s.
function humped(profile) {
  const linear = fs.readFileSync(path.join(root, "config/models/fh2.yaml"), "utf8");
  const hump = '{torque: "-a*tanh(omega/2)*exp(-((abs(omega) - 70)/15)^2)", parameters: {a: {value: 0.05, min: 0, max: 1, unit: N m}}}';
  if (!/^effects: \{\}$/m.test(linear)) throw new Error("the shipped model has effects");
  const truth = path.join(folder, "truth.yaml"), session = path.join(folder, `${profile}.csv`);
  fs.writeFileSync(truth, linear.replace(/^effects: \{\}$/m, `effects:\n  hump: ${hump}`));
  emtb("simulate", truth, profile, "--rate", "50", "--out", session);
  return session;
}

let page;
const errorHeldOut = () => number(page, "#error-held-out");

test("what no effect explains is told, with a law and its picture", async () => {
  await page.locator("#diagnose").click();
  await page.locator("#discovered").waitFor({timeout: 200_000});
  await page.locator("#discovered svg").first().waitFor();
  expect(/speed|omega/.test(await page.locator("#discovered").innerText()), "the card does not say over what the rest lives");
  const violations = await axe(page);
  expect(violations === "", violations);
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
  const [ramp, random, mid, low] = ["fh2_ramp", "fh2_random", "fh2_step_mid", "fh2_step_low"].map(humped);
  const served = await servePage([path.join(root, "config/models/fh2.yaml"), ramp, random, "--held-out", mid, low]);
  page = await newPage();
  await open(page, served.url, "diagnose");
});
