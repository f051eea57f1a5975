// Head of the page: source of the poses, recording, health of device and link.
const element = id => document.getElementById(id);
const clock = s => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, '0')}`;

function put(output, text) {
  if (output.textContent !== text) output.textContent = text;
}

/// source: description as in a recording; undefined: unknown.
export function showSource(source) {
  const known = {simulation: source?.scenario ? `simulation: ${source.scenario}` : 'simulation', recording: 'recording'};
  put(element('source'), known[source?.kind] ?? source?.device ?? '');
}

export function showRecording(status) {
  const output = element('recording');
  output.hidden = !status.recording;
  if (status.recording) put(output, `● ${status.recording_name} ${clock(status.recording_s)}, ${(status.recording_bytes / 1e6).toFixed(1)} MB`);
}

/// Warnings as text; otherwise the share of missing columns, and the temperature if the device measures it. damaged: messages and
/// poses that could not be read.
export function showHealth(health, damaged) {
  const output = element('health');
  output.dataset.warning = String(health.warning !== '');
  const temperature = health.temperature_c === null ? '' : `, ${health.temperature_c.toFixed(0)} °C`;
  put(output, (health.warning || `${health.missing_percent.toFixed(1)} % missing${temperature}`) + (damaged ? `, ${damaged} damaged messages` : ''));
  output.title = Object.entries(health).map(([key, value]) => `${key}: ${value}`).join('\n');
}
