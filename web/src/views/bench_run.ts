// A run: which profile, what it needs, the question before anything moves, and how far it is.

import {bench} from "../bench";
import {ask, failed, notice} from "../dialog";
import {h, put, setText} from "../dom";
import {duration, plain} from "../numbers";
import {Plot} from "../plot";
import {rpc} from "../rpc";
import {stopButton} from "../stop";

interface Profile {
  name: string;
  kind: string;
  duration: number;
  t: number[];
  u_ref: number[];
  needs: {[what: string]: number | boolean};
  pauses: {at: number; say: string}[];
  refused?: string;
}

const needWords: {[need: string]: (value: any) => string} = {
  at_rest: () => "the motor is at rest", field: () => "the field is on",
  idle: (minutes) => `no run for ${minutes} min`, temperature: (below) => `temperature below ${below} °C`,
};

function needs(profile: Profile): HTMLElement {
  const lines = Object.entries(profile.needs ?? {}).filter(([, value]) => value !== false && value !== null)
    .map(([what, value]) => h("li", {}, needWords[what]?.(value) ?? `${what}: ${value}`));
  const pauses = (profile.pauses ?? []).map((pause) => h("li", {}, `at ${duration(pause.at)} it waits for you: ${pause.say}`));
  return lines.length + pauses.length ? h("ul", {class: "small"}, ...lines, ...pauses) : h("p", {class: "muted small"}, "It needs nothing beforehand.");
}

export function runPanel(): {element: HTMLElement; close: () => void} {
  let profile: Profile | null = null;
  let loaded = false;
  const select = h("select", {id: "profile", onchange: () => choose()});
  const preview = new Plot({title: "Preview of the reference", about: "the reference over the time of the run", bare: true, height: 110, x: {name: "t", unit: "s"}, y: {name: "u_ref", unit: "V"}, zero: true});
  const about = h("div", {class: "stack"});
  const note = h("input", {type: "text", maxlength: "500", autocomplete: "off"});
  const brake = h("input", {type: "text", maxlength: "100", autocomplete: "off", placeholder: "e.g. released"});
  const start = h("button", {class: "main", id: "start", onclick: () => begin()}, "Start run …");
  const arm = h("button", {id: "arm", onclick: () => armBench()}, "Arm …");
  const why = h("p", {class: "muted small", id: "start-why"});
  const form = h("div", {class: "stack"}, h("label", {class: "field"}, "Profile", select), h("div", {}, preview.element, h("div", {class: "figure"}, h("header", {}, preview.tools))), about,
    h("div", {class: "row"}, start, arm), why,
    h("details", {}, h("summary", {}, "Note and brake ", h("span", {class: "muted"}, "kept in the session")), h("div", {class: "stack"}, h("label", {class: "field"}, "Note", note), h("label", {class: "field"}, "Brake", brake))));
  // Built once, so that a click or the focus is not lost while the run goes on.
  const which = h("b", {}), howFar = h("span", {}), bar = h("progress", {max: 1, "aria-label": "Progress of the run"}), sessionFile = h("p", {class: "muted small mono"});
  const say = h("p", {class: "verdict"}), within = h("p", {class: "muted small"});
  const goOn = h("button", {class: "main", id: "confirm", onclick: () => confirm()}, "Done, go on");
  const prompt = h("div", {class: "stack prompt", role: "alert", hidden: true}, say, within, goOn);
  const running = h("div", {class: "stack", hidden: true}, h("p", {}, which, howFar), bar, prompt, sessionFile);
  let confirmed = "";  // the pause that is answered already
  const last = h("div", {class: "small"});

  async function choose(): Promise<void> {
    if (!select.value) return;
    const name = select.value;
    profile = null;  // what is shown and asked for is one profile, never the one before
    change();
    try {
      const answer: Profile = await rpc.call("profile", {profile: name});
      if (select.value !== name) return;
      profile = answer;
      preview.show([{label: "", ink: "base", x: answer.t, y: answer.u_ref}]);
      put(about, h("p", {class: "small"}, `${answer.kind.replace(/_/g, " ")}, ${duration(answer.duration)}, up to ${plain(Math.max(...answer.u_ref.map(Math.abs)), 3)} V`),
        answer.refused ? h("p", {class: "bad small"}, answer.refused) : needs(answer));
    } catch (error) {
      profile = null;
      put(about, h("p", {class: "bad small"}, String((error as Error).message)));
    }
    change();
  }

  async function load(): Promise<void> {
    loaded = true;
    try {
      const answer = await rpc.call("profiles");
      const names: string[] = answer.profiles.map((p: any) => (typeof p === "string" ? p : p.name));
      put(select, ...names.map((name) => h("option", {value: name}, name)));
      const family = bench.name.split(/[-_]/)[0];  // profiles are named after the bench that they are for
      select.value = names.find((name) => name.startsWith(`${family}_`)) ?? names[0] ?? "";
      await choose();
    } catch (error) {
      loaded = false;
      put(about, h("p", {class: "bad small"}, String((error as Error).message)));
    }
  }

  async function begin(): Promise<void> {
    if (!profile) return;
    const yes = await ask(`Start ${profile.name} on ${bench.name}?`, [
      h("p", {}, "The motor will turn. ", h("b", {}, profile.name), ` on the bench `, h("b", {}, bench.name), ` lasts ${duration(profile.duration)}; the reference goes up to ${plain(Math.max(...profile.u_ref.map(Math.abs)), 3)} V.`),
      needs(profile), h("p", {class: "muted small"}, "Esc or STOP ends it at any time. An interlock and an emergency stop are needed all the same."),
    ], "Start the run", stopButton());
    if (!yes || !profile) return;
    try {
      const answer = await rpc.call("run", {profile: profile.name, note: note.value, ...(brake.value ? {brake: brake.value} : {})});
      bench.ownRun = answer.run;
      bench.ended = null;
    } catch (error) {
      failed(error);
    }
    bench.refresh();
  }

  async function armBench(): Promise<void> {
    if (!(await ask(`Arm ${bench.name}?`, [h("p", {}, "From then on a run may be started on the bench ", h("b", {}, bench.name), ". See that nobody is near the shaft.")], "Arm", stopButton()))) return;
    rpc.call("reset").then(() => bench.refresh(), failed);
  }

  function showRun(): void {
    const run = bench.run;
    running.hidden = !run;
    form.hidden = Boolean(run) && bench.runIsOn();
    prompt.hidden = !run?.pause;
    if (!run) return;
    setText(which, run.profile);
    const done = Math.min(run.duration, run.done ?? run.t);
    setText(howFar, `${run.pause ? " waits for you at" : " is running,"} ${duration(done)} of ${duration(run.duration)}`);
    bar.value = run.duration > 0 ? done / run.duration : 0;
    setText(sessionFile, run.session);
    if (!run.pause) return;
    setText(say, run.pause.say);
    setText(within, `The reference is held. Without an answer within ${duration(run.pause.within).replace("\u00a000\u00a0s", "")} the run ends.`);
    goOn.disabled = !bench.mayMove || rpc.state !== "open" || confirmed === `${run.id} ${run.pause.number}`;
  }

  /// What the operator was asked to do is done.
  function confirm(): void {
    confirmed = bench.run?.pause ? `${bench.run.id} ${bench.run.pause.number}` : "";
    goOn.disabled = true;
    rpc.call("confirm").catch((error) => {
      confirmed = "";
      failed(error);
    }).finally(() => bench.refresh());
  }

  function showLast(): void {
    const ended = bench.ended ?? bench.status?.last_run;
    const words: {[outcome: string]: string} = {done: "is done", stopped: "was stopped", fault: "ended with a fault"};
    put(last, !ended || bench.run ? null : h("p", {id: "last-run"}, "Last run: ", h("b", {}, ended.profile), ` ${words[ended.outcome] ?? ended.outcome}`,
      ended.fault ? `: ${ended.fault.code} ${ended.fault.name}` : "", ` after ${duration(ended.t)}.`, ended.complete === false ? " Its recording has gaps." : "",
      h("br"), h("span", {class: "mono muted"}, ended.session)));
  }

  function change(): void {
    if (!loaded && !bench.daemonLost && bench.config) load();
    const busy = bench.runIsOn();
    const reason = !bench.mayMove ? "This page may look and stop, not move: it was opened without the token or from another computer."
      : bench.daemonLost ? "emtbd does not answer." : bench.state === "latched" ? (bench.run ? "The run is being brought to its end." : "The bench is latched: arm it first.") : !profile ? "Choose a profile." : profile.refused ?? "";
    start.disabled = busy || Boolean(reason) || rpc.state !== "open" || bench.run !== null;
    arm.hidden = bench.state !== "latched";
    arm.disabled = !bench.mayMove || rpc.state !== "open" || bench.run !== null;
    start.className = bench.state === "latched" ? "" : "main";
    arm.className = bench.state === "latched" ? "main" : "";
    setText(why, busy ? "" : reason);
    showRun();
    showLast();
  }

  const forget = bench.onChange(change);
  const ended = rpc.on("ended", (p) => p.outcome === "done" && notice(`${p.profile} is done: ${p.session}`));
  change();
  return {
    element: h("section", {class: "panel stack", "aria-label": "Run"}, h("h2", {}, "Run"), form, running, last),
    close: () => {
      forget();
      ended();
      preview.destroy();
    },
  };
}
