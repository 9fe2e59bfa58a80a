// The last minutes of each signal, as smallest and largest of small bins, so that no peak is lost whatever the width drawn.

/// One signal's bins, newest last; old ones go when `span` seconds are over.
export class Trail {
  private t: Float64Array;
  private low: Float64Array;
  private high: Float64Array;
  private from = 0;
  private to = 0;

  constructor(private capacity = 8192) {
    this.t = new Float64Array(capacity);
    this.low = new Float64Array(capacity);
    this.high = new Float64Array(capacity);
  }

  get length(): number {
    return this.to - this.from;
  }
  get last(): number {
    return this.length ? this.t[this.to - 1] : NaN;
  }

  clear(): void {
    this.from = this.to = 0;
  }

  push(t: number, low: number, high: number): void {
    if (this.length && t <= this.t[this.to - 1]) return;  // what history told already
    if (this.to === this.capacity) this.makeRoom();
    this.t[this.to] = t;
    this.low[this.to] = low;
    this.high[this.to] = high;
    ++this.to;
  }

  /// The fixed memory is full: the newest half stays.
  private makeRoom(): void {
    const keep = Math.floor(this.capacity / 2);
    for (const values of [this.t, this.low, this.high]) values.copyWithin(0, this.to - keep, this.to);
    this.from = 0;
    this.to = keep;
  }

  /// Bins from `since` on, at most `most` of them, their times counted from `zero`.
  view(since: number, most: number, zero: number): {x: number[]; low: (number | null)[]; high: (number | null)[]} {
    let first = this.from;
    for (let above = this.to; first < above;) {
      const middle = (first + above) >> 1;
      if (this.t[middle] < since) first = middle + 1;
      else above = middle;
    }
    const step = Math.max(1, Math.ceil((this.to - first) / most));
    const x: number[] = [], low: (number | null)[] = [], high: (number | null)[] = [];
    for (let n = first - (first % step); n < this.to; n += step) {
      let least = Infinity, largest = -Infinity;
      for (let k = Math.max(n, this.from); k < Math.min(n + step, this.to); ++k) {
        if (this.low[k] < least) least = this.low[k];
        if (this.high[k] > largest) largest = this.high[k];
      }
      x.push(this.t[Math.max(n, this.from)] - zero);
      low.push(least === Infinity ? null : least);
      high.push(largest === -Infinity ? null : largest);
    }
    return {x, low, high};
  }
}

/// The change-listening that every store of the page has.
export class Changing {
  private readonly listeners = new Set<() => void>();
  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
  protected changed(): void {
    for (const listener of this.listeners) listener();
  }
}
