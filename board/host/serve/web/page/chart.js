// One chart: a heading with the values at the cursor, curves, bands of faults, and the limit if there is one.
import uPlot from 'uplot';

import {palette} from './palette.js';
import {fixed} from './readout.js';

const kBandColors = {
  1: 'caution',
  2: 'bad',
  3: 'muted'
};
const kCursorSteps = 50;  // of a key, over the time shown
const kNear = 20;         // points
const kDrag = 4;          // pixels: a longer way of the mouse selects a time
const kHatch = 6;         // pixels between the lines of invalid poses

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

/// Invalid poses are hatched, so that the bands differ without colour.
function drawBands(u, bands) {
  const {ctx: context, bbox: {left, top, width, height}} = u;
  context.save();
  context.beginPath();
  context.rect(left, top, width, height);
  context.clip();
  for (const band of bands) {
    // What is visible of the band: of a time that jumps by a year, it could be a billion pixels wide.
    const x = Math.max(u.valToPos(band.from, 'x', true), left);
    const w = Math.max(Math.min(u.valToPos(band.to, 'x', true), left + width) - x, 1.5 * devicePixelRatio);
    if (x > left + width || u.valToPos(band.to, 'x', true) < left) continue;
    context.fillStyle = context.strokeStyle = palette[kBandColors[band.level]];
    context.globalAlpha = band.level === 3 ? 0.12 : 0.2;
    context.fillRect(x, top, w, height);
    if (band.level !== 2) continue;
    context.save();
    context.beginPath();
    context.rect(x, top, w, height);
    context.clip();
    context.globalAlpha = 0.55;
    context.lineWidth = devicePixelRatio;
    const step = kHatch * devicePixelRatio;
    for (let at = x - height - (x - height) % step; at < x + w; at += step) line(context, at, top + height, at + height, top);
    context.restore();
  }
  context.restore();
}

function drawLimit(u, limit) {
  const {ctx: context, bbox: {left, top, width, height}} = u;
  const y = u.valToPos(limit, 'y', true);
  if (y < top || y > top + height) return;
  context.save();
  context.strokeStyle = palette.bad;
  context.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  context.lineWidth = 1.5 * devicePixelRatio;
  line(context, left, y, left + width, y);
  context.restore();
}

export class Chart {
  /// plots: shared state: {range, bands}. select(from, to), reset(), pick(t), edit(index): actions of the user; hover(): the cursor has
  /// moved; read(text): values for a screen reader.
  constructor(parent, spec, plots, {select, reset, pick, edit, hover, read}) {
    this.spec = spec;
    this.box = document.createElement('figure');
    this.heading = document.createElement('figcaption');
    this.values = [];
    this.box.append(this.heading);
    parent.append(this.box);
    this.#makeHeading(edit);
    const size = parseFloat(getComputedStyle(document.documentElement).fontSize);
    const font = `${Math.max(12, Math.round(0.75 * size))}px system-ui, sans-serif`;
    const axis = {stroke: () => palette.muted, grid: {stroke: () => palette.grid, width: 1}, ticks: {show: false}, font};
    const numbers = (u, splits) => splits.map(v => v === null ? '' : String(Number(v.toPrecision(6))).replace('-', '−'));
    const range = unit => (u, low, high) => spanOf(spec.zero, spec.series.find(series => series.unit === unit).digits, low, high);
    const scaleOf = unit => unit === spec.units[0] ? 'y' : `y ${unit}`;
    const scales = spec.units.map(unit => [scaleOf(unit), {range: range(unit)}]);
    const upright = {...axis, values: numbers, size: 3.6 * size, gap: 4, space: 1.4 * size};
    const sides = [{side: 3}, {side: 1, grid: {show: false}}];  // left, right
    const axes = spec.units.slice(0, sides.length).map((unit, n) => ({...upright, scale: scaleOf(unit), ...sides[n]}));
    const curve = {width: 0.11 * size, points: {show: false}};
    const curves = spec.series.map(({label, unit, color, dash}) => ({...curve, label, scale: scaleOf(unit), stroke: () => palette[color], dash}));
    this.u = new uPlot(
        {
          width: 300,
          height: 110,
          legend: {show: false},
          padding: [6, 10, 0, 0],
          cursor: {
            sync: {key: 'tricoil', scales: ['x', null]},
            y: false,
            points: {size: 6},
            drag: {x: true, y: false, setScale: false},
            bind: {
              dblclick: () => () => {
                reset();
                return null;
              }
            }
          },
          scales: {x: {time: false, range: () => plots.range}, ...Object.fromEntries(scales)},
          // The lowest number of y reaches below the plot: the numbers of x keep clear of it.
          axes: [{...axis, values: numbers, size: 1.7 * size, gap: 7}, ...axes],
          series: [{}, ...curves],
          hooks: {
            drawClear: [u => drawBands(u, plots.bands)],
            draw: [u => {
              if (this.spec.limit !== undefined) drawLimit(u, this.spec.limit);
            }],
            setSelect: [u => {
              if (u.select.width < kDrag) return;
              select(u.posToVal(u.select.left, 'x'), u.posToVal(u.select.left + u.select.width, 'x'));
              u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
            }],
            setCursor: [() => hover()],
          },
        },
        [[], ...spec.series.map(() => [])], this.box);
    this.u.over.setAttribute('aria-hidden', 'true');
    this.now = document.createElement('i');
    this.now.className = 'now';
    this.u.over.append(this.now);
    this.box.tabIndex = 0;
    this.box.addEventListener('keydown', event => {
      if (event.target !== this.box || event.ctrlKey || event.metaKey || event.altKey || !this.#moveCursor(event.key)) return;
      event.preventDefault();
      event.stopPropagation();
      hover();
      read(this.#reading);
    });
    let pressed = 0;
    this.u.over.addEventListener('mousedown', event => {
      pressed = event.offsetX;
    });
    this.u.over.addEventListener('click', event => {
      if (Math.abs(event.offsetX - pressed) < kDrag) pick(this.u.posToVal(event.offsetX, 'x'));
    });
  }

  setData(data) {
    this.data = data;
    this.u.setData(data);
    this.showValues();
  }

  setSize(width, height) { this.u.setSize({width, height: Math.max(60, height - this.heading.offsetHeight)}); }

  /// Line at time t of the axis; null: none.
  showNow(t) {
    const [from, to] = this.u.scales.x.min === undefined ? [0, 0] : [this.u.scales.x.min, this.u.scales.x.max];
    this.nowIndex = t === null ? null : this.#indexAt(t);
    this.now.hidden = t === null || t < from || t > to;
    if (!this.now.hidden) this.now.style.left = `${100 * (t - from) / (to - from)}%`;
  }

  #indexAt(t) {
    const times = this.data?.[0] ?? [];
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= t)
        low = middle + 1;
      else
        high = middle;
    }
    return Math.max(0, low - 1);
  }

  /// Values at the cursor, or at the line of showNow(), or the newest.
  showValues() {
    if (!this.data) return;
    const at = this.u.cursor.idx ?? this.nowIndex ?? this.data[0].length - 1;
    this.spec.series.forEach((series, n) => {
      const values = this.data[n + 1];
      let from = at;  // the other recording has other times
      while (values[from] === undefined && from > 0 && at - from < kNear) --from;
      const value = values[from];
      const text = value === null || value === undefined ? '–' : fixed(value, series.digits);
      if (this.values[n].textContent !== text) this.values[n].textContent = text;
    });
  }

  /// Keys move the cursor through the time shown; all charts follow.
  #moveCursor(key) {
    const times = this.data?.[0] ?? [];
    const last = times.length - 1;
    if (last < 0) return false;
    const at = this.u.cursor.idx ?? last, step = Math.max(1, Math.round(last / kCursorSteps));
    const next = {ArrowLeft: at - step, ArrowRight: at + step, Home: 0, End: last}[key];
    if (next === undefined) return false;
    const left = this.u.valToPos(times[Math.max(0, Math.min(next, last))], 'x');
    this.u.setCursor({left: Math.max(0, Math.min(left, this.u.over.clientWidth - 1)), top: 1});
    return true;
  }

  get #reading() {
    const at = this.u.cursor.idx;
    const values = this.spec.series.map((series, n) => `${series.label} ${this.values[n].textContent}`);
    return `${this.spec.title} at ${fixed(this.data[0][at] ?? 0, 1)} s: ${values.join(', ')} ${this.spec.unit}`;
  }

  destroy() {
    this.u.destroy();
    this.box.remove();
  }

  #makeHeading(edit) {
    const title = document.createElement('strong');
    title.textContent = this.spec.title;
    this.heading.append(title, ` ${this.spec.unit}`);
    for (const series of this.spec.series) {
      const item = document.createElement('span');
      item.className = 'key';
      item.style.setProperty('--color', `var(--${series.color})`);
      item.classList.toggle('dashed', series.dash !== undefined);
      const value = document.createElement('output');
      value.setAttribute('aria-live', 'off');
      item.append(series.label, ' ', value);
      this.values.push(value);
      this.heading.append(item);
    }
    const button = document.createElement('button');
    button.textContent = '⋯';
    button.title = button.ariaLabel = `Change the plot ${this.spec.title}`;
    button.addEventListener('click', () => edit(this.spec.index));
    this.heading.append(button);
  }
}

/// Range of a y axis: the curves with a margin, never narrower than a few of the last digits. zero: it begins at 0.
function spanOf(zero, digits, low, high) {
  if (low === null || high === null || low === undefined) return zero ? [0, 1] : [-1, 1];
  const least = 4 * 10 ** -digits;
  const bottom = zero ? 0 : low;
  const margin = Math.max(0.08 * (high - bottom), (least - (high - bottom)) / 2, 0);
  return [zero ? 0 : bottom - margin, high + margin + (high === bottom ? least : 0)];
}
