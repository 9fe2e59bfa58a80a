// Below the signals: what guards what, how late the loop is, and after a fault the seconds before it.

import {bench} from "../bench";
import {failed} from "../dialog";
import {h, put, setText, symbol} from "../dom";
import {plain, quantity} from "../numbers";
import {Group, Plot} from "../plot";
import {rpc} from "../rpc";

export function details(): {element: HTMLElement; close: () => void} {
  const plots: Plot[] = [];
  const guards = h("ul", {class: "small"}), wrong = h("p", {class: "muted small"});
  const loop = h("p", {class: "small"}), realtime = h("ul", {class: "small"});
  const late = new Plot({title: "Lateness of the loop", about: "how many ticks came how late", x: {name: "late by at most", unit: "µs"}, y: {name: "ticks", unit: "1"}, height: 170, log: true, logX: true});
  plots.push(late);
  const box = h("div", {class: "stack"});
  const boxPanel = h("section", {class: "panel stack black-box", hidden: true}, h("h2", {}, "Black box: the seconds before the fault"), box);
  let shownBox = "", shownConfig: any = null;

  async function showBox(of: any): Promise<void> {
    shownBox = JSON.stringify(of);
    boxPanel.hidden = false;
    try {
      const answer = await rpc.call("black_box", {points: 700});
      const group = new Group();
      const units = new Map(bench.channels.map((c) => [c.signal, c.unit]));
      put(box, h("p", {class: "small"}, answer.fault ? `${answer.fault.code} ${answer.fault.name}: ${answer.fault.text}` : "", " ", h("span", {class: "mono muted"}, answer.session ?? answer.path ?? "")));
      for (const [signal, bins] of Object.entries<any>(answer.signals)) {
        const plot = new Plot({title: signal, about: "before the fault", x: {name: "t", unit: "s"}, y: {name: signal, unit: units.get(signal) ?? answer.units?.[signal] ?? ""}, height: 110, group});
        plots.push(plot);
        box.append(plot.element);
        plot.show([{label: "", ink: "base", x: bins.t, y: bins.min ?? bins.value, high: bins.max}]);
      }
    } catch (error) {
      put(box, h("p", {class: "bad small"}, String((error as Error).message)));
    }
  }

  function change(): void {
    const status = bench.status;
    if (status) {
      const histogram: [number, number][] = (status.loop.late_histogram ?? []).filter((bin: [number, number]) => bin[1] > 0);
      late.show([{label: "", ink: "model", x: histogram.map((b) => b[0]), y: histogram.map((b) => b[1]), as: "steps"}]);
      setText(loop, `${plain(status.loop.rate, 4)} Hz, pace ${status.pace}; ${status.loop.ticks} ticks, ${status.loop.missed} missed; late by ${plain(status.loop.late_us.p50)} µs in the middle, ${plain(status.loop.late_us.p99)} µs at 99 %, ${plain(status.loop.late_us.max)} µs at most.`);
      put(realtime, ...(status.realtime ?? []).map((r: any) => h("li", {}, `${r.what}: ${r.ok ? "yes" : `no, ${r.why}`}`)));
      if (status.black_box && JSON.stringify(status.black_box) !== shownBox) showBox(status.black_box).catch(failed);
    }
    if (bench.config && bench.config !== shownConfig) {
      shownConfig = bench.config;
      const list: any[] = bench.config.guards ?? [];
      put(guards, ...list.map((g) => h("li", {class: g.wrong ? "bad" : ""}, typeof g === "string" ? g : g.text, g.wrong ? ` ${g.wrong}` : "")));
      setText(wrong, list.length ? "" : "emtb bench check FILE lists what guards what.");
      put(channels, ...bench.channels.map((c) => h("tr", {}, h("td", {}, symbol(c.signal)), h("td", {class: "n"}, c.period ? quantity(1 / c.period, "Hz") : "–"),
        h("td", {class: "n"}, c.window ? quantity(c.window, "s") : "–"), h("td", {}, (c as any).source ?? ""))));
    }
  }

  const channels = h("tbody", {});
  const forget = bench.onChange(change);
  change();
  const element = h("div", {class: "stack"}, boxPanel,
    h("section", {class: "panel"}, h("details", {}, h("summary", {}, "What guards what"), guards, wrong)),
    h("section", {class: "panel"}, h("details", {}, h("summary", {}, "The loop: lateness and real time"), loop, late.element, realtime)),
    h("section", {class: "panel"}, h("details", {}, h("summary", {}, "Channels"), h("div", {class: "wide"}, h("table", {}, h("thead", {}, h("tr", {},
      h("th", {scope: "col"}, "signal"), h("th", {class: "n", scope: "col"}, "readings"), h("th", {class: "n", scope: "col"}, "averaged over"), h("th", {scope: "col"}, "from"))), channels)))));
  return {element, close: () => {
    forget();
    plots.forEach((p) => p.destroy());
  }};
}
