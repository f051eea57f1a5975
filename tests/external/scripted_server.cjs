// Serves the live page with events that a test sends, in the form in which `tricoil serve` sends them.
const http = require('http');

const kFlags = [
  'saturated', 'low_signal', 'no_sensor', 'distorted', 'wrong_handedness', 'stale', 'not_converged', 'hemisphere_unknown', 'no_reference',
  'unconfirmed', 'inconsistent', 'coasting', 'uncertain', 'columns_missing', 'roll_undefined'
];
const kWarnings = ['distorted', 'coasting', 'columns_missing', 'roll_undefined'];
const bits = names => names.reduce((sum, name) => sum | 1 << kFlags.indexOf(name), 0);
const hello = {
  columns: [
    'sensor', 'time_us', 'utc_ms', 'flags', 'state', 'x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'cxx', 'cxy', 'cxz', 'cyy', 'cyz', 'czz', 'error_mm',
    'expected_mm', 'distortion_mm', 'snr_db'
  ],
  truth_frame: 'source',
  states: ['searching', 'tracking', 'lost'],
  flag_names: kFlags,
  invalidating: bits(kFlags.filter(name => !kWarnings.includes(name))),
  source: {kind: 'simulation', scenario: 'circle'}
};

const healthy = {
  warning: '',
  missing_percent: 0,
  temperature_c: 41.6
};
const running = {
  running: true,
  recording: false,
  recording_name: '',
  recording_s: 0,
  recording_bytes: 0,
  recording_error: '',
  controls: 'open',
  pages: 1,
  health: healthy,
  confined_to: [],
  tour: null
};

/// The expected error of a sensor whose poses all have this covariance.
const deviation_mm = c => c[0] === null ? null : 1000 * Math.sqrt(c[0] + c[3] + c[5]);

/// Pose in compact form; t in ms. truth: position and quaternion of a simulation; undefined: none. flags: names. covariance: 0.1 mm along x and 0.2 mm along y and z, by default.
function sample(
    sensor, t, p,
    {flags = [], q = [1, 0, 0, 0], covariance = [1e-8, 0, 0, 4e-8, 0, 4e-8], error = 0.2, distortion = 0.1, snr = 60, state = 1, truth} = {}) {
  const pose = [sensor, Math.round(1000 * t), t, bits(flags), state, ...p, ...q, ...covariance, error, deviation_mm(covariance), distortion, snr];
  return truth === undefined ? pose : [...pose, truth];
}

/// A server whose events are sent by send(samples, status). asked: bodies of control requests. recordings: name to text, or {status, answer}.
async function scripted(html, recordings = {}) {
  const streams = new Set();
  const asked = [];
  const server = http.createServer((request, response) => {
    const json = (status, value) => response.writeHead(status, {'Content-Type': 'application/json'}).end(JSON.stringify(value));
    if (request.url === '/stream') {
      response.writeHead(200, {'Content-Type': 'text/event-stream'});
      response.write(`data: ${JSON.stringify({hello, status: running, poses: []})}\n\n`);
      streams.add(response);
      response.on('close', () => streams.delete(response));
    } else if (request.url === '/control') {
      let body = '';
      request.on('data', data => {
        body += data;
      });
      request.on('end', () => {
        asked.push(JSON.parse(body));
        json(200, {answer: 'done'});
      });
    } else if (request.url === '/recordings') {
      json(200, {recordings: Object.keys(recordings).map(name => ({name, bytes: 1234, complete: true}))});
    } else if (request.url.startsWith('/recordings/')) {
      const recording = recordings[decodeURIComponent(request.url.slice('/recordings/'.length))];
      if (typeof recording === 'string')
        response.writeHead(200, {'Content-Type': 'text/plain'}).end(recording);
      else
        json(recording.status, {answer: recording.answer});
    } else {
      response.writeHead(200, {'Content-Type': 'text/html'}).end(html);
    }
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  const {port} = server.address();
  const write = text => {
    for (const stream of streams) stream.write(text);
  };
  return {
    url: `http://127.0.0.1:${port}/`,
    asked,
    connected: () => streams.size > 0,
    write,
    send(
        samples,
        more = {}) { write(`data: ${JSON.stringify({status: {...running, now_ms: (samples.at(-1)?.[2] ?? 0) + 4, ...more}, poses: samples})}\n\n`); },
    drop() {
      for (const stream of streams) stream.destroy();
    },
    close() {
      server.close();
      server.closeAllConnections();
    },
    listen: () => new Promise(resolve => server.listen(port, '127.0.0.1', resolve)),
  };
}

module.exports = {
  bits,
  healthy,
  hello,
  running,
  sample,
  scripted
};
