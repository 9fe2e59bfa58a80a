// Recorded sessions: what they are, notes and tags, two side by side, and files from elsewhere.

import {failed, notice} from "../dialog";
import {h, put, setText} from "../dom";
import {duration, localTime} from "../numbers";
import {rpc} from "../rpc";
import {View} from "../view";
import {work} from "../work";
import {askColumns} from "./columns";
import {SessionFigures} from "./session_figures";
import {thumbnail} from "./thumbnail";

const mostBytes = 2 ** 30;
const columns = ["show", "picture", "session", "recorded", "profile", "length", "tags", "used for"];

class Sessions {
  readonly element: HTMLElement;
  private list: any[] = [];
  private chosen: string[] = [];
  private readonly rows = h("tbody", {});
  private readonly detail = h("div", {class: "stack"});
  private readonly figures = new SessionFigures((paths) => this.made(paths));
  private readonly filter = h("input", {type: "search", placeholder: "Filter by name, tag, profile, note", "aria-label": "Filter", oninput: () => this.writeList()});
  private readonly file = h("input", {type: "file", accept: ".csv,text/csv", class: "only-read", id: "import-file", onchange: () => this.send()});
  private readonly forget: () => void;

  constructor() {
    const pick = h("label", {class: "button", for: "import-file"}, "Import CSV …");
    this.element = h("div", {class: "stack"}, h("div", {class: "head"}, h("h1", {}, "Sessions"), h("span", {class: "grow"}), this.filter, this.file, pick),
      h("section", {class: "panel"}, h("div", {class: "wide", tabindex: "0", role: "region", "aria-label": "Sessions"}, h("table", {class: "folds"},
        h("thead", {}, h("tr", {}, ...columns.map((t) => h("th", {scope: "col", class: t === "length" ? "n" : null}, t)))), this.rows))),
      h("div", {class: "two"}, this.figures.element, h("div", {class: "stack"}, this.figures.part.element, this.detail)));
    this.forget = rpc.on("ended", () => this.load());
    this.load();
  }

  close(): void {
    this.forget();
    this.figures.close();
  }

  private async load(): Promise<void> {
    try {
      this.list = (await rpc.call("sessions")).sessions;
      this.writeList();
      const first = this.list.find((s) => !s.error);
      if (!this.chosen.length && first) this.choose(first.path, true);
    } catch (error) {
      put(this.rows, h("tr", {}, h("td", {colspan: columns.length}, String((error as Error).message))));
    }
  }

  private writeList(): void {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const shown = this.list.filter((s) => words.every((w) => [s.name, s.profile, s.note, s.bench, ...(s.tags ?? [])].join(" ").toLowerCase().includes(w)));
    put(this.rows, ...shown.map((s) => this.row(s)));
    if (!shown.length) put(this.rows, h("tr", {}, h("td", {colspan: columns.length, class: "muted"}, this.list.length ? "None of this kind." : "There are no sessions under the folders named on the command line.")));
  }

  private row(s: any): HTMLElement {
    const show = h("input", {type: "checkbox", "aria-label": `Show ${s.name}`, onchange: () => this.choose(s.path, show.checked)});
    show.checked = this.chosen.includes(s.path);
    const use = h("select", {"aria-label": `Use of ${s.name}`, disabled: !work.present, onchange: () => rpc.call("session_use", {path: s.path, as: use.value}).then((state) => {
      work.take(state);
      this.load();
    }, failed)}, ...[["", "–"], ["train", "training"], ["held_out", "held out"]].map(([value, text]) => h("option", {value}, text)));
    use.value = s.used ?? "";
    const csv = s.error && s.name.endsWith(".csv") ? h("button", {class: "quiet", "aria-label": `Columns of ${s.name}`, onclick: () => this.columns(s)}, "Columns …") : null;
    return h("tr", {}, h("td", {}, show), h("td", {}, thumbnail(s.picture)), h("th", {scope: "row", title: s.path}, s.name, s.error ? h("span", {class: "tag bad after", title: s.error}, "not readable") : null, csv, s.complete === false && !s.error ? h("span", {class: "tag warn after"}, "not complete") : null), h("td", {}, localTime(s.started_utc)), h("td", {}, s.profile ?? ""),
      h("td", {class: "n"}, s.duration ? duration(s.duration) : "–"), h("td", {}, ...(s.tags ?? []).map((tag: string) => h("span", {class: "tag"}, tag)), s.note ? h("div", {class: "small muted"}, s.note) : null), h("td", {}, use));
  }

  /// Shows a session; of more than two the oldest choice goes.
  private choose(path: string, on: boolean): void {
    this.chosen = this.chosen.filter((p) => p !== path);
    if (on) this.chosen = [...this.chosen, path].slice(-2);
    this.show();
  }

  private show(): void {
    this.writeList();
    this.writeDetail();
    this.figures.show(this.chosen.map((p) => this.list.find((s) => s.path === p)).filter((s) => s && !s.error));
  }

  /// New sessions came: they are shown.
  private async made(paths: string[]): Promise<void> {
    await this.load();
    this.chosen = paths.slice(0, 2);
    this.show();
  }

  private writeDetail(): void {
    const sessions = this.chosen.map((p) => this.list.find((s) => s.path === p)).filter(Boolean);
    put(this.detail, sessions.length ? h("section", {class: "panel"}, h("div", {class: "pair"}, ...sessions.map((s) => this.notes(s)))) : null);
  }

  private columns(s: any): void {
    askColumns(s.path, s.name, (path) => this.made([path])).catch(failed);
  }

  private notes(s: any): HTMLElement {
    const note = h("input", {type: "text", value: s.note ?? "", maxlength: "1000", autocomplete: "off"});
    const tags = h("input", {type: "text", value: (s.tags ?? []).join(", "), maxlength: "200", autocomplete: "off"});
    const save = () => rpc.call("session_note", {path: s.path, note: note.value, tags: tags.value.split(",").map((t) => t.trim()).filter(Boolean)}).then(() => {
      notice(`Saved the note of ${s.name}.`);
      this.load();
    }, failed);
    return h("div", {class: "stack session-notes"}, h("h2", {}, s.name), h("p", {class: "small muted"}, [s.bench, s.profile, s.operator].filter(Boolean).join(", ")), s.error ? h("p", {class: "bad small"}, s.error) : null,
      h("label", {class: "field"}, "Note", note), h("label", {class: "field"}, "Tags, with commas between", tags), h("div", {class: "row"}, h("button", {onclick: save}, "Save note and tags"), s.name.endsWith(".csv") ? h("button", {class: "quiet", onclick: () => this.columns(s)}, "Columns …") : null));
  }

  /// A file whose columns nobody understands by their names is asked about at once.
  private async imported(name: string, path: string): Promise<void> {
    await this.load();
    const s = this.list.find((one) => one.path === path);
    if (s?.error) this.columns(s);
    else notice(`${name} is imported.`);
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
        this.imported(file.name, JSON.parse(request.responseText).path);
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
