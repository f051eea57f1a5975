// Reads the poses of a recording: lines from the server (arrays in compact form), or a CSV file that the user opens.
import {decode, flags} from './sample.js';

export const kMostPoses = 500_000;  // the rest is left out

/// {poses, errors: [sentence]}: poses in order of time.
export function parseRecording(text) {
  const lines = text.split('\n').filter(line => line !== '');
  const read = lines.length === 0 ? {poses: [], errors: ['The file is empty.']} : '[{'.includes(lines[0][0]) ? ofLines(lines) : ofCsv(lines);
  if (read.left) read.errors.push(`Only the first ${kMostPoses} poses are shown.`);
  if (read.poses.length === 0 && read.errors.length === 0) read.errors.push('The file contains no poses.');
  return {poses: read.poses, errors: read.errors};
}

/// poseOf(line): its pose, null if the line is damaged, undefined if it contains none.
function collect(lines, poseOf) {
  const poses = [];
  let damaged = 0, left = false;
  for (const line of lines) {
    const pose = poseOf(line);
    if (pose === null)
      ++damaged;
    else if (pose && poses.length < kMostPoses)
      poses.push(pose);
    else if (pose)
      left = true;
  }
  return {poses, errors: damaged ? [`${damaged} damaged line${damaged > 1 ? 's were' : ' was'} left out.`] : [], left};
}

function ofLines(lines) {
  const errors = [];
  const read = collect(lines, line => {
    let value;
    try {
      value = JSON.parse(line);
    } catch {
      return null;  // for example a last line that was cut
    }
    if (value?.error) errors.push(value.error);
    return Array.isArray(value) ? decode(value) : undefined;
  });
  return {...read, errors: [...errors, ...read.errors]};
}

function ofCsv([head, ...lines]) {
  const names = head.trim().split(',').map(name => name.replace(/^(std_)?([xyz])_m$/, '$1$2'));
  const column = name => names.indexOf(name);
  const needed = ['sensor', 'time_us', 'flags', 'x', 'y', 'z', 'qw', 'qx', 'qy', 'qz'];
  const missing = needed.filter(name => column(name) < 0);
  if (missing.length)
    return {
      poses: [],
      errors: [`Not a file of poses in metres: the column${missing.length > 1 ? 's' : ''} ${
          missing.map(name => /^[xyz]$/.test(name) ? `${name}_m` : name).join(', ')} ${
          missing.length > 1 ? 'are' : 'is'} missing. Open poses.csv of a recording, or a file of tricoil run --out.`]
    };
  return collect(lines, line => {
    const fields = line.trim().split(',');
    const value = name => fields[column(name)] === '' ? null : Number(fields[column(name)]);
    return fields.length === names.length ? decode(compact(value, name => column(name) >= 0)) : null;
  });
}

/// Compact form of a line of a CSV file; value(name): its number, has(name): is there such a column?
function compact(value, has) {
  const square = v => v === null ? null : v ** 2;
  const covariance = has('cov_xx') ? ['xx', 'xy', 'xz', 'yy', 'yz', 'zz'].map(name => value(`cov_${name}`)) :
                                     ['std_x', null, null, 'std_y', null, 'std_z'].map(name => name && has(name) ? square(value(name)) : 0);
  const optional = name => has(name) ? value(name) : 0;
  const error = name => has(name) ? value(name) : null;
  return [
    value('sensor'), value('time_us'), value('time_us') / 1000, value('flags'), optional('state'),
    ...['x', 'y', 'z', 'qw', 'qx', 'qy', 'qz'].map(value), ...covariance, error('predicted_error_mm'), error('expected_error_mm'),
    optional('distortion_mm'), optional('snr_db'), ...has('true_x_m') ? [truthOf(value, has)] : []
  ];
}

const kTruth = ['true_x_m', 'true_y_m', 'true_z_m', 'true_qw', 'true_qx', 'true_qy', 'true_qz'];
const kSame_m = 1e-6;

/// True pose of a simulation; null if it is incomplete, or may be of another frame: the stated error is not the distance of
/// the two positions.
function truthOf(value, has) {
  if (!kTruth.every(has)) return null;
  const truth = kTruth.map(value);
  const apart_m = Math.hypot(...['x', 'y', 'z'].map((name, k) => value(name) - truth[k]));
  return has('error_position_m') && Math.abs(apart_m - value('error_position_m')) <= kSame_m + 1e-3 * apart_m ? truth : null;
}

/// Names of the flags are needed to read their bits; they come from the server.
export const isReady = () => flags.names.length > 0;
