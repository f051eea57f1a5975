// Levels of the channels of the chosen sensor: what `tricoil device watch --levels` prints.
import {page} from './state.js';
import {make} from './tools.js';

const kHead = [
  ['channel', 'Coil of the sensor'], ['coupling', 'Mean of the last second, in the demodulator\u2019s unit'],
  ['level', 'At the converter, of full scale'], ['noise', 'Standard deviation of single columns'], ['S/N', 'Of single columns']
];
const exact = (value, digits) => value === null ? '–' : value.toExponential(digits).replaceAll('-', '−');
const fixed = (value, digits, unit) => value === null ? '–' : `${value.toFixed(digits)} ${unit}`;

function coilRows({coil, columns, gain_step, saturated, without_reference, coupling, level, noise, snr_db}) {
  const about = [
    `gain step ${gain_step}`, saturated ? `▲ saturated ${saturated} of ${columns}` : 'not saturated',
    without_reference ? `▲ no reference in ${without_reference} of ${columns}` : 'reference found'
  ];
  const row = k => [String(k + 1), exact(coupling[k], 3), fixed(level[k] === 0 ? null : 100 * level[k], 1, '%'), exact(noise[k], 1), fixed(snr_db[k], 1, 'dB')];
  return make(
      'tbody', {}, make('tr', {}, make('th', {colSpan: kHead.length, scope: 'rowgroup'}, `S${coil}: ${about.join(', ')}`)),
      ...[0, 1, 2].map(k => make('tr', {}, ...row(k).map(cell => make('td', {}, cell)))));
}

export class Levels {
  /// panel: gets the section.
  constructor(panel) {
    this.panel = panel;
    this.rows = [];
    this.title = make('h2', {tabIndex: -1}, 'Levels');
    this.note = make('p');
    this.flags = make('p', {id: 'flags'});
    this.table = make('table', {ariaLabel: 'Levels of the last second'});
    this.head = make('thead', {}, make('tr', {}, ...kHead.map(([name, title]) => make('th', {title}, name))));
    panel.append(make('section', {id: 'levels', ariaLabel: 'Levels'}, this.title, this.note, this.flags, this.table));
  }

  /// rows: of the server, each second.
  take(rows) {
    this.rows = rows;
    this.show();
  }

  /// Draws the newest rows, if the panel is open.
  show() {
    if (this.panel.hidden) return;
    const rows = page.playback ? [] : this.rows.filter(({sensor}) => sensor === page.selected);
    const old = page.link !== 'live';
    this.note.textContent = page.playback ? 'A playback has no levels: use tricoil serve with the recording.' :
        rows.length === 0                 ? 'No columns: the device sends poses only, or has not begun.' :
        old                               ? 'Old: no columns come.' :
                                            'Of the last second. Keep the sensor at rest: motion counts as noise.';
    this.table.dataset.old = String(old);
    this.table.replaceChildren(...rows.length ? [this.head, ...rows.map(coilRows)] : []);
  }

  /// Leads the keyboard to the section.
  focus() { this.title.focus(); }
}
