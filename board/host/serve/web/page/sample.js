// Poses in compact form: arrays in the order of kColumns, in the event stream and in recordings (compact_pose.hpp).
const kColumns = [
  'sensor', 'time_us', 'utc_ms', 'flags', 'state', 'x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'cxx', 'cxy', 'cxz', 'cyy', 'cyz', 'czz', 'error_mm',
  'expected_mm', 'distortion_mm', 'snr_db'
];

/// Names of the flags by bit, the bits that make a pose invalid, and names of the states. The server sends them first.
export const flags = {
  names: [],
  invalidating: 0,
  states: []
};

/// False if this page and the server do not belong together: the server was replaced by another version while the page was open.
export function learn(hello) {
  flags.names = hello.flag_names;
  flags.invalidating = hello.invalidating;
  flags.states = hello.states;
  return hello.columns.join() === kColumns.join();
}

export const namesOf = bits => flags.names.filter((_, bit) => bits >> bit & 1);

/// Numbers of an invalid pose may be null: there is no sensor. Predicted and expected error of any pose may be: they are unknown.
const kFirst = kColumns.indexOf('x'), kFlags = kColumns.indexOf('flags'), kErrors = [kColumns.indexOf('error_mm'), kColumns.indexOf('expected_mm')];
const mayBeNull = (values, n) => kErrors.includes(n) || (n >= kFirst && (values[kFlags] & flags.invalidating) !== 0);

/// Pose from its compact form, with NaN for null; null if it is damaged. time_s: of the device. sigma_mm: 3D standard deviation. expected_mm: expected
/// error, RMS of sigma_mm over the last second; a CSV file has none: then sigma_mm of this pose.
export function decode(values) {
  const complete = Array.isArray(values) && values.length === kColumns.length &&
      values.every((v, n) => Number.isFinite(v) || (v === null && mayBeNull(values, n)));
  if (!complete) return null;
  const error_mm = values[kErrors[0]];
  const [sensor, time_us, utc_ms, bits, state, x, y, z, qw, qx, qy, qz, ...rest] = values.map(v => v ?? NaN);
  const covariance = rest.slice(0, 6);
  const [, expected_mm, distortion_mm, snr_db] = rest.slice(6);
  const sigma_mm = 1000 * Math.sqrt(Math.max(0, covariance[0] + covariance[3] + covariance[5]));
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
    valid: (bits & flags.invalidating) === 0 && Number.isFinite(x + y + z + qw + sigma_mm),
    names: namesOf(bits)
  };
}
