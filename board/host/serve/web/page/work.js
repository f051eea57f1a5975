// Time that the script of the page takes for a frame.
const kFrames = 120;

export class Work {
  #pending = 0;
  frames = [];  // ms of script of the newest frames
  count = 0;    // of all frames

  /// ms: time of a part of the present frame.
  spend(ms) { this.#pending += ms; }

  /// Runs action() as a part of the present frame.
  time(action) {
    const began = performance.now();
    try {
      return action();
    } finally {
      this.spend(performance.now() - began);
    }
  }

  /// The frame ends with the drawing of the scene, which took ms.
  end(ms) {
    this.frames.push(this.#pending + ms);
    ++this.count;
    this.#pending = 0;
    if (this.frames.length > kFrames) this.frames.shift();
  }

  /// Mean over the newest frames; null before the first.
  get mean_ms() { return this.frames.length ? this.frames.reduce((sum, ms) => sum + ms, 0) / this.frames.length : null; }
}
