// Plots of one sensor's last ten seconds.
import uPlot from 'uplot';
import {kSeconds} from './history.js';

const kColors = ['#c33', '#2a8a4a', '#36c'];

/// columns: indices into History.columns.
const kPlots = [
  {title: 'position, mm', names: ['x', 'y', 'z'], columns: [0, 1, 2]},
  {title: 'speed, m/s', names: ['speed'], columns: [3]},
  {title: 'predicted error, mm', names: ['error'], columns: [4]},
  {title: 'distortion, mm', names: ['distortion'], columns: [5]},
  {title: 'signal / noise, dB', names: ['S/N'], columns: [6]},
];

export class Plots {
  constructor(parent) {
    this.plots = kPlots.map(plot => {
      const axis = {stroke: 'gray', grid: {stroke: '#8883', width: 1}, ticks: {show: false}, font: '11px system-ui', size: 30};
      const series = plot.names.map((label, n) => ({label, stroke: kColors[n], width: 1.5, points: {show: false}}));
      const options = {title: plot.title, width: 300, height: 120, legend: {show: false}, cursor: {show: false}, padding: [4, 8, 0, 14],
                       scales: {x: {time: false, range: [-kSeconds, 0]}}, axes: [axis, {...axis, size: 44}], series: [{}, ...series]};
      return {...plot, chart: new uPlot(options, [[], ...plot.names.map(() => [])], parent)};
    });
    new ResizeObserver(() => {
      const height = Math.max(90, Math.floor(parent.clientHeight / kPlots.length) - 28);
      for (const plot of this.plots) plot.chart.setSize({width: parent.clientWidth - 8, height: Math.min(height, 160)});
    }).observe(parent);
  }

  /// Draws the last ten seconds before `now`: time of the newest pose (s since 1970) plus the time since it arrived.
  draw(history, now) {
    history.forget(now);
    const ages = history.times.map(t => t - now);
    for (const plot of this.plots) plot.chart.setData([ages, ...plot.columns.map(n => history.columns[n])]);
  }
}
