// Pose stream that reconnects automatically.
import {server} from './server.js';

const kStalledMs = 1500;
const kRetryMs = 500;

/// Calls receive(message) for every message; it returns whether there was a new pose. Calls link(state) when the state changes: 'live',
/// 'silent' (connected, without new poses), 'stalled' (connected, no message for kStalledMs) or 'down' (not connected). A damaged
/// message is counted in statistics.damaged and left out.
export function connect(receive, link, statistics) {
  let heard = performance.now();
  let state = '';
  const tell = next => {
    if (next !== state) link(state = next);
  };
  const open = () => {
    const source = server.events();
    source.onopen = () => {
      heard = performance.now();
    };
    source.onmessage = event => {
      heard = performance.now();
      let message;
      try {
        message = JSON.parse(event.data);
      } catch { /* counted below */
      }
      if (!message?.status || !Array.isArray(message.poses)) {
        ++statistics.damaged;
        return;
      }
      tell(receive(message) ? 'live' : 'silent');
    };
    source.onerror = () => {
      source.close();
      tell('down');
      setTimeout(open, kRetryMs);
    };
  };
  setInterval(() => {
    if (performance.now() - heard > kStalledMs && (state === 'live' || state === 'silent')) tell('stalled');
  }, 500);
  open();
}
