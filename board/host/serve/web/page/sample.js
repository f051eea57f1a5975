// Poses in compact form: arrays in the order of kColumns, in the event stream and in recordings (pose_event.hpp). A pose of a
// simulation ends with an array of its true position and quaternion.
const kColumns = [
  'sensor', 'time_us', 'utc_ms', 'flags', 'state', 'x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'cxx', 'cxy', 'cxz', 'cyy', 'cyz', 'czz', 'error_mm',
  'expected_mm', 'distortion_mm', 'snr_db'
];

/// Names of the flags by bit, the bits that make a pose invalid, and names of the states. The server sends them first.
export const flags = {
  names: [],
  invalidating: 0,
  states: [],
  hasTruth: false  // true poses are in the frame of the poses
};

/// False if this page and the server do not belong together: the server was replaced by another version while the page was open.
export function learn(hello) {
  flags.names = hello.flag_names;
  flags.invalidating = hello.invalidating;
  flags.states = hello.states;
  flags.hasTruth = hello.truth_frame === 'source';
  return hello.columns.join() === kColumns.join();
}

export const namesOf = bits => flags.names.filter((_, bit) => bits >> bit & 1);

/// Numbers of an invalid pose may be null: there is no sensor. Predicted and expected error of any pose may be: they are unknown.
const kFirst = kColumns.indexOf('x'), kFlags = kColumns.indexOf('flags'), kErrors = [kColumns.indexOf('error_mm'), kColumns.indexOf('expected_mm')];
const mayBeNull = (values, n) => kErrors.includes(n) || (n >= kFirst && (values[kFlags] & flags.invalidating) !== 0);

/// True pose; null if there is none, or it is in another frame, or damaged.
function truthOf(values) {
  if (!flags.hasTruth || !Array.isArray(values) || values.length !== 7 || !values.every(Number.isFinite)) return null;
  const q_wxyz = values.slice(3);
  return Math.abs(Math.hypot(...q_wxyz) - 1) < 1e-3 ? {position_m: values.slice(0, 3), q_wxyz} : null;
}

/// Pose from its compact form, with NaN for null; null if it is damaged. time_s: of the device. sigma_mm: 3D standard deviation.
/// expected_mm: expected error, RMS of sigma_mm over the last second; a CSV file has none: then sigma_mm of this pose. truth:
/// true pose, or null. true_mm: error of the position against it; NaN if it is unknown.
export function decode(given) {
  const withTruth = Array.isArray(given) && given.length === kColumns.length + 1 && typeof given.at(-1) === 'object';
  const values = withTruth ? given.slice(0, -1) : given;
  const complete = Array.isArray(values) && values.length === kColumns.length &&
      values.every((v, n) => Number.isFinite(v) || (v === null && mayBeNull(values, n)));
  if (!complete) return null;
  const error_mm = values[kErrors[0]];
  const [sensor, time_us, utc_ms, bits, state, x, y, z, qw, qx, qy, qz, ...rest] = values.map(v => v ?? NaN);
  const covariance = rest.slice(0, 6);
  const [, expected_mm, distortion_mm, snr_db] = rest.slice(6);
  const sigma_mm = 1000 * Math.sqrt(Math.max(0, covariance[0] + covariance[3] + covariance[5]));
  const valid = (bits & flags.invalidating) === 0 && Number.isFinite(x + y + z + qw + sigma_mm);
  const truth = withTruth ? truthOf(given.at(-1)) : null;
  return {
    sensor,
    time_s: time_us / 1e6,
    utc_ms,
    flags: bits,
    state,
    position_m: [x, y, z],
    q_wxyz: [qw, qx, qy, qz],
    covariance,
    error_mm,
    distortion_mm,
    snr_db,
    sigma_mm,
    expected_mm: Number.isFinite(expected_mm) ? expected_mm : sigma_mm,
    valid,
    truth,
    true_mm: valid && truth ? 1000 * Math.hypot(...[x, y, z].map((v, k) => v - truth.position_m[k])) : NaN,
    names: namesOf(bits)
  };
}
