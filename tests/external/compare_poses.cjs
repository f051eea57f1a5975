// Compares poses of a candump log, decoded by a third-party DBC reader, with those printed by `tricoil run --json`.
//   node compare_poses.cjs FOLDER_OF_NODE_MODULES FILE.dbc CANDUMP.log POSES.json
const fs = require('fs');
const path = require('path');
const [modules, dbcFile, logFile, jsonFile] = process.argv.slice(2);
const {Dbc, Can} = require(path.join(modules, 'node_modules', 'candied'));

const can = new Can();
can.database = new Dbc().load(fs.readFileSync(dbcFile, 'utf8'));
const pose = can._database.messages.get('pose');
const poseId = pose.id;

/// Line of candump -L: (time) interface ID##FDATA
const decoded = new Map();
let frames = 0;
for (const line of fs.readFileSync(logFile, 'utf8').split('\n')) {
  const match = /^\([\d.]+\) \S+ ([0-9A-F]+)##[0-9A-F]([0-9A-F]*)/.exec(line);
  if (!match || parseInt(match[1], 16) !== poseId) continue;
  const payload = match[2].match(/../g).map(byte => parseInt(byte, 16));
  if (payload.length !== 64) throw new Error(`not 64 bytes: ${line}`);
  // This reader parses only the first digit of a message length, so lengths are set here.
  const message = can.decode({id: poseId, dlc: pose.dlc, isExtended: false, payload});
  if (!message) throw new Error(`not decoded: ${line}`);
  const value = name => parseFloat(message.boundSignals.get(name).physValue);
  decoded.set(value('sequence'), value);
  ++frames;
}

const close = (a, b, tolerance) => Math.abs(a - b) <= tolerance;
let compared = 0;
for (const line of fs.readFileSync(jsonFile, 'utf8').trim().split('\n')) {
  const printed = JSON.parse(line);
  if (printed.position_m === undefined) continue;  // the summary
  const value = decoded.get(printed.sequence);
  if (!value) throw new Error(`pose ${printed.sequence} is not in the log`);
  const pairs = [
    ...['x', 'y', 'z'].map((name, i) => [value(name), printed.position_m[i], 1e-9]),
    ...['qw', 'qx', 'qy', 'qz'].map((name, i) => [value(name), printed.q_wxyz[i], 1e-9]),
    ...['std_x', 'std_y', 'std_z', 'std_rx', 'std_ry', 'std_rz'].map((name, i) => [value(name), printed.std_m_rad[i], 1e-9]),
    [value('flags'), printed.flags, 0],
    [value('tracker_state'), printed.state, 0],
    [value('time'), 1e-6 * printed.time_us, 1e-9],
    [value('snr'), printed.snr_db, 1e-6],
  ];
  for (const [got, expected, tolerance] of pairs) {
    if (!close(got, expected, tolerance)) throw new Error(`pose ${printed.sequence}: ${got} is not ${expected}`);
  }
  ++compared;
}
if (compared < 100) throw new Error(`only ${compared} poses to compare`);
console.log(`${compared} poses of ${frames} frames: decoded by the DBC file as tricoil printed them`);
