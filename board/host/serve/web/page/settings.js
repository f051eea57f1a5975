// Settings of the user, stored by the browser.
const kKey = 'tricoil';
export const kUnits = {mm: {scale: 1, digits: 1}, cm: {scale: 0.1, digits: 2}, m: {scale: 0.001, digits: 4}, in: {scale: 1 / 25.4, digits: 3}};
export const kScales = [1, 2, 5, 10, 20, 50, 100, 500];  // of ellipsoid and error
/// Plots: names of signals (chart_list.js), as values or as deviations from their means over the time shown.
export const kDefaultPlots = [['x', 'y', 'z'], ['a0', 'a1', 'a2'], ['speed'], ['true', 'expected'], ['distortion'], ['snr']].map(
    signals => ({signals, deviation: false}));
export const kMostPlots = 12;
const kSignals =
    new Set(['x', 'y', 'z', 'a0', 'a1', 'a2', 'qw', 'qx', 'qy', 'qz', 'speed', 'sigma', 'error', 'expected', 'true', 'distortion', 'snr']);
const kDefaults = {
  plots: kDefaultPlots,
  units: 'mm',
  order: 'zyx',
  theme: 'auto',
  limit_mm: 2,
  field: 'auto',  // of the demo: all coils; otherwise none
  up: 'down',     // direction of z in the scene
  error_scale: 20,
  window_s: 10
};
const kAllowed = {
  units: Object.keys(kUnits),
  order: ['zyx', 'xyz', 'vector'],
  theme: ['auto', 'light', 'dark'],
  field: ['auto', 'none', 'x', 'y', 'z', 'all'],
  up: ['down', 'up'],
  error_scale: kScales,
  window_s: [10, 30, 60, 300, 600]
};

function stored() {
  try {
    return JSON.parse(localStorage.getItem(kKey)) ?? {};
  } catch {
    return {};  // private windows, or text that is not JSON
  }
}

export const isLayout = plots => Array.isArray(plots) && plots.length > 0 && plots.length <= kMostPlots &&
    plots.every(
        plot => Array.isArray(plot?.signals) && plot.signals.length > 0 && plot.signals.every(name => kSignals.has(name)) &&
            typeof plot.deviation === 'boolean');

function accepted(given) {
  const result = {...kDefaults};
  for (const [name, values] of Object.entries(kAllowed))
    if (values.includes(given[name])) result[name] = given[name];
  if (isLayout(given.plots)) result.plots = given.plots;
  if (given.limit_mm > 0 && given.limit_mm <= 100) result.limit_mm = given.limit_mm;
  return result;
}

export const settings = accepted(stored());

export function set(name, value) {
  Object.assign(settings, accepted({...settings, [name]: value}));
  try {
    localStorage.setItem(kKey, JSON.stringify(settings));
  } catch { /* the settings then last as long as the page */
  }
}

const dark = matchMedia('(prefers-color-scheme: dark)');
export const isDark = () => settings.theme === 'dark' || (settings.theme === 'auto' && dark.matches);
export const onSystemTheme = action => dark.addEventListener('change', action);
