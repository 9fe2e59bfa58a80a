// The report of the work as it stands: one HTML file that needs nothing but itself; and the model file.

import {failed} from "../dialog";
import {h, put, textFile} from "../dom";
import {rpc} from "../rpc";
import {View} from "../view";
import {work} from "../work";
import {workHead} from "./work_bar";

class Report {
  readonly element: HTMLElement;
  private readonly make = h("button", {class: "main", id: "report", onclick: () => this.write()}, "Make the report");
  private readonly done = h("div", {class: "stack"});
  private readonly model = h("pre", {class: "mono wide", tabindex: "0", role: "region", "aria-label": "Model file"});
  private readonly save = h("button", {id: "save-model", onclick: () => textFile(`${this.name}.yaml`, this.text, "application/yaml")}, "Save the model file");
  private readonly head = workHead("Report", this.make);
  private name = "model";
  private text = "";
  private of: unknown = null;
  private readonly forget: () => void;

  constructor() {
    this.element = h("div", {class: "stack"}, this.head.element,
      h("section", {class: "panel stack", "aria-label": "Report"}, h("p", {}, "The verdict in words, every signal measured over simulated with its residual, the candidates, the falling error, and what it takes to repeat it: of the model and the runs as they are now."), this.done),
      h("section", {class: "panel stack"}, h("div", {class: "row"}, h("h2", {}, "Model file"), h("span", {class: "grow"}), this.save), this.model));
    this.forget = work.onChange(() => this.change());
    this.change();
  }

  close(): void {
    this.forget();
    this.head.close();
  }

  private change(): void {
    this.make.disabled = Boolean(work.busy);
    if (work.state === this.of) return;
    this.of = work.state;
    this.done.textContent = "";
    rpc.call("model_text").then((answer) => {
      this.name = answer.name ?? "model";
      this.text = answer.text;
      put(this.model, answer.text);
    }, failed);
  }

  private async write(): Promise<void> {
    try {
      const answer = await work.lasting("report", {}, "Writing the report");
      const again = () => textFile("report.html", answer.html, "text/html");
      put(this.done, h("div", {class: "row"}, h("span", {class: "good"}, "The report is saved as report.html."), h("button", {id: "save-report", onclick: again}, "Save it again")));
      again();
    } catch (error) {
      put(this.done, h("p", {class: "bad"}, String((error as Error).message)));
    }
  }
}

export const reportView: View = {
  id: "report", title: "Report", needs: "files",
  show(main) {
    const report = new Report();
    main.append(report.element);
    return () => report.close();
  },
};
