// The work on files: the model as it stands, the runs, the errors, and every change of it with undo and redo.

import {failed} from "./dialog";
import {Changing} from "./live_store";
import {rpc} from "./rpc";

export interface Parameter {
  value: number;
  min: number;
  max: number;
  unit: string;
  std_error?: number | null;
  fixed?: boolean;
  tied_to?: string;
  at_bound?: boolean;
}

export interface RunInfo {
  id: string;
  name: string;
  held_out: boolean;
  duration: number;
}

export interface Errors {
  train: number | null;
  held_out: number | null;
}

export interface Work {
  name: string;
  parameters: {[name: string]: Parameter};
  order?: string[];  ///< of the parameters
  effects: {id: string; name: string; parameters?: string[]}[];
  runs: RunInfo[];
  signals: {name: string; unit: string; floor: number}[];
  error: Errors;
  table: {run: string; signal: string; unit: string; rmse: number; floors: number; fit_percent: number | null; held_out: boolean}[];
  steps: {added: string | null; train: number; held_out: number | null}[];
  undo: string | null;
  redo: string | null;
  saved?: string;
  findings?: string;  ///< why nothing may be fitted to these recordings; empty: it may
}

class WorkStore extends Changing {
  present = false;
  state: Work | null = null;
  busy = "";         ///< what is being computed, in words
  private method = "";
  progress: {done: number; of: number; text: string} | null = null;
  diagnosis: any = null;
  diagnosed: Work | null = null;  ///< the state that the diagnosis is of

  constructor() {
    super();
    rpc.on("work", (state) => this.take(state));
    rpc.on("progress", (progress) => {
      this.progress = progress;
      this.changed();
    });
  }

  get name(): string {
    return this.state?.name ?? "";
  }

  async begin(): Promise<void> {
    this.present = Boolean(rpc.hello?.files);
    this.busy = "";
    if (this.present) this.take(await rpc.call("work"));
    else this.changed();
  }

  /// A change of the model: its answer is the new state.
  async change(method: string, params: any, busy: string): Promise<boolean> {
    try {
      this.take(await this.lasting(method, params, busy));
      return true;
    } catch (error) {
      failed(error);
      return false;
    }
  }

  /// Something that takes its time: shown, and to be cancelled.
  async lasting(method: string, params: any, busy: string): Promise<any> {
    if (this.busy) throw new Error(`Wait for this to end, or cancel it: ${this.busy}.`);
    this.busy = busy;
    this.method = method;
    this.progress = null;
    this.changed();
    try {
      return await rpc.call(method, params);
    } finally {
      this.busy = "";
      this.progress = null;
      this.changed();
    }
  }

  /// Ends what lasts. While something else is before it at the server, asks again.
  cancel(): void {
    const method = this.method;
    rpc.call("cancel").then((answer) => {
      if (answer.cancelled !== method && this.busy && this.method === method) window.setTimeout(() => this.method === method && this.busy && this.cancel(), 150);
    }, failed);
  }

  take(state: Work): void {
    this.state = state;
    this.changed();
  }
}

export const work = new WorkStore();
