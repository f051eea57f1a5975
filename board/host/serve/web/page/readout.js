// Numbers of the chosen sensor: pose, quaternion, and tiles with rate, latency, jitter, signal, error and distortion.
import {angles, kConventions, relative} from './attitude.js';
import {kUnits, settings} from './settings.js';
import {jitter, rate} from './statistics.js';

const kTilesMs = 250;
const element = id => document.getElementById(id);

function put(id, text) {
  const output = element(id);
  if (output.textContent !== text) output.textContent = text;
}

/// Text of a number, with a sign only if it is not zero.
export const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=0\.?0*$)/, '').replace('-', '−');
const number = (value, digits) => value === null || !Number.isFinite(value) ? '–' : fixed(value, digits);

/// Lengths of some micrometres to metres with three digits.
const short = mm => mm === null || !Number.isFinite(mm) ? '–' : mm < 1 ? mm.toFixed(3) : mm < 100 ? mm.toFixed(2) : mm.toFixed(0);

/// False if there is nothing to measure, so that no number stands beside it.
const isMeasured = pose => !pose.names.some(name => name === 'no_sensor' || name === 'no_reference');

export class Readout {
  #tilesMs = 0;

  show(tracked) {
    const {newest: pose} = tracked;
    const unit = kUnits[settings.units];
    const known = isMeasured(pose) ? v => v : () => NaN;
    pose.position_m.forEach((v, n) => put(`p${n}`, number(known(1000 * v * unit.scale), unit.digits)));
    angles(pose.q_wxyz, tracked.turn).forEach((v, n) => put(`a${n}`, number(known(v), 2)));
    put('quaternion', relative(pose.q_wxyz, tracked.boresight).map(v => number(known(v), 4)).join('  '));
    element('relative').hidden = !tracked.boresight;
  }

  /// Units and names of the angles.
  showConventions() {
    for (const output of document.querySelectorAll('[data-unit]')) output.textContent = settings.units;
    kConventions[settings.order].names.forEach((name, n) => put(`n${n}`, name));
  }

  /// latency_ms: null if unknown. now: is the sensor tracked now?
  showTiles(tracked, latency_ms, now) {
    const ms = performance.now();
    if (ms - this.#tilesMs < kTilesMs) return;
    this.#tilesMs = ms;
    const {history, newest: pose} = tracked;
    put('rate', now ? number(rate(history, pose.t), 0) : '0');
    put('latency', now && latency_ms >= 0 ? number(latency_ms, 1) : '–');  // negative while the server still matches the clocks
    put('jitter', now && isMeasured(pose) ? short(jitter(history, pose.t)) : '–');
    put('snr', isMeasured(pose) ? number(pose.snr_db, 1) : '–');
    put('expected', pose.valid ? short(pose.expected_mm) : '–');
    put('distortion', isMeasured(pose) ? short(pose.distortion_mm) : '–');
    put('limit', `limit ${settings.limit_mm} mm`);
    const share = Math.min(1, (pose.distortion_mm || 0) / settings.limit_mm);
    element('distortion_bar').style.setProperty('--share', String(share));
    element('distortion_bar').dataset.over = String(pose.distortion_mm > settings.limit_mm || pose.names.includes('distorted'));
  }
}
