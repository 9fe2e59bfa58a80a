// What the frame knows of a view.

export interface View {
  readonly id: string;     ///< in the address: #compare
  readonly title: string;
  readonly needs: "bench" | "files" | "any";
  /// Builds the view into the page. What it returns is called when the reader leaves.
  show(main: HTMLElement): () => void;
}
