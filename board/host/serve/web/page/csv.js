// CSV files of the data that the page shows.
import {angles} from './attitude.js';
import {namesOf} from './sample.js';

const kColumns = [
  ['x_mm', 'x', 4], ['y_mm', 'y', 4], ['z_mm', 'z', 4], ['qw', 'qw', 7], ['qx', 'qx', 7], ['qy', 'qy', 7], ['qz', 'qz', 7], ['speed_m_s', 'speed', 4],
  ['sigma_mm', 'sigma', 4], ['predicted_error_mm', 'error', 4], ['expected_error_mm', 'expected', 4], ['distortion_mm', 'distortion', 4],
  ['snr_db', 'snr', 2]
];
const kGap = 3;  // level of an entry without a pose

/// Every pose of the history within [from, to], as text. Values of invalid poses are empty. angleNames: of the convention in use.
export function historyCsv(history, from, to, sensor, angleNames) {
  const c = history.columns;
  const text = (value, digits) => Number.isFinite(value) ? value.toFixed(digits) : '';
  const titles = kColumns.map(([title]) => title);
  const lines = [['time_s', 'sensor', ...titles, ...angleNames.map(name => `${name.replaceAll(' ', '_')}_deg`), 'flag_names'].join(',')];
  for (let n = history.at(from); n < history.length && history.times[n] <= to; ++n) {
    if (c.level[n] === kGap) continue;
    const values = kColumns.map(([, name, digits]) => text(c[name][n], digits));
    const turned = angles([c.qw[n], c.qx[n], c.qy[n], c.qz[n]], history.turn).map(angle => text(angle, 4));
    lines.push([history.times[n].toFixed(6), sensor, ...values, ...turned, namesOf(c.flags[n]).join(' ')].join(','));
  }
  return lines.join('\n') + '\n';
}

export function save(name, text) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], {type: 'text/csv'}));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
