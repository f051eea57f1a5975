// Panel with captured points and their distances, the pivot of a pointer, and recordings.
import {save} from './csv.js';
import {Pivot} from './pivot.js';
import {averageOf, distance, pointsCsv} from './points.js';
import {kUnits, settings} from './settings.js';
import {page} from './state.js';

const kMostPivotPoses = 20_000;

/// Element with attributes and children.
export function make(tag, attributes = {}, ...children) {
  const made = Object.assign(document.createElement(tag), attributes);
  made.append(...children);
  return made;
}

const inUnit = mm => (mm * kUnits[settings.units].scale).toFixed(kUnits[settings.units].digits + 1);

export class Tools {
  /// say(text): shows the result of an action.
  constructor(panel, say) {
    this.panel = panel;
    this.say = say;
    this.points = [];
    this.from = null;   // point from which distances are measured; null: each from the previous point
    this.pivot = null;  // Pivot while poses are collected
    this.pivotText = 'Put the tip into a small hole, start, and tilt the pointer to all sides for 20 s.';
    this.pointRows = make('tbody');
    this.pivotButton = make('button', {id: 'pivot', onclick: () => this.togglePivot()}, 'Start');
    this.pivotResult = make('p', {id: 'pivot_result', role: 'status'});
    this.recordings = make('section', {ariaLabel: 'Recordings'});
    panel.append(
        this.#pointsSection(), make('section', {ariaLabel: 'Pivot'}, make('h2', {}, 'Pivot: tip of a pointer'), this.pivotButton, this.pivotResult),
        this.recordings);
    this.show();
  }

  #pointsSection() {
    this.unitHead = make('th', {colSpan: 3});
    const head = make(
        'thead', {},
        make(
            'tr', {}, make('th', {}, 'point'), this.unitHead, make('th', {title: 'RMS about the average'}, '±'), make('th', {}, 'distance'),
            make('th')));
    return make(
        'section', {ariaLabel: 'Points'}, make('h2', {}, 'Points'), make('table', {id: 'points'}, head, this.pointRows),
        make('p', {}, 'Distances are from the previous point, or from the point that you choose with “from”.'),
        make('button', {onclick: () => save('points.csv', pointsCsv(this.points, this.from))}, 'CSV'), ' ',
        make(
            'button', {
              onclick: () => {
                this.points = [];
                this.from = null;
                this.show();
              }
            },
            'Clear points'));
  }

  capture() {
    const tracked = page.chosen;
    if (!tracked?.newest?.valid || document.body.dataset.usable === 'false') return this.say('No valid pose to capture.');
    this.#add({position_mm: tracked.newest.position_m.map(v => 1000 * v), spread_mm: 0, poses: 1});
  }

  captureAverage() {
    const tracked = page.chosen;
    if (!tracked?.newest || document.body.dataset.usable === 'false') return this.say('No valid pose to capture.');
    const average = averageOf(tracked.history, tracked.newest.t);
    if (average.error) return this.say(average.error);
    this.#add(average);
  }

  #add(point) {
    const tracked = page.chosen;
    this.points.push({...point, sensor: tracked.number, flags: tracked.newest.names.join(' ')});
    const before = this.points.at(-2);
    const flagged = tracked.newest.names.length ? ` Flags: ${tracked.newest.names.join(', ')}.` : '';
    this.say(`Point ${this.points.length} captured${
        before ? `, ${inUnit(distance(this.points.at(-1), before))} ${settings.units} from the one before` : ''}.${flagged}`);
    this.show();
  }

  togglePivot() {
    if (!this.pivot) {
      this.pivot = new Pivot();
      this.pivotText = 'Tilt the pointer to all sides, its tip at rest.';
    } else {
      this.pivotText = textOf(this.pivot.solve());
      this.pivot = null;
    }
    this.show();
  }

  /// Call it for every valid pose of the chosen sensor.
  collect(pose) {
    if (!this.pivot || this.pivot.poses.length >= kMostPivotPoses) return;
    this.pivot.add(pose);
    if (this.pivot.poses.length % 30 === 0) this.pivotResult.textContent = `${this.pivotText} ${this.pivot.poses.length} poses.`;
  }

  show() {
    this.unitHead.textContent = `x, y, z in ${settings.units}`;
    this.pivotButton.textContent = this.pivot ? 'Finish' : 'Start';
    this.pivotResult.textContent = this.pivotText;
    this.pointRows.replaceChildren(...this.points.map((point, n) => {
      const from = this.from ?? this.points[n - 1];
      const isFrom = point === this.from;
      const cells =
          [...point.position_mm.map(inUnit), point.poses > 1 ? inUnit(point.spread_mm) : '', from && !isFrom ? inUnit(distance(point, from)) : ''];
      const choose = make(
          'button', {
            ariaPressed: String(isFrom),
            onclick: () => {
              this.from = isFrom ? null : point;
              this.show();
            }
          },
          'from');
      return make(
          'tr', {className: isFrom ? 'from' : ''}, make('td', {}, `${n + 1}${point.flags ? ' ▲' : ''}`), ...cells.map(text => make('td', {}, text)),
          make('td', {}, choose));
    }));
  }
}

function textOf(result) {
  if (result.error) return result.error;
  const tip = result.tip_m.map(v => v.toFixed(6)).join(',');
  return `Tip at ${result.tip_m.map(v => (1000 * v).toFixed(2)).join(', ')} mm in the sensor frame, residual ${result.rms_mm.toFixed(2)} mm RMS, ${
      result.poses} poses. Use it with: --tip ${tip}`;
}
