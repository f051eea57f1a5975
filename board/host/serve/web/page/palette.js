// Colours of scene and plots, from the style sheet, so that light and dark are defined once.
import {isDark} from './settings.js';

const kNames = ['x', 'y', 'z', 'ink', 'muted', 'grid', 'good', 'caution', 'bad', 'core', 'accent', 'canvas', 'error'];
export let palette = {};

/// Call it after a change of the theme.
export function readPalette() {
  document.documentElement.dataset.theme = isDark() ? 'dark' : 'light';
  const style = getComputedStyle(document.documentElement);
  palette = Object.fromEntries(kNames.map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
}

// Scale of errors: blue, violet, amber, red on a logarithmic axis. It has no green, which would look like an approval.
export const kLeast_mm = 0.1, kMost_mm = 10;
const kStops = [[0.16, 0.47, 0.84], [0.52, 0.45, 0.82], [0.96, 0.62, 0.14], [0.89, 0.33, 0.13], [0.66, 0.06, 0.22]];

/// Colour of an error: red, green and blue, 0 to 1.
export function errorColor(error_mm) {
  const at = Math.log(Math.max(kLeast_mm, Math.min(error_mm, kMost_mm)) / kLeast_mm) / Math.log(kMost_mm / kLeast_mm) * (kStops.length - 1);
  const n = Math.min(Math.floor(at), kStops.length - 2);
  return kStops[n].map((v, k) => v + (at - n) * (kStops[n + 1][k] - v));
}

export const errorGradient = () => `linear-gradient(90deg, ${kStops.map(stop => `rgb(${stop.map(v => Math.round(255 * v)).join(' ')})`).join(', ')})`;
