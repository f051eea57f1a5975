// Charts of one sensor on a common time axis, which follows the poses, or is paused at a selection.
import {Chart} from './chart.js';
import {chartList} from './chart_list.js';
import {bands, decimate} from './decimate.js';
import {settings} from './settings.js';

const kFastMs = 60, kSlowMs = 1000;  // shortest and longest time between two drawings
const kLeastHeight = 92, kMostHeight = 420;

export class Plots {
  /// changed(): called when the charts pause or resume.
  constructor(parent, changed) {
    this.parent = parent;
    this.changed = changed;
    this.frozen = null;  // {from, to} in s on the axis of the history; null: follows
    this.range = [-settings.window_s, 0];
    this.bands = [];
    this.charts = [];
    this.origin = 0;
    this.hasTruth = false;
    this.drawnMs = 0;
    this.rebuild();
    new ResizeObserver(() => this.#resize()).observe(parent);
  }

  /// Call it after a change of units, conventions or theme.
  rebuild() {
    for (const chart of this.charts) chart.destroy();
    const actions = {
      select: (from, to) => this.freeze(this.origin + Math.min(from, to), this.origin + Math.max(from, to)),
      reset: () => this.follow(),
      hover: () => {
        for (const chart of this.charts) chart.showValues();
      },
    };
    this.charts = chartList(this.hasTruth).map(spec => new Chart(this.parent, spec, this, actions));
    this.#resize();
    this.drawnMs = 0;
  }

  /// The poses have a truth.
  showTruth() {
    if (this.hasTruth) return;
    this.hasTruth = true;
    this.rebuild();
  }

  get shown() { return this.frozen ?? {from: this.now - settings.window_s, to: this.now}; }

  freeze(from, to) {
    this.frozen = {from, to};
    this.drawnMs = 0;
    this.changed();
  }

  pause() { this.freeze(this.shown.from, this.shown.to); }

  follow() {
    this.frozen = null;
    this.drawnMs = 0;
    this.changed();
  }

  /// Shows more (factor > 1) or less time about the middle of a paused range.
  zoom(factor) {
    const {from, to} = this.shown;
    const middle = this.frozen ? (from + to) / 2 : to;
    this.freeze(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  /// now: right edge of the charts. origin: the time that the axis calls 0; by default the right edge.
  draw(history, now, origin = now) {
    if (!this.frozen) this.now = now;
    const ms = performance.now();
    if (document.hidden || (this.drawnMs > 0 && ms - this.drawnMs < this.#interval())) return;
    if (this.frozen && this.drawnMs > 0 && this.drawn === this.frozen) return;
    this.drawn = this.frozen;
    this.drawnMs = ms;
    if (!this.frozen || origin !== now) this.origin = origin;
    const {from, to} = this.shown;
    this.range = [from - this.origin, to - this.origin];
    this.bands = bands(history, from, to, now).map(band => ({...band, from: band.from - this.origin, to: band.to - this.origin}));
    const count = Math.max(100, this.parent.clientWidth);
    for (const chart of this.charts) {
      const [times, ...values] = decimate(history, from, to, count, chart.spec.series);
      chart.setData([times.map(t => t - this.origin), ...values]);
    }
  }

  /// Interval between two drawings: the time in which the curves move by one pixel.
  #interval() { return Math.max(kFastMs, Math.min(1000 * settings.window_s / Math.max(1, this.parent.clientWidth), kSlowMs)); }

  #resize() {
    const width = Math.max(120, this.parent.clientWidth - 8);
    const height = Math.max(kLeastHeight, Math.floor((this.parent.clientHeight - 4) / this.charts.length) - 4);
    for (const chart of this.charts) chart.setSize(width, Math.min(height, kMostHeight));
    this.drawnMs = 0;
  }
}
