// Guided tour of a simulation: its steps, and the error against the truth with and without motion compensation.
import {make} from './tools.js';

const kSpan_s = 1;
const element = id => document.getElementById(id);
const name = compensated => compensated ? 'with' : 'without';

/// RMS over the last second of the error of valid poses against the truth (3D), once there is a whole second of it.
export class TrueError {
  constructor() { this.restart(); }

  restart() { this.entries = []; }

  add(pose, t) {
    if (this.entries.length && t < this.entries.at(-1).t) this.restart();
    if (pose.valid && Number.isFinite(pose.true_mm)) this.entries.push({t, mm: pose.true_mm});
    while (this.entries.length && t - this.entries[0].t > kSpan_s) this.entries.shift();
  }

  get rms_mm() {
    const {length} = this.entries;
    const isWhole = length > 1 && this.entries[length - 1].t - this.entries[0].t > 0.9 * kSpan_s;
    return isWhole ? Math.sqrt(this.entries.reduce((sum, {mm}) => sum + mm * mm, 0) / length) : null;
  }
}

export class Tour {
  /// ask(request): sends a request to the server. changed(): another step began.
  constructor(section, ask, changed) {
    this.section = section;
    this.ask = ask;
    this.changed = changed;
    this.steps = [];
    this.place = null;  // {step, compensated, speed}; null: there is no tour
    this.error = new TrueError();
    this.isLost = false;
    this.found = new Map();  // RMS in mm by motion, its speed and compensation
    element('tour_next').addEventListener('click', () => this.move(1));
    for (const compensated of [false, true]) element(name(compensated)).addEventListener('click', () => this.compensate(compensated));
    this.slider = element('hand_speed');
    this.slider.addEventListener('input', () => this.#showSpeed());
    this.slider.addEventListener('change', () => this.setSpeed(Number(this.slider.value)));
  }

  /// steps: as the server describes them; undefined: there is no tour.
  begin(steps) {
    this.steps = Array.isArray(steps) ? steps : [];
    element('tour_steps')
        .replaceChildren(...this.steps.map(
            (step, n) => make('li', {}, make('button', {onclick: () => this.go(n)}, make('b', {}, String(n + 1)), ` ${step.name}`))));
  }

  /// place: of the status.
  show(place) {
    const step = Number.isInteger(place?.step) ? this.steps[place.step] : undefined;
    document.body.dataset.tour = String(step !== undefined);
    this.section.hidden = !step;
    if (!step) {
      this.place = null;
      return;
    }
    const isSame = place.step === this.place?.step && place.compensated === this.place.compensated && place.speed === this.place.speed;
    this.place = place;
    if (Number.isFinite(place.other_mm)) this.found.set(this.#key(!place.compensated), place.other_mm);
    if (place.other_mm === null) this.found.delete(this.#key(!place.compensated));
    if (isSame) return;
    this.error.restart();
    this.isLost = false;
    element('tour_text').textContent = step.shows;
    [...element('tour_steps').children].forEach(
        (item, n) => n === place.step ? item.firstChild.setAttribute('aria-current', 'step') : item.firstChild.removeAttribute('aria-current'));
    for (const compensated of [false, true]) element(name(compensated)).setAttribute('aria-pressed', String(place.compensated === compensated));
    element('tour_next').disabled = place.step + 1 >= this.steps.length;
    this.slider.value = String(place.speed ?? 1);
    this.#showSpeed();
    this.#showErrors();
    this.changed();
  }

  /// Takes a pose with its time t on the axis.
  add(pose, t) {
    if (!this.place) return;
    this.error.add(pose, t);
    this.isLost = !pose.valid;
  }

  /// Call it after the poses of an event.
  refresh() {
    if (!this.place) return;
    const mm = this.error.rms_mm;
    if (mm !== null) this.found.set(this.#key(this.place.compensated), mm);
    if (this.isLost && !this.error.entries.length) this.found.delete(this.#key(this.place.compensated));
    this.#showErrors();
  }

  go(step) {
    if (this.steps[step]) this.ask({step, compensated: this.steps[step].compensated, speed: this.place?.speed});
  }

  move(by) {
    if (this.place) this.go(this.place.step + by);
  }

  /// With or without motion compensation: the step that shows this, or this step again.
  compensate(compensated) {
    if (!this.place || compensated === this.place.compensated) return;
    const motion = this.#motion(this.place.step);
    const step = this.steps.findIndex((each, n) => this.#motion(n) === motion && each.compensated === compensated);
    this.ask({step: step < 0 ? this.place.step : step, compensated, speed: this.place.speed});
  }

  toggle() {
    if (this.place) this.compensate(!this.place.compensated);
  }

  /// speed: of the motion, relative to the scenario's. This step again.
  setSpeed(speed) {
    if (this.place) this.ask({step: this.place.step, compensated: this.place.compensated, speed});
  }

  /// The next speed of the slider, up or down.
  hasten(steps) {
    steps > 0 ? this.slider.stepUp() : this.slider.stepDown();
    this.setSpeed(Number(this.slider.value));
  }

  /// The metal of this step: [{position_m, radius_m}].
  get metal() {
    const faults = this.steps[this.place?.step]?.faults ?? [];
    return faults.map(fault => /^metal:([-\d.,]+)$/.exec(fault)?.[1].split(',').map(Number))
        .filter(values => values?.length === 4 && values.every(Number.isFinite))
        .map(([x, y, z, radius_m]) => ({position_m: [x, y, z], radius_m}));
  }

  #motion(step) { return JSON.stringify([this.steps[step].scenario, this.steps[step].faults]); }
  #key(compensated) { return `${this.#motion(this.place.step)} ${this.place.speed} ${compensated}`; }
  #showSpeed() { element('hand_speed_value').textContent = `×${this.slider.value}`; }

  #showErrors() {
    for (const compensated of [false, true]) {
      const mm = this.found.get(this.#key(compensated));
      const text = mm === undefined ? '–' : mm.toFixed(2);
      const output = element(`error_${name(compensated)}`);
      if (output.textContent !== text) output.textContent = text;
    }
  }
}
