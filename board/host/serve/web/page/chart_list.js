// Charts of the page: titles, units, colours and columns of the history.
import {kConventions} from './attitude.js';
import {kUnits, settings} from './settings.js';

const kAxes = ['x', 'y', 'z'];
/// Each angle has the colour of its rotation axis.
const kAngleColors = {
  zyx: ['z', 'y', 'x'],
  xyz: kAxes,
  vector: kAxes
};

/// [{title, unit, digits, series: [{label, name, scale, wraps, color, dash}], zero, limit}]. zero: the axis begins at 0.
/// hasTruth: with the error against the truth.
export function chartList(hasTruth) {
  const unit = kUnits[settings.units];
  const turn = kConventions[settings.order];
  return [
    {title: 'position', unit: settings.units, digits: unit.digits, series: kAxes.map(name => ({label: name, name, scale: unit.scale, color: name}))},
    {
      title: 'attitude',
      unit: '°',
      digits: 2,
      series: turn.names.map((label, n) => ({label, name: `a${n}`, scale: 1, wraps: true, color: kAngleColors[settings.order][n]}))
    },
    {title: 'speed', unit: 'm/s', digits: 3, zero: true, series: [{label: 'speed', name: 'speed', scale: 1, color: 'accent'}]},
    {
      title: 'error',
      unit: 'mm',
      digits: 3,
      zero: true,
      series: [
        {label: 'sigma', name: 'sigma', scale: 1, color: 'muted', dash: [4, 3]}, {label: 'predicted', name: 'error', scale: 1, color: 'caution'},
        {label: 'expected', name: 'expected', scale: 1, color: 'accent'}, ...hasTruth ? [{label: 'true', name: 'true', scale: 1, color: 'bad'}] : []
      ]
    },
    {
      title: 'distortion',
      unit: 'mm',
      digits: 2,
      zero: true,
      limit: settings.limit_mm,
      series: [{label: 'distortion', name: 'distortion', scale: 1, color: 'caution'}]
    },
    {title: 'signal to noise', unit: 'dB', digits: 1, series: [{label: 'S/N', name: 'snr', scale: 1, color: 'accent'}]},
  ];
}
