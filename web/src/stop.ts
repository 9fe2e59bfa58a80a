// STOP: a request of its own, never behind samples, that says what it knows and no more.

import {announce} from "./dialog";
import {h, put} from "./dom";

const patience = 500;  // [ms] without an answer until the button says so
const shown = 4000;    // [ms] for which an answer stands

let runIsOn = () => false;
let reset: number | undefined;
let buttons: HTMLElement[] = [];

function show(state: "" | "asking" | "safe" | "silent", text: string): void {
  buttons = buttons.filter((button, n) => n === 0 || button.isConnected);  // those of closed dialogs are gone
  for (const button of buttons) {
    button.className = `stop with-bench ${state}`;
    put(button, text);
  }
  if (state) announce(text);
}

/// Asks for the stop. Pressing again asks again.
export function stop(): void {
  clearTimeout(reset);
  show("asking", "stopping …");
  const silent = setTimeout(() => show("silent", "NO ANSWER: use the emergency stop"), patience);
  fetch("/stop", {method: "POST", cache: "no-store", keepalive: true}).then(async (response) => {
    const answer = await response.json();
    clearTimeout(silent);
    if (!response.ok || answer.reference_safe !== true) {
      show("silent", answer.reference_safe === false ? "NOT SAFE: use the emergency stop" : "NO ANSWER: use the emergency stop");
      return;
    }
    show("safe", "reference safe");
    reset = window.setTimeout(() => show("", "STOP"), shown);
  }).catch(() => {
    clearTimeout(silent);
    show("silent", "NO ANSWER: use the emergency stop");
  });
}

/// A stop button. There is one in the bar, and one in each dialog that can cover it.
export function stopButton(): HTMLElement {
  const button = h("button", {class: "stop with-bench", type: "button", onclick: stop, "aria-keyshortcuts": "Escape"}, "STOP");
  buttons.push(button);
  return button;
}

/// Esc stops while a run is on, in dialogs and text fields, too.
export function startStop(isOn: () => boolean): void {
  runIsOn = isOn;
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && runIsOn()) {
      event.preventDefault();
      stop();
    }
  }, {capture: true});
}
