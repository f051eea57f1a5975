// Charts of one sensor on a common time axis, which follows the poses, or is paused at a selection.
import uPlot from 'uplot';

import {Chart} from './chart.js';
import {chartList} from './chart_list.js';
import {bands, decimate, difference, meanOf} from './decimate.js';
import {settings} from './settings.js';

const kFastMs = 60, kSlowMs = 1000;  // shortest and longest time between two drawings
const kLeastHeight = 92, kMostHeight = 420;

export class Plots {
  /// changed(): called when the charts pause or resume. edit(index): the user wants to change a plot. pick(t): the user chose a
  /// time. read(text): values for a screen reader.
  constructor(parent, {changed, edit, pick, read}) {
    this.parent = parent;
    this.changed = changed;
    this.edit = edit;
    this.pick = pick;
    this.read = read;
    this.whole = null;   // {from, to} of a recording, which is shown instead of the newest poses
    this.frozen = null;  // {from, to} in s on the axis of the history; null: follows
    this.range = [-settings.window_s, 0];
    this.bands = [];
    this.charts = [];
    this.origin = 0;
    this.hasTruth = false;
    this.hasBeside = false;  // a second recording is shown
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
      edit: index => this.edit(index),
      read: text => this.read(text),
      pick: t => this.pick(this.origin + t),
      hover: () => {
        for (const chart of this.charts) chart.showValues();
      },
    };
    this.charts = chartList(this.hasTruth, this.hasBeside).map(spec => new Chart(this.parent, spec, this, actions));
    this.#resize();
    this.drawnMs = 0;
  }

  /// The poses have a truth.
  showTruth() {
    if (this.hasTruth) return;
    this.hasTruth = true;
    this.rebuild();
  }

  get shown() { return this.frozen ?? this.whole ?? {from: this.now - settings.window_s, to: this.now}; }

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
    const middle = this.frozen || this.whole ? (from + to) / 2 : to;
    this.freeze(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  /// Shows a recording instead of the newest poses: {from, to}; null: ends it.
  showRecording(whole) {
    this.whole = whole;
    this.follow();
  }

  /// now: right edge of the charts, or a line in a recording. origin: the time that the axis calls 0.
  /// beside: history of the same sensor in a second recording, or null.
  draw(history, now, origin, beside = null) {
    if (this.hasBeside !== (beside !== null)) {
      this.hasBeside = beside !== null;
      this.rebuild();
    }
    this.#drawCurves(history, now, origin, beside);
    if (document.hidden) return;
    for (const chart of this.charts) {
      chart.showNow(this.whole ? now - this.origin : null);
      if (this.whole) chart.showValues();
    }
  }

  #drawCurves(history, now, origin, beside) {
    if (!this.frozen) this.now = now;
    if (this.frozen && this.whole && this.before < now && now > this.frozen.to && this.before <= this.frozen.to) this.#turnPage();
    this.before = now;
    const ms = performance.now();
    if (document.hidden || (this.drawnMs > 0 && ms - this.drawnMs < this.#interval())) return;
    const still = this.frozen ?? this.whole;
    if (still && this.drawnMs > 0 && this.drawn === still) return;
    this.drawn = still;
    this.drawnMs = ms;
    this.origin = origin;
    const {from, to} = this.shown;
    this.range = [from - this.origin, to - this.origin];
    this.bands =
        bands(history, from, to, this.whole ? history.end : now).map(band => ({...band, from: band.from - this.origin, to: band.to - this.origin}));
    for (const chart of this.charts) {
      const tables = [history, beside].filter(Boolean).map(each => this.#curves(each, chart.spec));
      chart.setData(tables.length > 1 ? uPlot.join(tables) : tables[0]);
    }
  }

  /// Times and values of one history for a chart.
  #curves(history, spec) {
    const {from, to} = this.shown;
    const series = spec.series.filter(({beside}) => !beside);
    const [times, ...values] = decimate(history, from, to, Math.max(100, this.width), series);
    return [times.map(t => t - this.origin), ...spec.deviation ? this.#deviations(history, series, values) : values];
  }

  #deviations(history, series, values) {
    const {from, to} = this.shown;
    return series.map((one, n) => {
      const mean = meanOf(history, from, to, one);
      return values[n].map(value => value === null ? null : difference(value, mean, one.wraps));
    });
  }

  /// A recording that plays left the time shown.
  #turnPage() {
    const span = this.frozen.to - this.frozen.from;
    this.frozen = {from: this.frozen.to, to: this.frozen.to + span};
    this.drawnMs = 0;
  }

  /// Interval between two drawings: the time in which the curves move by one pixel.
  #interval() { return Math.max(kFastMs, Math.min(1000 * settings.window_s / Math.max(1, this.width), kSlowMs)); }

  #resize() {
    this.width = this.parent.clientWidth;
    const width = Math.max(120, this.width - 8);
    const height = Math.max(kLeastHeight, Math.floor((this.parent.clientHeight - 4) / this.charts.length) - 4);
    for (const chart of this.charts) chart.setSize(width, Math.min(height, kMostHeight));
    this.drawnMs = 0;
  }
}
