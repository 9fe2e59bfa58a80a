// What the page knows of the bench: state, fault, run, who controls, and the last minutes of every signal.

import {announce} from "./dialog";
import {Changing, Trail} from "./live_store";
import {rpc} from "./rpc";

export interface Fault {
  code: number;
  name: string;
  text: string;
}

export interface Run {
  id: number;
  profile: string;
  t: number;
  done?: number;  // [s] of the profile, which waits with its operator; an older daemon does not say it
  duration: number;
  session: string;
  controller: {user: string; pid: number} | null;
  pause: {number: number; say: string; within: number} | null;
}

export interface Channel {
  signal: string;
  unit: string;
  period: number;
  window: number;
}

export const windows = [10, 60, 600];  // [s] that the strips can show
const binsShown = 700;

export class Bench extends Changing {
  present = false;
  name = "";
  mayMove = false;
  daemonLost = "";
  status: any = null;
  config: any = null;
  channels: Channel[] = [];
  state = "";
  fault: Fault | null = null;
  run: Run | null = null;
  ended: any = null;
  ownRun: number | null = null;  ///< the run that this page began
  span = windows[0];
  dropped = 0;
  readonly trails = new Map<string, Trail>();
  readonly newest = new Map<string, {t: number; value: number}>();
  now = 0;  ///< the bench's clock [s] at the newest sample
  private nowAt = 0;
  private told = "";

  constructor() {
    super();
    rpc.on("samples", (params) => this.takeSamples(params));
    rpc.on("live", (params) => this.takeLive(params));
    rpc.on("ended", (params) => {
      this.ended = params;
      this.refresh();
    });
    rpc.on("daemon", (params) => this.takeDaemon(params));
    setInterval(() => this.present && rpc.state === "open" && this.refresh(), 1000);
  }

  /// The connection to the server stands (anew).
  begin(): void {
    this.present = Boolean(rpc.hello?.bench);
    this.mayMove = Boolean(rpc.hello?.may_move);
    if (!this.present) return this.changed();
    this.daemonLost = rpc.hello.daemon === false ? "Trying again." : "";
    if (!this.daemonLost) this.meet();
    this.changed();
  }

  /// The daemon is there (anew): what it measures, what it has seen, and from now on its samples.
  private meet(): void {
    rpc.call("config").then((config) => {
      this.config = config;
      this.name = config.bench;
      this.channels = config.channels;
      this.changed();
      this.watch(this.span);
    }, () => undefined);
    rpc.call("subscribe", {rate: 10}).catch(() => undefined);
    this.refresh();
  }

  /// Shows the last `span` seconds: history first, then bins as they come.
  watch(span: number): void {
    this.span = span;
    const bin = span / binsShown;
    rpc.call("history", {last: span, points: binsShown}).then((history) => {
      for (const trail of this.trails.values()) trail.clear();
      this.takeSamples(history);
    }, () => undefined).then(() => rpc.call("samples", {bin}).catch(() => undefined));
    this.changed();
  }

  refresh(): void {
    rpc.call("status").then((status) => {
      this.status = status;
      this.name = status.bench || this.name;
      this.daemonLost = "";
      this.takeState(status.state, status.fault);
      this.run = status.run;
      this.changed();
    }, () => undefined);
  }

  /// Whether this page began the run that is on: when the page goes, that run ends.
  controls(): boolean {
    return this.run !== null && this.run.id === this.ownRun;
  }

  runIsOn(): boolean {
    return this.present && (this.state === "running" || this.state === "arming");
  }

  /// Seconds since a signal's newest reading.
  age(signal: string): number {
    const last = this.newest.get(signal);
    return last ? this.now - last.t + (performance.now() - this.nowAt) / 1000 : Infinity;
  }

  /// The bench's clock now, going on between samples so that the strips move evenly.
  clock(): number {
    return this.now + Math.min(0.3, (performance.now() - this.nowAt) / 1000);
  }

  private takeSamples(params: any): void {
    this.dropped += params.dropped ?? 0;
    for (const [signal, bins] of Object.entries<any>(params.signals ?? {})) {
      const trail = this.trails.get(signal) ?? new Trail();
      this.trails.set(signal, trail);
      const low = bins.min ?? bins.value, high = bins.max ?? bins.value;
      for (let n = 0; n < bins.t.length; ++n) {
        if (low[n] === null) continue;
        trail.push(bins.t[n], low[n], high[n]);
      }
      const end = bins.t.length - 1;
      if (end >= 0 && low[end] !== null) {
        const value = bins.last ? bins.last[end] : (low[end] + high[end]) / 2;
        this.newest.set(signal, {t: bins.t[end], value});
        if (bins.t[end] > this.now || bins.t[end] < this.now - 5) {
          this.now = bins.t[end];
          this.nowAt = performance.now();
        }
      }
    }
  }

  private takeLive(params: any): void {
    this.takeState(params.state, params.fault);
    if (params.run && this.run && typeof params.run === "object") this.run = {...this.run, ...params.run};
    this.changed();
  }

  private takeDaemon(params: any): void {
    this.daemonLost = params.connected ? "" : params.text || "Trying again.";
    if (params.connected) this.meet();
    else this.run = null;
    if (!params.connected) this.state = "";
    this.changed();
  }

  /// A fault is told once to those who listen.
  private takeState(state: string, fault: Fault | null): void {
    this.state = state;
    this.fault = fault;
    const words = fault ? `Fault ${fault.code}, ${fault.name}: ${fault.text}` : "";
    if (words && words !== this.told) announce(words);
    this.told = words;
  }
}

export const bench = new Bench();
