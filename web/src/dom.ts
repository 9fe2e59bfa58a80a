// Elements without a framework. All text goes in as text nodes: nothing from a file or a bench is ever parsed as HTML.

export type Child = Node | string | number | null | undefined | false;

interface Attributes {
  [name: string]: string | number | boolean | null | undefined | EventListener | ((event: any) => void);
}

/// An element: h("button", {class: "quiet", onclick: save}, "Save"). A name that begins with "on" is a listener; null and
/// false leave an attribute out. `style` is not taken: the page's security policy forbids it.
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on") && typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, String(value));
  }
  return fill(element, ...children);
}

/// Appends children.
export function fill<T extends Element>(element: T, ...children: Child[]): T {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    element.append(typeof child === "object" ? child : String(child));
  }
  return element;
}

/// Puts children in place of what was there.
export function put<T extends Element>(element: T, ...children: Child[]): T {
  element.textContent = "";
  return fill(element, ...children);
}

/// Writes text only where it differs, so that a screen reader and a selection are left alone.
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function svg(tag: string, attributes: {[name: string]: string | number} = {}, ...children: Child[]): SVGElement {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  return fill(element, ...children);
}

let ids = 0;
export function newId(what: string): string {
  return `${what}-${++ids}`;
}

const greek: {[name: string]: string} = {
  omega: "ω", theta: "θ", tau: "τ", torque: "torque", temperature: "temperature",
};

const words: {[signal: string]: string} = {
  u_ref: "Reference", e_a: "Armature voltage", i_a: "Armature current", omega: "Speed", theta: "Angle", torque: "Load torque",
  i_f: "Field current", temperature: "Temperature", armature_open: "Armature open", t: "Time", "sign(omega)": "Direction",
};

export function isSymbol(name: string): boolean {
  return (greek[name.split("_")[0]] ?? name.split("_")[0]).length <= 2;
}

/// Text in which `T_{c}` sets the c as a subscript.
export function marked(text: string): HTMLElement {
  return h("span", {}, ...text.split(/_\{([^}]*)\}/).map((part, n) => (n % 2 ? h("sub", {}, part) : part)));
}

/// A signal in words, for headings.
export function signalWords(name: string): string {
  return words[name] ?? symbolText(name);
}

/// A name as it is written by hand: i_a with the a below, ω for omega.
export function symbol(name: string): HTMLElement {
  const [head, ...rest] = name.split("_");
  const words = greek[head] ?? head;
  const element = h("span", {class: words.length <= 2 ? "symbol" : "name"}, words);
  if (rest.length && words.length <= 2) element.append(h("sub", {}, rest.map((part) => greek[part] ?? part).join(",")));
  else if (rest.length) element.append(" " + rest.join(" "));
  return element;
}

/// The same as plain text, for labels that take no elements.
export function symbolText(name: string): string {
  const [head, ...rest] = name.split("_");
  return [greek[head] ?? head, ...rest.map((part) => greek[part] ?? part)].join("_");
}

/// Hands a file to the reader.
export function download(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  const link = h("a", {href: url, download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

export function textFile(name: string, text: string, type = "text/plain"): void {
  download(name, new Blob([text], {type: `${type};charset=utf-8`}));
}
