// JSON-RPC over one WebSocket, which comes back by itself when it is lost.

export const protocolVersion = 1;

export class RpcError extends Error {
  constructor(readonly code: number, message: string, readonly data: any) {
    super(message);
  }
}

interface Waiting {
  resolve: (result: any) => void;
  reject: (error: Error) => void;
}

type Listener = (params: any) => void;
export type LinkState = "connecting" | "open" | "lost" | "refused";

const patience = 2500;  // [ms] without any word from the server until the connection counts as lost

/// The token comes in the address's fragment, which no server sees, and stays with this tab.
function token(): string {
  const match = /(?:^#|&)token=([^&#]+)/.exec(location.hash);
  if (match) {
    sessionStorage.setItem("emtb-token", match[1]);
    history.replaceState(null, "", location.pathname + location.search + "#" + location.hash.replace(/^#/, "").replace(/&?token=[^&#]+#?/, ""));
  }
  return sessionStorage.getItem("emtb-token") ?? "";
}

export class Rpc {
  state: LinkState = "connecting";
  why = "";
  lastHeard = 0;
  hello: any = null;
  private socket: WebSocket | null = null;
  private ids = 0;
  private asked = 0;  ///< [ms] when the last ping was sent
  private attempts = 0;
  private readonly waiting = new Map<number, Waiting>();
  private readonly listeners = new Map<string, Set<Listener>>();
  readonly token = token();

  start(): void {
    this.open();
    setInterval(() => this.heartbeat(), 800);
  }

  /// Listens to a notification, or to `link`: the state of the connection itself.
  on(what: string, listener: Listener): () => void {
    const set = this.listeners.get(what) ?? new Set();
    this.listeners.set(what, set.add(listener));
    return () => set.delete(listener);
  }

  call(method: string, params: any = {}): Promise<any> {
    if (this.state !== "open" && method !== "hello") return Promise.reject(new RpcError(0, "There is no connection to emtb page.", null));
    return new Promise((resolve, reject) => {
      const id = ++this.ids;
      this.waiting.set(id, {resolve, reject});
      this.socket?.send(JSON.stringify({jsonrpc: "2.0", id, method, params}));
    });
  }

  private open(): void {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`);
    this.socket = socket;
    socket.onopen = () => this.greet(socket);
    socket.onmessage = (event) => this.receive(String(event.data));
    socket.onclose = () => this.ended(socket);
  }

  private greet(socket: WebSocket): void {
    this.lastHeard = performance.now();
    this.call("hello", {token: this.token, protocol: protocolVersion}).then((answer) => {
      if (socket !== this.socket) return;
      this.hello = answer;
      this.attempts = 0;
      if (answer.protocol !== protocolVersion) {
        this.refuse(`This page speaks protocol ${protocolVersion}, the server ${answer.protocol}. Reload the page.`);
        return;
      }
      this.become("open", "");
    }, (error) => {
      if (error instanceof RpcError && error.code !== 0) this.refuse(error.message);
    });
  }

  private refuse(why: string): void {
    this.become("refused", why);
    this.socket?.close();
  }

  private receive(text: string): void {
    this.lastHeard = performance.now();
    const message = JSON.parse(text);
    if (message.id !== undefined && message.id !== null && this.waiting.has(message.id)) {
      const waiting = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) waiting?.reject(new RpcError(message.error.code, message.error.message, message.error.data ?? null));
      else waiting?.resolve(message.result);
    } else if (message.method) {
      this.tell(message.method, message.params);
    }
  }

  private ended(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = null;
    for (const waiting of this.waiting.values()) waiting.reject(new RpcError(0, "The connection to emtb page was lost.", null));
    this.waiting.clear();
    if (this.state === "refused") return;
    this.become("lost", "");
    setTimeout(() => this.open(), Math.min(4000, 300 * 2 ** this.attempts++));
  }

  /// A connection that does not answer is lost, whatever the browser thinks of it. Counted from a question: a tab in the
  /// background may look at its clock once a minute only.
  private heartbeat(): void {
    if (this.state !== "open" || !this.socket) return;
    const unanswered = this.lastHeard < this.asked;
    if (unanswered && performance.now() - this.asked > patience) {
      const silent = this.socket;
      silent.onclose = null;
      this.ended(silent);
      silent.close();
    } else if (!unanswered) {
      this.asked = performance.now();
      this.call("ping").catch(() => undefined);
    }
  }

  private become(state: LinkState, why: string): void {
    if (state === this.state && why === this.why) return;
    this.state = state;
    this.why = why;
    this.tell("link", state);
  }

  private tell(what: string, params: any): void {
    for (const listener of this.listeners.get(what) ?? []) listener(params);
  }
}

export const rpc = new Rpc();
