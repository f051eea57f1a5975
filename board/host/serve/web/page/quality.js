// Quality of the measurement: a level, a sentence and the remedy. Metal and errors are never 'good'.
import {Level} from './history.js';

/// Flags in the order of their importance: the first that is set gives the sentence.
const kFlags = {
  no_reference: {level: 'bad', text: 'No source current.', remedy: 'Check the power and the cable of the source.'},
  no_sensor: {level: 'bad', text: 'No sensor found.', remedy: 'Check the plug and the cable of the sensor.'},
  wrong_handedness: {level: 'bad', text: 'A coil is reversed, or two coils are swapped.', remedy: 'Check the wiring with: tricoil calibrate wiring'},
  saturated: {level: 'bad', text: 'Signal too strong: an amplifier is saturated.', remedy: 'Move the sensor away from the source.'},
  low_signal: {level: 'bad', text: 'Signal too weak.', remedy: 'Move the sensor closer to the source.'},
  stale: {level: 'bad', text: 'No new measurement of this sensor.', remedy: 'Check its plug and the link to the device.'},
  hemisphere_unknown: {level: 'bad', text: 'The side of the source is unknown.', remedy: 'Which side of the source is the sensor on?'},
  inconsistent: {level: 'bad', text: 'Measurements contradict each other.', remedy: 'Keep the sensor still for a moment; look for metal that moves.'},
  unconfirmed: {level: 'bad', text: 'The last measurements contradict the motion.', remedy: 'Wait a moment. If this message stays, keep the sensor still.'},
  not_converged: {level: 'bad', text: 'No position fits the measurement.', remedy: 'Keep the sensor within the range of the source.'},
  uncertain: {level: 'bad', text: 'Position too uncertain.', remedy: 'Move the sensor closer to the source.'},
  distorted: {level: 'caution', text: 'Metal disturbs the field.', remedy: 'Remove metal near source and sensor, or measure elsewhere.'},
  coasting: {level: 'caution', text: 'Measurements are missing; the pose is predicted.', remedy: 'Check the link to the device.'},
  columns_missing: {level: 'caution', text: 'Some measurements are missing.', remedy: 'Check the link to the device.'},
  roll_undefined: {level: 'caution', text: 'Sensor of one coil: the roll is undefined.', remedy: 'Use position and x axis only.'},
};
const kUnknown = {
  level: 'bad',
  text: '',
  remedy: 'See the list of flags in the manual.'
};

/// Level of a pose in the history.
export function levelOf(pose, limit_mm) {
  if (!pose.valid) return Level.invalid;
  return pose.names.some(name => name in kFlags) || pose.distortion_mm > limit_mm || pose.expected_mm > limit_mm ? Level.caution : Level.good;
}

const millimetres = value => value < 10 ? `${value.toFixed(2)} mm` : `${value.toFixed(0)} mm`;

function ofLink(link, status) {
  if (link === 'down')
    return {
      level: 'off',
      cause: 'down',
      text: 'Server not reachable.',
      remedy: 'Is tricoil serve running? The page connects by itself. All values are old.'
    };
  if (link === 'connecting') return {level: 'off', cause: 'connecting', text: 'Connecting.', remedy: ''};
  if (status.running === false) return {level: 'off', cause: 'stopped', text: 'Coils are off.', remedy: 'Start switches them on.'};
  if (link === 'stalled')
    return {level: 'off', cause: 'stalled', text: 'The stream stalls.', remedy: 'Network or server is too slow. All values are old.'};
  if (link === 'silent')
    return {level: 'off', cause: 'silent', text: 'No poses from the device.', remedy: status.health?.warning || 'Check the device and its link.'};
  return null;
}

function ofFlags(pose) {
  const name = Object.keys(kFlags).find(known => pose.names.includes(known));
  if (name) return {...kFlags[name], cause: name};
  return pose.valid ? null : {...kUnknown, cause: 'invalid', text: `Invalid pose: ${pose.names.join(', ')}.`};
}

/// pose: newest of the sensor, or null. came_back: the sensor was lost before its hemisphere became unknown. Returns {level, cause, text, remedy};
/// level: good, caution, bad or off (no measurement).
export function qualityOf({link, status, pose, limit_mm, cameBack}) {
  const linked = ofLink(link, status);
  if (linked) return linked;
  if (!pose) return {level: 'off', cause: 'waiting', text: 'Waiting for the first pose.', remedy: ''};
  const flagged = ofFlags(pose);
  if (flagged?.cause === 'hemisphere_unknown' && cameBack) return {...flagged, text: 'The sensor is back.'};
  if (flagged?.cause === 'distorted')
    return {...flagged, text: `Metal disturbs the field: distortion of about ${millimetres(pose.distortion_mm)}.`};
  if (flagged) return flagged;
  if (pose.distortion_mm > limit_mm) {
    return {
      level: 'caution',
      cause: 'distortion',
      text: `Distortion of ${millimetres(pose.distortion_mm)}, above the limit of ${millimetres(limit_mm)}.`,
      remedy: 'Look for metal near source and sensor.'
    };
  }
  if (pose.expected_mm > limit_mm) {
    return {
      level: 'caution',
      cause: 'error',
      text: `Expected error of ${millimetres(pose.expected_mm)} RMS, above the limit of ${millimetres(limit_mm)}.`,
      remedy: 'Move the sensor closer to the source, or more slowly.'
    };
  }
  if (status.health?.warning)
    return {level: 'caution', cause: 'health', text: `Device or link: ${status.health.warning}.`, remedy: 'Check the link to the device.'};
  return {level: 'good', cause: 'tracking', text: `Tracking. Expected error ${millimetres(pose.expected_mm)} RMS.`, remedy: ''};
}

/// The two possible sides of the sensor, along the longest component of its position.
export function sidesOf(position_m) {
  const axis = position_m.reduce((longest, v, n) => Math.abs(v) > Math.abs(position_m[longest]) ? n : longest, 0);
  return [1, -1].map(sign => ({name: `${sign > 0 ? '+' : '−'}${'xyz'[axis]}`, towards: [0, 1, 2].map(n => n === axis ? sign : 0)}));
}
