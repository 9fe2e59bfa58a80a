// Dialogs and notices.

import {Child, h} from "./dom";

let notices: HTMLElement | null = null;
let announcer: HTMLElement | null = null;

export function startNotices(): HTMLElement {
  notices = h("div", {class: "notices", role: "region", "aria-label": "Messages"});
  announcer = h("div", {class: "only-read", "aria-live": "assertive", id: "announcer"});
  return h("div", {}, notices, announcer);
}

/// Says a thing once to those who listen to the page.
export function announce(text: string): void {
  if (announcer) announcer.textContent = text;
}

/// A message at the corner; bad ones stay until they are closed.
export function notice(text: string, bad = false): void {
  const close = () => element.remove();
  const element = h("div", {class: bad ? "notice bad" : "notice", role: bad ? "alert" : "status"},
    h("p", {}, text), h("button", {class: "quiet", "aria-label": "Close this message", onclick: close}, "×"));
  notices?.append(element);
  while (notices && notices.childElementCount > 4) notices.firstElementChild?.remove();
  if (!bad) setTimeout(close, 6000);
}

/// What went wrong, in words. For promises: rpc.call(...).then(..., failed).
export function failed(error: unknown): void {
  notice(error instanceof Error ? error.message : String(error), true);
}

/// Asks before something moves or is lost. `extra` stands left of the buttons.
export function ask(title: string, content: Child[], yes: string, extra: HTMLElement | null = null): Promise<boolean> {
  return new Promise((resolve) => {
    const dialog = h("dialog", {"aria-label": title}, h("h2", {}, title), ...content,
      h("div", {class: "row"}, extra,
        h("button", {onclick: () => dialog.close("no")}, "Cancel"),
        h("button", {class: "main", onclick: () => dialog.close("yes")}, yes)));
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
