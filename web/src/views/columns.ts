// Which column of a CSV is which: a mapping made by clicking, as a file of --map has it.

import {announce} from "../dialog";
import {h, put, setText, textFile} from "../dom";
import {rpc} from "../rpc";

interface Column {
  name: string;
  cells: string[];
  time: boolean;
  signal: string | null;
  unit: string;
}

interface Known {
  name: string;
  meaning: string;
  units: string[];
}

interface Meaning {
  signal: string;  ///< empty: the time
  unit: string;
  window: string;  ///< [s] that a reading is the mean over; empty: an instant
}

const timeWords = "time";

class Columns {
  readonly dialog: HTMLDialogElement;
  private readonly meanings = new Map<number, Meaning>();
  private readonly heads: HTMLButtonElement[] = [];
  private readonly chosen = h("div", {class: "stack", id: "column-meaning"});
  private readonly wrong = h("p", {class: "bad small", role: "alert"});
  private readonly read = h("button", {class: "main", id: "columns-read", onclick: () => this.submit()}, "Read it so");
  private readonly save = h("button", {onclick: () => textFile(`${this.name.replace(/\.csv$/, "")}-mapping.yaml`, this.text(), "application/yaml")}, "Save the mapping file");
  private at = 0;

  constructor(private readonly path: string, private readonly name: string, private readonly columns: Column[], private readonly known: Known[], private readonly timeUnits: string[], private readonly done: (path: string) => void) {
    columns.forEach((column, n) => {
      if (column.signal && !this.column(column.signal)) this.meanings.set(n, {signal: column.signal, unit: column.unit, window: ""});
      else if (column.time && !this.column("")) this.meanings.set(n, {signal: "", unit: timeUnit(column.name), window: ""});
    });
    const head = columns.map((column, n) => {
      const button = h("button", {class: "column", "aria-pressed": "false", onclick: () => this.choose(n)}, h("span", {}, column.name || `column ${n + 1}`), h("span", {class: "tag"}));
      this.heads.push(button);
      return h("th", {scope: "col"}, button);
    });
    const rows = Math.max(0, ...columns.map((c) => c.cells.length));
    const body = Array.from({length: rows}, (_, r) => h("tr", {}, ...columns.map((c) => h("td", {class: "n"}, c.cells[r] ?? ""))));
    this.dialog = h("dialog", {class: "columns", "aria-label": `Columns of ${name}`}, h("h2", {}, `Which column of ${name} is which?`),
      h("p", {}, "Click a column, then what it is. The time and one signal are needed; what is nothing is passed over."),
      h("div", {class: "wide", tabindex: "0", role: "region", "aria-label": "The first rows"}, h("table", {}, h("thead", {}, h("tr", {}, ...head)), h("tbody", {}, ...body))),
      this.chosen, this.wrong,
      h("div", {class: "row"}, this.save, h("span", {class: "grow"}), h("button", {onclick: () => this.dialog.close()}, "Cancel"), this.read));
    this.dialog.addEventListener("close", () => this.dialog.remove());
    const first = columns.findIndex((_, n) => !this.meanings.has(n));
    this.choose(Math.max(0, first));
  }

  /// Which column is a signal; the time: "".
  private column(signal: string): number | undefined {
    return [...this.meanings].find(([, m]) => m.signal === signal)?.[0];
  }

  private choose(n: number): void {
    this.at = n;
    this.write();
  }

  private write(): void {
    const words = (signal: string) => (signal ? this.known.find((k) => k.name === signal)?.meaning ?? signal : timeWords);
    this.heads.forEach((head, n) => {
      const meaning = this.meanings.get(n);
      head.setAttribute("aria-pressed", String(n === this.at));
      const tag = head.lastElementChild as HTMLElement;
      setText(tag, meaning ? `${words(meaning.signal)}${meaning.unit && meaning.unit !== "1" ? `, ${meaning.unit}` : ""}` : "nothing");
      tag.className = meaning ? "tag good" : "tag";
    });
    this.writeChosen(words);
    this.read.disabled = this.save.disabled = this.column("") === undefined || this.meanings.size < 2;
  }

  private writeChosen(words: (signal: string) => string): void {
    const meaning = this.meanings.get(this.at);
    const chip = (text: string, signal: string | null, taken: boolean) => h("button", {"aria-pressed": String(signal === null ? !meaning : meaning?.signal === signal), class: taken ? "muted" : "", onclick: () => this.mean(signal)}, text);
    const units = meaning ? (meaning.signal ? this.known.find((k) => k.name === meaning.signal)?.units ?? [] : this.timeUnits) : [];
    const unit = h("select", {id: "column-unit", onchange: () => {
      if (meaning) meaning.unit = unit.value;
      this.write();
    }}, ...units.map((u) => h("option", {value: u}, u)));
    if (meaning) unit.value = meaning.unit;
    const window = h("input", {type: "text", inputmode: "decimal", size: "6", value: meaning?.window ?? "", autocomplete: "off", oninput: () => meaning && (meaning.window = window.value)});
    const focus = document.activeElement?.id;
    put(this.chosen, h("h3", {}, `${this.columns[this.at].name || `column ${this.at + 1}`} is`),
      h("div", {class: "row chips"}, chip(timeWords, "", this.column("") !== undefined), ...this.known.map((k) => chip(k.meaning, k.name, this.column(k.name) !== undefined)), chip("nothing", null, false)),
      meaning && units.length > 1 ? h("div", {class: "row"}, h("label", {class: "field"}, `Unit of the ${words(meaning.signal)}`, unit),
        meaning.signal ? h("label", {class: "field"}, "Each reading is a mean over, s", window) : null) : null);
    if (focus === "column-unit") document.getElementById(focus)?.focus();
  }

  /// What the chosen column is; another column that was the same is nothing then.
  private mean(signal: string | null): void {
    this.meanings.delete(this.at);
    if (signal !== null) {
      const other = this.column(signal);
      if (other !== undefined) this.meanings.delete(other);
      this.meanings.set(this.at, {signal, unit: signal ? this.known.find((k) => k.name === signal)?.units[0] ?? "" : "s", window: ""});
    }
    setText(this.wrong, "");
    this.write();
    this.chosen.querySelector<HTMLElement>('button[aria-pressed="true"]')?.focus();
  }

  /// JSON's way to write a text is YAML's, too.
  private text(): string {
    const name = (n: number) => JSON.stringify(this.columns[n].name);
    const time = this.column(""), lines = [`time: ${name(time ?? 0)}`, `time_unit: ${this.meanings.get(time ?? 0)?.unit ?? "s"}`, "columns:"], windows: string[] = [];
    for (const [n, m] of this.meanings) {
      if (!m.signal) continue;
      lines.push(`  ${m.signal}: {from: ${name(n)}, unit: ${JSON.stringify(m.unit)}}`);
      if (Number(m.window.replace(",", ".")) > 0) windows.push(`${m.signal}: ${Number(m.window.replace(",", "."))}`);
    }
    if (windows.length) lines.push(`window: {${windows.join(", ")}}`);
    return lines.join("\n") + "\n";
  }

  private async submit(): Promise<void> {
    this.read.disabled = true;
    try {
      const answer = await rpc.call("csv_map", {path: this.path, map: this.text()});
      announce(`${answer.name} is read.`);
      this.dialog.close();
      this.done(answer.path);
    } catch (error) {
      setText(this.wrong, String((error as Error).message));
      this.read.disabled = false;
    }
  }
}

function timeUnit(name: string): string {
  const bare = name.toLowerCase().replace(/[^a-z]/g, "");
  return bare.endsWith("us") ? "us" : bare.endsWith("ms") ? "ms" : "s";
}

/// Asks for the columns of a file. @param done is called with the path of the session that was made of it
export async function askColumns(path: string, name: string, done: (path: string) => void): Promise<void> {
  const answer = await rpc.call("csv_columns", {path});
  const columns = new Columns(path, name, answer.columns, answer.signals, answer.time_units, done);
  document.body.append(columns.dialog);
  columns.dialog.showModal();
}
