// The bench, live: every signal, what state it is in, who controls, and how a run is begun.

import {bench, Channel, windows} from "../bench";
import {h, isSymbol, put, setText, signalWords, symbol} from "../dom";
import {duration, reading, unitText} from "../numbers";
import {Plot} from "../plot";
import {View} from "../view";
import {details} from "./bench_details";
import {runPanel} from "./bench_run";

/// One signal: its newest value in large, and its strip.
class Strip {
  readonly element: HTMLElement;
  readonly plot: Plot;
  private readonly value = h("span", {class: "value"});
  private readonly unit = h("span", {class: "unit"});
  private readonly age = h("span", {class: "age"});

  constructor(private readonly channel: Channel, last: boolean) {
    this.plot = new Plot({
      title: signalWords(channel.signal), about: "the last readings, over the seconds before now", bare: true, height: last ? 104 : 82, noTime: !last,
      x: {name: "t", unit: "s"}, y: {name: channel.signal, unit: channel.unit}, smallest: smallest(channel.unit), zero: true,
    });
    this.element = h("div", {class: "strip"}, h("div", {class: "now ages"}, h("span", {class: "small muted"}, signalWords(channel.signal), " ", isSymbol(channel.signal) ? symbol(channel.signal) : null),
      h("span", {}, this.value, " ", this.unit), this.age, this.plot.tools), this.plot.element);
  }

  draw(): void {
    const trail = bench.trails.get(this.channel.signal);
    if (!trail) return;
    const now = bench.clock();
    const {x, low, high} = trail.view(now - bench.span, 900, now);
    this.plot.show([{label: "", ink: "model", x, y: low, high, width: 1.2, as: "envelope"}], [-bench.span, 0]);
  }

  write(): void {
    const last = bench.newest.get(this.channel.signal);
    const value = last?.value ?? null;
    const scale = this.plot.scale, shown = this.plot.size * scale.factor;
    setText(this.value, reading(value, scale, shown >= 100 ? 1 : shown >= 10 ? 2 : 3));
    setText(this.unit, scale.unit || unitText(this.channel.unit));
    const age = bench.age(this.channel.signal);
    const old = age > Math.max(1.5, 4 * this.channel.period);
    setText(this.age, value === null ? "no reading yet" : old ? `${duration(age)} old` : "");
    this.element.classList.toggle("old", old);
  }

  destroy(): void {
    this.plot.destroy();
  }
}

/// A range that noise alone does not fill.
function smallest(unit: string): number {
  const sizes: {[unit: string]: number} = {V: 1, "rad/s": 5, A: 0.05, "N m": 0.05, degC: 2};
  return sizes[unit] ?? 0;
}

function strips(): {element: HTMLElement; close: () => void} {
  let list: Strip[] = [], of = "", frame = 0, due = 0;
  const host = h("div", {class: "strips"});
  const dropped = h("span", {class: "muted small"});
  const buttons = windows.map((span) => h("button", {class: "quiet", onclick: () => bench.watch(span)}, duration(span).replace(/\.0/, "").replace(/\u00a000\u00a0s/, "")));
  const pause = h("button", {class: "quiet", "aria-pressed": "false", onclick: () => pause.setAttribute("aria-pressed", String(!paused()))}, "Freeze");
  const tools = h("button", {class: "quiet", "aria-pressed": "false", "aria-label": "Numbers, PNG and CSV of the signals", onclick: () => tools.setAttribute("aria-pressed", String(host.classList.toggle("with-tools")))}, "Export");
  const paused = () => pause.getAttribute("aria-pressed") === "true";

  const change = () => {
    const names = bench.channels.map((c) => c.signal).join();
    if (names !== of) {
      of = names;
      list.forEach((s) => s.destroy());
      list = bench.channels.map((channel, n) => new Strip(channel, n === bench.channels.length - 1));
      put(host, ...list.map((s) => s.element));
    }
    buttons.forEach((button, n) => button.setAttribute("aria-pressed", String(windows[n] === bench.span)));
    setText(dropped, bench.dropped ? `${bench.dropped} samples did not reach this page; the recording has them` : "");
  };
  const draw = (at: number) => {
    frame = requestAnimationFrame(draw);
    if (at < due || paused()) return;
    const period = Math.max(32, 0.8 * bench.span);  // [ms] 30 times a second; with long spans half a pixel of movement
    due = Math.max(due + period, at - period);  // what comes late does not put off the next
    for (const strip of list) strip.draw();
  };
  const values = setInterval(() => paused() || list.forEach((s) => s.write()), 150);
  const forget = bench.onChange(change);
  change();
  frame = requestAnimationFrame(draw);
  const element = h("section", {class: "panel", "aria-label": "Signals"},
    h("div", {class: "head"}, h("h2", {}, "Signals"), h("span", {class: "muted small"}, "seconds before now"), h("span", {class: "grow"}), dropped, ...buttons, pause, tools), host);
  return {element, close: () => {
    cancelAnimationFrame(frame);
    clearInterval(values);
    forget();
    list.forEach((s) => s.destroy());
  }};
}

const stateWords: {[state: string]: string} = {
  latched: "Latched", arming: "Arming", armed: "Armed", running: "Running", "": "Unknown",
};
const stateHelp: {[state: string]: string} = {
  latched: "The reference is held at its safe value. See that the bench is safe, then arm it.",
  arming: "Every signal is read once.", armed: "Ready for a run.", running: "The motor may turn.", "": "emtbd does not answer.",
};

function statePanel(): {element: HTMLElement; close: () => void} {
  const state = h("div", {class: "state", id: "state"}, h("span", {class: "lamp", "aria-hidden": "true"}), h("span", {class: "word"}));
  const help = h("p", {class: "muted small"});
  const facts = h("dl", {class: "facts"});
  const change = () => {
    state.className = `state ${bench.state}`;
    setText(state.lastElementChild as Element, stateWords[bench.state] ?? bench.state);
    setText(help, stateHelp[bench.state] ?? "");
    const controller = bench.run?.controller;
    const others = (bench.status?.clients ?? []).length;
    put(facts,
      h("dt", {}, "Fault"), h("dd", {}, bench.fault ? `${bench.fault.code} ${bench.fault.name}: ${bench.fault.text}` : "none"),
      h("dt", {}, "Output"), h("dd", {class: bench.status && !bench.status.reference_safe ? "bad" : ""}, bench.status ? (bench.status.reference_safe ? "obeys" : "REFUSES: switch the driver off") : "–"),
      h("dt", {}, "Control"), h("dd", {id: "controller"}, controller ? `${controller.user}${bench.controls() ? ", this page" : `, process ${controller.pid}`}` : "nobody; whoever starts a run"),
      h("dt", {}, "Connected"), h("dd", {}, others ? `${others} ${others === 1 ? "client" : "clients"}` : "–"));
  };
  const forget = bench.onChange(change);
  change();
  return {element: h("section", {class: "panel stack ages", "aria-label": "State"}, state, help, facts), close: forget};
}

export const benchView: View = {
  id: "bench", title: "Bench", needs: "bench",
  show(main) {
    const parts = [strips(), statePanel(), runPanel(), details()];
    const [signals, state, run, more] = parts;
    main.append(h("h1", {class: "only-read"}, "Bench"),
      h("div", {class: "two with-more"}, signals.element, h("div", {class: "stack sticky"}, state.element, run.element), more.element));
    return () => parts.forEach((part) => part.close());
  },
};
