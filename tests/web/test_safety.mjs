// What must not happen: a foreign page that moves the motor, a name that is run, a fault that is not told.
import fs from "node:fs";
import http from "node:http";
import net from "node:net";
import path from "node:path";
import {axe, Bench, benchFile, expect, folder, goTo, newPage, open, recordStory, root, runAll, servePage, test, until} from "./harness.mjs";

let bench, served, page, sessions;
const hostile = '<img src=x onerror="window.broken=1">';

/// What a socket opened by a page of another origin comes to: "open" or "closed".
function socketFrom(p, url) {
  return p.evaluate((address) => new Promise((resolve) => {
    const socket = new WebSocket(address);
    socket.onopen = () => resolve("open");
    socket.onclose = socket.onerror = () => resolve("closed");
  }), url);
}

test("a page of another origin gets no socket and no answer", async () => {
  const server = http.createServer((_request, response) => response.setHeader("Content-Type", "text/html").end("<h1>elsewhere</h1>"));
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const other = await newPage();
  await other.goto(`http://127.0.0.1:${server.address().port}/`);
  expect((await socketFrom(other, served.origin.replace("http", "ws") + "/ws")) === "closed", "a foreign page opened the socket");
  await other.context().close();
  server.close();
});

test("a request with a foreign Host is refused", async () => {
  const {hostname, port} = new URL(served.origin);
  const status = await new Promise((resolve, reject) => http.get({hostname, port, path: "/", headers: {Host: "evil.example"}}, (r) => resolve(r.statusCode)).on("error", reject));
  expect(status >= 400, `answered with ${status}`);
});

test("through a forwarder at another port the page works", async () => {
  const {port} = new URL(served.origin);
  const forwarder = net.createServer((near) => {
    const far = net.connect(Number(port), "127.0.0.1");
    near.pipe(far).pipe(near);
    for (const end of [near, far]) end.on("error", () => { near.destroy(); far.destroy(); });
  });
  await new Promise((resolve) => forwarder.listen(0, "127.0.0.1", resolve));
  const other = await newPage();
  await open(other, served.url.replace(/:\d+\//, `:${forwarder.address().port}/`).replace("127.0.0.1", "localhost"));
  await until("the page is connected", async () => (await other.locator(".link").innerText()) === "connected");
  await other.context().close();
  forwarder.close();
});

test("without the token nothing is told, and STOP works all the same", async () => {
  const other = await newPage();
  await other.goto(served.origin + "/");
  await until("the page says that it was refused", async () => /refused/.test(await other.locator(".link").innerText()));
  const answer = await other.evaluate(() => fetch("/stop", {method: "POST"}).then((r) => r.json()));
  expect(answer.reference_safe === true, `stop answered ${JSON.stringify(answer)}`);
  await other.context().close();
});

test("a server of another version is told from one that is lost", async () => {
  const other = await newPage();
  await other.routeWebSocket(/\/ws$/, (near) => {
    const far = near.connectToServer();
    far.onMessage((message) => near.send(String(message).replace('"protocol":1', '"protocol":2')));
  });
  await other.goto(served.url);
  await until("the page says so", async () => /speaks protocol 1, the server 2/.test(await other.locator(".lost-bar").innerText().catch(() => "")));
  await other.context().close();
});

test("the policy forbids scripts in the page, and the answers say so", async () => {
  const response = await page.request.get(served.origin + "/");
  const policy = response.headers()["content-security-policy"] ?? "";
  expect(policy && !/unsafe-inline|unsafe-eval/.test(policy), `the policy is: ${policy}`);
});

test("a hostile name of a session is shown as text", async () => {
  await open(page, served.url, "sessions");
  await until("the name is there, as text", async () => (await page.locator("main").innerText()).includes("<img"));
  expect((await page.evaluate(() => window.broken)) === undefined, "the name was run");
  expect((await page.locator("main img").count()) === 0, "the name became an element");
  await goTo(page, "compare");
  await until("the name is among the runs", async () => (await page.locator("main select").first().innerText()).includes("<img"));
  expect((await page.evaluate(() => window.broken)) === undefined, "the name was run");
});

test("a fault in mid-run is named, announced once, and its black box is shown", async () => {
  await goTo(page, "bench");
  await page.locator("#arm").click();
  await page.locator("dialog").getByRole("button", {name: "Arm"}).click();
  await page.locator("#profile").selectOption("fh2_step_high");
  await until("the start is allowed", () => page.locator("#start").isEnabled());
  await page.locator("#start").click();
  await page.locator("dialog").getByRole("button", {name: "Start the run"}).click();
  await until("the fault is named", async () => /over_speed/.test(await page.locator(".fault-bar").first().innerText().catch(() => "")));
  expect(/over_speed/.test(await page.locator("#announcer").innerText()), "the fault was not announced");
  await until("the black box is drawn", async () => (await page.getByRole("heading", {name: /^Black box/}).isVisible()) && (await page.locator(".black-box canvas").count()) > 0);
  const violations = await axe(page);
  expect(violations === "", violations);
});

test("nothing broke in the page meanwhile", async () => expect(page.wrong.length === 0, page.wrong.join("\n")));

await runAll(async () => {
  sessions = await recordStory(["step_low"]);
  const copy = path.join(folder, `${hostile.replaceAll("/", "")}.h5`);
  fs.copyFileSync(sessions.step_low, copy);
  bench = await new Bench(benchFile("low.yaml", [["omega: 190", "omega: 30"]])).start();
  served = await servePage([path.join(root, "config/models/fh2.yaml"), copy], ["--socket", bench.socket]);
  page = await newPage();
});
