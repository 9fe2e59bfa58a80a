// The frame: the bar with the views, the state of the connection, and STOP.

import {bench} from "./bench";
import {notice, startNotices} from "./dialog";
import {h, put, setText} from "./dom";
import {duration} from "./numbers";
import {rpc} from "./rpc";
import {startStop, stopButton} from "./stop";
import {isDark, onTheme, startTheme, toggleTheme} from "./theme";
import {View} from "./view";
import {benchView} from "./views/bench";
import {compareView} from "./views/compare";
import {diagnoseView} from "./views/diagnose";
import {estimatesView, followEstimates} from "./views/estimates";
import {formulaView} from "./views/formula";
import {reportView} from "./views/report";
import {sessionsView} from "./views/sessions";
import {work} from "./work";

const views: View[] = [benchView, estimatesView, compareView, diagnoseView, formulaView, sessionsView, reportView];

const nav = h("nav", {class: "views", "aria-label": "Views"});
const main = h("main", {id: "main", tabindex: "-1"});
const what = h("span", {class: "what"});
const link = h("span", {class: "link", role: "status"}, "connecting");
const lostBar = h("div", {class: "lost-bar", hidden: true, role: "alert"});
const faultBar = h("div", {class: "fault-bar", hidden: true});
const promptSay = h("span", {});
const promptBar = h("div", {class: "fault-bar prompt-bar", role: "alert", hidden: true}, promptSay, h("a", {href: "#bench"}, "To the bench"));
const theme = h("button", {class: "quiet", onclick: toggleTheme});
const stop = stopButton();
let leave: () => void = () => undefined;
let current: View | null = null;

function available(): View[] {
  return views.filter((view) => view.needs === "any" || (view.needs === "bench" ? bench.present : work.present));
}

function wanted(): View {
  const id = location.hash.replace(/^#/, "").split("?")[0];
  const list = available();
  return list.find((view) => view.id === id) ?? list[0] ?? views[0];
}

function navigate(): void {
  if (!rpc.hello) return;
  const view = wanted();
  put(nav, ...available().map((v) => h("a", {href: `#${v.id}`, "aria-current": v === view ? "page" : null}, v.title)));
  if (view === current) return;
  leave();
  current = view;
  main.textContent = "";
  main.className = `view-${view.id}`;
  document.title = `${view.title} – emtb ${what.textContent ?? ""}`.trim();
  leave = view.show(main);
  showPrompt();
  window.scrollTo(0, 0);
}

function showLink(): void {
  const state = rpc.state;
  link.className = state === "open" ? "link" : "link lost";
  setText(link, {connecting: "connecting", open: "connected", lost: "connection lost", refused: "refused"}[state]);
  document.documentElement.classList.toggle("stale", state !== "open");
  lostBar.hidden = state === "open" || state === "connecting";
  showLost();
}

function showLost(): void {
  if (lostBar.hidden) return;
  const age = rpc.lastHeard ? ` What stands here is ${duration((performance.now() - rpc.lastHeard) / 1000)} old.` : "";
  if (rpc.state === "refused") setText(lostBar, rpc.why || "The server refused this page.");
  else setText(lostBar, `The connection to emtb page is lost; trying again.${age}${bench.present ? " STOP is asked for by a way of its own." : ""}`);
}

function showBench(): void {
  stop.hidden = !bench.present;
  faultBar.hidden = !bench.daemonLost && !bench.fault;
  if (bench.daemonLost) put(faultBar, h("b", {}, "emtbd does not answer."), bench.daemonLost);
  else if (bench.fault) put(faultBar, h("b", {}, `${bench.fault.code} ${bench.fault.name}`), h("span", {}, bench.fault.text));
  setText(what, bench.present ? bench.name : work.name);
  showPrompt();
}

/// A run that waits for its operator says so in the other views, too.
function showPrompt(): void {
  const pause = bench.run?.pause;
  promptBar.hidden = !pause || current?.id === "bench";
  if (pause) setText(promptSay, `${bench.run?.profile} waits for you: ${pause.say}`);
}

function frame(): void {
  put(document.body, h("a", {class: "skip", href: "#main", onclick: (event: Event) => {
    event.preventDefault();
    main.focus();
  }}, "To the content"),
    h("header", {class: "bar"}, h("div", {class: "brand"}, h("b", {}, "emtb"), what), nav, h("div", {class: "right"}, link, theme, stop)),
    lostBar, faultBar, promptBar, main, startNotices());
  const label = () => {
    setText(theme, isDark() ? "Light" : "Dark");
    theme.setAttribute("aria-label", isDark() ? "Use light colours" : "Use dark colours");
  };
  onTheme(label);
  label();
}

function start(): void {
  startTheme();
  frame();
  stop.hidden = true;
  startStop(() => bench.runIsOn());
  followEstimates();
  window.addEventListener("hashchange", navigate);
  window.addEventListener("beforeunload", (event) => {
    if (!bench.runIsOn()) return;
    event.preventDefault();
    event.returnValue = "A run is on. Leaving the page ends it, if this page began it.";
  });
  rpc.on("link", () => {
    showLink();
    if (rpc.state !== "open") return;
    bench.begin();
    work.begin().then(navigate, (error) => {
      notice(String(error.message ?? error), true);
      navigate();
    });
  });
  rpc.on("worker_died", (p) => notice(p?.text ?? "The process that computes for this page died; it was started anew.", true));
  bench.onChange(showBench);
  work.onChange(showBench);
  setInterval(showLost, 500);
  rpc.start();
}

start();
