// Pose stream that reconnects automatically.
const kSilentMs = 1500;
const kRetryMs = 500;

/// receive(message) for every message; link('live' | 'silent' | 'down') whenever that changes: silent without fresh poses.
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
