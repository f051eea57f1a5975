// Signals of the page, and the charts that show them: titles, units, colours and columns of the history.
import {kConventions} from './attitude.js';
import {kUnits, settings} from './settings.js';

/// Each angle has the colour of its rotation axis.
const kAngleColors = {
  zyx: ['z', 'y', 'x'],
  xyz: ['x', 'y', 'z'],
  vector: ['x', 'y', 'z']
};

/// By column of the history: {group, label, name, unit, digits, scale, color, wraps, zero, dash}. zero: the axis begins at 0.
export function signals() {
  const unit = kUnits[settings.units];
  const turn = kConventions[settings.order];
  const of = (group, unit, digits, more = {}) => ({group, unit, digits, scale: 1, ...more});
  const position = of('position', settings.units, unit.digits, {scale: unit.scale});
  const error = of('error', 'mm', 3, {zero: true});
  const table = [
    ...['x', 'y', 'z'].map(name => [name, name, name, position]),
    ...turn.names.map((label, n) => [`a${n}`, label, kAngleColors[settings.order][n], of('attitude', '°', 2, {wraps: true})]),
    ...['w', 'x', 'y', 'z'].map(part => [`q${part}`, `q ${part}`, part === 'w' ? 'muted' : part, of('quaternion', '', 4)]),
    ['speed', 'speed', 'accent', of('speed', 'm/s', 3, {zero: true})], ['true', 'error of each pose', 'error', error],
    ['expected', 'expected error, RMS 1 s', 'accent', error], ['sigma', 'expected error of each pose', 'muted', {...error, dash: [4, 3]}],
    ['error', 'error model of each pose', 'caution', error],
    ['distortion', 'distortion', 'caution', of('distortion', 'mm', 2, {zero: true, limit: settings.limit_mm})],
    ['snr', 'S/N', 'accent', of('signal to noise', 'dB', 1)]
  ];
  return Object.fromEntries(table.map(([name, label, color, more]) => [name, {label, name, color, ...more}]));
}

const unique = values => [...new Set(values)];

/// Charts of the user's layout: [{index, title, unit, units, deviation, series, zero, limit}]. units: each has an axis. index: in
/// settings.plots. hasTruth: with the error against the truth. hasBeside: each signal also of a second recording, dashed.
export function chartList(hasTruth, hasBeside) {
  const all = signals();
  return settings.plots.map((plot, index) => specOf(plot, index, plot.signals.filter(name => hasTruth || name !== 'true').map(name => all[name])))
      .filter(spec => spec.series.length)
      .map(
          spec => hasBeside ?
              {...spec, series: [...spec.series, ...spec.series.map(one => ({...one, label: `B ${one.label}`, dash: [5, 4], beside: true}))]} :
              spec);
}

function specOf({deviation}, index, series) {
  const units = unique(series.map(({unit}) => unit));
  const shared = series.find(({limit}) => limit);
  return {
    index,
    title: unique(series.map(({group}) => group)).join(', ') + (deviation ? ' − mean' : ''),
    unit: units.length === 1 ? units[0] : '',
    units,
    deviation,
    series: series.map(one => units.length === 1 ? one : {...one, label: `${one.label} ${one.unit}`}),
    zero: !deviation && series.every(({zero}) => zero),
    limit: shared && !deviation && units[0] === shared.unit ? shared.limit : undefined
  };
}
