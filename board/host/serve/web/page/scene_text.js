// Text alternative of the scene: what it shows, in words.
import {fixed} from './readout.js';
import {kUnits, settings} from './settings.js';
import {nameOf} from './state.js';

const kCalmMs = 1000;  // between two texts
let shownMs = -kCalmMs;

function sentenceOf({number, newest: pose}) {
  const name = `Sensor ${nameOf(number)}`;
  if (!pose.valid) return `${name}: no valid pose.`;
  const unit = kUnits[settings.units];
  const length = mm => fixed(mm * unit.scale, unit.digits);
  const [x, y, z] = pose.position_m.map(v => length(1000 * v));
  const error = Number.isFinite(pose.true_mm) ? `; error ${length(pose.true_mm)}` : '';
  return `${name}: x ${x}, y ${y}, z ${z} ${settings.units}, ${length(1000 * Math.hypot(...pose.position_m))} from the source, expected error ${
      length(pose.expected_mm)}${error}.`;
}

/// sensors: tracked ones. live: their poses are of now.
export function describe(canvas, sensors, live, metal) {
  const ms = performance.now();
  if (ms - shownMs < kCalmMs) return;
  shownMs = ms;
  const shown = live ? sensors.map(sentenceOf) : ['No sensor now.'];
  if (metal.length) shown.push('A sphere of metal is near.');
  canvas.setAttribute('aria-label', ['Scene with the source at the origin.', ...shown].join(' '));
}
