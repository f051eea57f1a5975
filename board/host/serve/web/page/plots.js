// Plots of the last ten seconds.
import uPlot from 'uplot';

const kSeconds = 10;
const kMost = 600;
const kColors = ['#c33', '#2a8a4a', '#36c'];

const kPlots = [
  {title: 'position, mm', names: ['x', 'y', 'z'], of: pose => pose.p.map(v => 1000 * v)},
  {title: 'speed, m/s', names: ['speed'], of: (pose, speed) => [speed]},
  {title: 'predicted error, mm', names: ['error'], of: pose => [pose.error ? pose.error[0] : null]},
  {title: 'distortion, chi-square', names: ['distortion'], of: pose => [pose.distortion]},
  {title: 'signal / noise, dB', names: ['S/N'], of: pose => [pose.snr]},
];

export class Plots {
  constructor(parent) {
    this.times = [];
    this.previous = null;
    this.plots = kPlots.map(plot => {
      const axis = {stroke: 'gray', grid: {stroke: '#8883', width: 1}, ticks: {show: false}, font: '11px system-ui', size: 30};
      const series = plot.names.map((label, n) => ({label, stroke: kColors[n], width: 1.5, points: {show: false}}));
      const options = {title: plot.title, width: 300, height: 120, legend: {show: false}, cursor: {show: false}, padding: [4, 8, 0, 14],
                       scales: {x: {time: false}}, axes: [axis, {...axis, size: 44}], series: [{}, ...series]};
      return {...plot, columns: plot.names.map(() => []), chart: new uPlot(options, [[], ...plot.names.map(() => [])], parent)};
    });
    new ResizeObserver(() => {
      const height = Math.max(90, Math.floor(parent.clientHeight / kPlots.length) - 28);
      for (const plot of this.plots) plot.chart.setSize({width: parent.clientWidth - 8, height: Math.min(height, 160)});
    }).observe(parent);
  }

  /// Invalid poses leave a gap.
  add(pose) {
    const t = pose.t / 1000;
    if (this.previous && t < this.previous.t / 1000) this.clear();
    const dt = this.previous ? (pose.t - this.previous.t) / 1000 : 0;
    const speed = dt > 0 && this.previous.valid && pose.valid ? Math.hypot(...pose.p.map((v, n) => v - this.previous.p[n])) / dt : null;
    this.previous = pose;
    this.times.push(t);
    for (const plot of this.plots) {
      const values = plot.of(pose, speed);
      plot.columns.forEach((column, n) => column.push(pose.valid || plot.names[0] === 'S/N' ? values[n] : null));
    }
    while (this.times.length > kMost || this.times[0] < t - kSeconds) {
      this.times.shift();
      for (const plot of this.plots) plot.columns.forEach(column => column.shift());
    }
  }

  clear() {
    this.times.length = 0;
    for (const plot of this.plots) plot.columns.forEach(column => { column.length = 0; });
  }

  draw() {
    const newest = this.times.at(-1);
    const ages = this.times.map(t => t - newest);
    for (const plot of this.plots) plot.chart.setData([ages, ...plot.columns]);
  }
}
