// Pose stream that reconnects automatically.
const kSilentMs = 1500;
const kRetryMs = 500;

/// Calls receive(message) for every message, and link(state) when the state changes: 'live', 'silent' (connected, without new poses)
/// or 'down' (not connected, or no message for kSilentMs after 'live').
export function connect(receive, link) {
  let source = null;
  let heard = performance.now();
  let state = '';
  const tell = next => { if (next !== state) link(state = next); };
  const open = () => {
    source = new EventSource('stream');
    source.onmessage = event => {
      const message = JSON.parse(event.data);
      heard = performance.now();
      tell(message.poses.some(pose => !pose.stale) ? 'live' : 'silent');
      receive(message);
    };
    source.onerror = () => {
      source.close();
      tell('down');
      setTimeout(open, kRetryMs);
    };
  };
  setInterval(() => { if (performance.now() - heard > kSilentMs && state === 'live') tell('down'); }, 500);
  open();
}
