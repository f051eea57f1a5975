// Time axis of the page. It continues steadily if the device's clock jumps.
const kBack_s = 0.5;   // a larger step back is a jump
const kForward_s = 2;  // a step forward that exceeds the time passed on this computer by more than this is a jump, too

export class Timeline {
  #shift_s = 0;       // sum of all jumps
  #last = new Map();  // by sensor: {time_s, heard_s}
  jumps = 0;

  /// Time on the axis (s) of a pose that arrived at heard_s (monotonic, s). A jump of the clock becomes a step of the time that passed here.
  at(sensor, time_s, heard_s) {
    const last = this.#last.get(sensor);
    if (last) {
      const step = time_s - last.time_s;
      const passed = heard_s - last.heard_s;
      if (step < -kBack_s || step > passed + kForward_s) this.#jump(step - passed);
    }
    this.#last.set(sensor, {time_s, heard_s});
    return time_s - this.#shift_s;
  }

  #jump(by_s) {
    this.#shift_s += by_s;
    ++this.jumps;
    for (const last of this.#last.values()) last.time_s += by_s;
  }
}
