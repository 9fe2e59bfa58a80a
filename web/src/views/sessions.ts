// Recorded sessions: what they are, notes and tags, two side by side, and files from elsewhere.

import {failed, notice} from "../dialog";
import {h, put, setText, signalWords} from "../dom";
import {duration, localTime} from "../numbers";
import {Group, Plot} from "../plot";
import {rpc} from "../rpc";
import {View} from "../view";
import {work} from "../work";

const mostBytes = 2 ** 30;

class Sessions {
  readonly element: HTMLElement;
  private list: any[] = [];
  private chosen: string[] = [];
  private plots: Plot[] = [];
  private asked = 0;
  private readonly rows = h("tbody", {});
  private readonly detail = h("div", {class: "stack"});
  private readonly figures = h("div", {class: "stack"});
  private readonly filter = h("input", {type: "search", placeholder: "Filter by name, tag, profile, note", "aria-label": "Filter", oninput: () => this.writeList()});
  private readonly file = h("input", {type: "file", accept: ".csv,text/csv", class: "only-read", id: "import-file", onchange: () => this.send()});
  private readonly forget: () => void;

  constructor() {
    const pick = h("label", {class: "button", for: "import-file"}, "Import CSV …");
    this.element = h("div", {class: "stack"}, h("div", {class: "head"}, h("h1", {}, "Sessions"), h("span", {class: "grow"}), this.filter, this.file, pick),
      h("section", {class: "panel"}, h("div", {class: "wide", tabindex: "0", role: "region", "aria-label": "Sessions"}, h("table", {class: "folds"},
        h("thead", {}, h("tr", {}, ...["show", "session", "recorded", "profile", "length", "tags", "used for"].map((t) => h("th", {scope: "col", class: t === "length" ? "n" : null}, t)))), this.rows))),
      h("div", {class: "two"}, this.figures, this.detail));
    this.forget = rpc.on("ended", () => this.load());
    this.load();
  }

  close(): void {
    this.forget();
    this.plots.forEach((p) => p.destroy());
  }

  private async load(): Promise<void> {
    try {
      this.list = (await rpc.call("sessions")).sessions;
      this.writeList();
      const first = this.list.find((s) => !s.error);
      if (!this.chosen.length && first) this.choose(first.path, true);
    } catch (error) {
      put(this.rows, h("tr", {}, h("td", {colspan: "7"}, String((error as Error).message))));
    }
  }

  private writeList(): void {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = this.list.filter((s) => words.every((w) => [s.name, s.profile, s.note, s.bench, ...(s.tags ?? [])].join(" ").toLowerCase().includes(w)));
    put(this.rows, ...shown.map((s) => this.row(s)));
    if (!shown.length) put(this.rows, h("tr", {}, h("td", {colspan: "7", class: "muted"}, this.list.length ? "None of this kind." : "There are no sessions under the folders named on the command line.")));
  }

  private row(s: any): HTMLElement {
    const show = h("input", {type: "checkbox", "aria-label": `Show ${s.name}`, onchange: () => this.choose(s.path, show.checked)});
    show.checked = this.chosen.includes(s.path);
    const use = h("select", {"aria-label": `Use of ${s.name}`, disabled: !work.present, onchange: () => rpc.call("session_use", {path: s.path, as: use.value}).then((state) => {
      work.take(state);
      this.load();
    }, failed)}, ...[["", "–"], ["train", "training"], ["held_out", "held out"]].map(([value, text]) => h("option", {value}, text)));
    use.value = s.used ?? "";
    return h("tr", {}, h("td", {}, show), h("th", {scope: "row", title: s.path}, s.name, s.error ? h("span", {class: "tag bad after", title: s.error}, "not readable") : null, s.complete === false && !s.error ? h("span", {class: "tag warn after"}, "not complete") : null), h("td", {}, localTime(s.started_utc)), h("td", {}, s.profile ?? ""),
      h("td", {class: "n"}, s.duration ? duration(s.duration) : "–"), h("td", {}, ...(s.tags ?? []).map((tag: string) => h("span", {class: "tag"}, tag)), s.note ? h("div", {class: "small muted"}, s.note) : null), h("td", {}, use));
  }

  /// Shows a session; of more than two the oldest choice goes.
  private choose(path: string, on: boolean): void {
    this.chosen = this.chosen.filter((p) => p !== path);
    if (on) this.chosen = [...this.chosen, path].slice(-2);
    this.writeList();
    this.writeDetail();
    this.draw();
  }

  private writeDetail(): void {
    const sessions = this.chosen.map((p) => this.list.find((s) => s.path === p)).filter(Boolean);
    put(this.detail, sessions.length ? h("section", {class: "panel"}, h("div", {class: "pair"}, ...sessions.map((s) => this.notes(s)))) : null);
  }

  private notes(s: any): HTMLElement {
    const note = h("input", {type: "text", value: s.note ?? "", maxlength: "1000", autocomplete: "off"});
    const tags = h("input", {type: "text", value: (s.tags ?? []).join(", "), maxlength: "200", autocomplete: "off"});
    const save = () => rpc.call("session_note", {path: s.path, note: note.value, tags: tags.value.split(",").map((t) => t.trim()).filter(Boolean)}).then(() => {
      notice(`Saved the note of ${s.name}.`);
      this.load();
    }, failed);
    return h("div", {class: "stack session-notes"}, h("h2", {}, s.name), h("p", {class: "small muted"}, [s.bench, s.profile, s.operator].filter(Boolean).join(", ")),
      h("label", {class: "field"}, "Note", note), h("label", {class: "field"}, "Tags, with commas between", tags), h("div", {class: "row"}, h("button", {onclick: save}, "Save note and tags")));
  }

  private async draw(): Promise<void> {
    const number = ++this.asked, paths = this.chosen.slice();
    const inks = ["model", "base"] as const;
    try {
      const answers = await Promise.all(paths.map((path) => rpc.call("session_data", {path, points: 900})));
      if (number !== this.asked) return;
      this.plots.forEach((p) => p.destroy());
      this.plots = [];
      this.figures.textContent = "";
      const group = new Group();
      const signals: {[name: string]: {unit: string; traces: any[]}} = {};
      answers.forEach((answer, n) => {
        const name = this.list.find((s) => s.path === paths[n])?.name ?? paths[n];
        for (const [signal, bins] of Object.entries<any>(answer.runs?.[0]?.signals ?? answer.signals ?? {}))
          (signals[signal] ??= {unit: bins.unit ?? "", traces: []}).traces.push({label: name, ink: inks[n], x: bins.t, y: bins.min ?? bins.value, high: bins.max, as: bins.t.length < 400 ? "points" : undefined, width: 1.3});
      });
      for (const [signal, {unit, traces}] of Object.entries(signals)) {
        const plot = new Plot({title: signalWords(signal), about: "of the chosen sessions over their time", x: {name: "t", unit: "s"}, y: {name: signal, unit}, height: 150, group});
        this.plots.push(plot);
        this.figures.append(h("section", {class: "panel", "aria-label": signalWords(signal)}, plot.element));
        plot.show(traces);
      }
    } catch (error) {
      if (number === this.asked) put(this.figures, h("p", {class: "bad"}, String((error as Error).message)));
    }
  }

  /// Streams a file to the server; it never is in this page's memory as a whole.
  private send(): void {
    const file = this.file.files?.[0];
    if (!file) return;
    this.file.value = "";
    if (file.size > mostBytes) return notice(`${file.name} has ${(file.size / mostBytes).toFixed(1)} GiB; 1 GiB is the most.`, true);
    const bar = h("progress", {"aria-label": `Importing ${file.name}`, max: "1", value: "0"}), text = h("span", {}, `Importing ${file.name}`);
    const request = new XMLHttpRequest();
    const panel = h("section", {class: "panel progress", role: "status"}, h("div", {class: "row"}, text, h("button", {class: "quiet", onclick: () => request.abort()}, "Cancel")), bar);
    this.element.append(panel);
    request.upload.onprogress = (event) => {
      bar.value = event.loaded / Math.max(1, event.total);
      if (event.loaded === event.total) setText(text, `Reading ${file.name}`);
    };
    request.onloadend = () => {
      panel.remove();
      if (request.status === 200) {
        notice(`${file.name} is imported.`);
        this.load();
      } else if (request.status) {
        notice(request.responseText.slice(0, 500) || `The server refused ${file.name} (${request.status}).`, true);
      }
    };
    request.open("PUT", `/import?name=${encodeURIComponent(file.name)}`);
    request.setRequestHeader("X-Emtb-Token", rpc.token);
    request.send(file);
  }
}

export const sessionsView: View = {
  id: "sessions", title: "Sessions", needs: "any",
  show(main) {
    const sessions = new Sessions();
    main.append(sessions.element);
    return () => sessions.close();
  },
};
