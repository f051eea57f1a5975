// Reduces columns of a history to the resolution of a plot: keeps the extremes of each interval, so that no peak is lost.

/// from, to: times. count: number of intervals. fields: [{name, scale, wraps}]. Returns [times, values of each field...]; a gap is null.
/// At most two points an interval; every pose, if there are fewer.
export function decimate(history, from, to, count, fields) {
  const first = Math.max(0, history.at(from) - 1);
  const last = Math.min(history.length, history.at(to) + 1);
  return last - first <= 2 * count ? every(history, first, last, fields) : extremes(history, first, last, from, to, count, fields);
}

const kDegrees = 180 / Math.PI;

const shown = (value, scale) => Number.isFinite(value) ? value * scale : null;

function every(history, first, last, fields) {
  return [
    Array.from(history.times.subarray(first, last)),
    ...fields.map(({name, scale}) => Array.from(history.columns[name].subarray(first, last), value => shown(value, scale)))
  ];
}

function extremes(history, first, last, from, to, count, fields) {
  const step = (to - from) / count;
  const starts = [first];  // of the intervals that have poses
  for (let n = first + 1; n < last; ++n) {
    if (Math.floor((history.times[n] - from) / step) !== Math.floor((history.times[n - 1] - from) / step)) starts.push(n);
  }
  starts.push(last);
  const times = [];
  for (let i = 0; i + 1 < starts.length; ++i)
    times.push(history.times[starts[i]], (history.times[starts[i]] + history.times[starts[i + 1] - 1]) / 2 + 1e-6);
  return [times, ...fields.map(field => ofColumn(history.columns[field.name], starts, field))];
}

/// wraps: an interval with a gap stays empty, because the angle wraps there.
function ofColumn(column, starts, {scale, wraps}) {
  const values = [];
  for (let i = 0; i + 1 < starts.length; ++i) {
    let low = NaN, high = NaN, lowAt = 0, highAt = 0, holes = 0;
    for (let n = starts[i]; n < starts[i + 1]; ++n) {
      const value = column[n];
      if (!Number.isFinite(value)) {
        ++holes;
        continue;
      }
      if (!(value >= low)) {
        low = value;
        lowAt = n;
      }
      if (!(value <= high)) {
        high = value;
        highAt = n;
      }
    }
    if (holes > 0 && wraps)
      values.push(null, null);
    else
      values.push(...(lowAt <= highAt ? [shown(low, scale), shown(high, scale)] : [shown(high, scale), shown(low, scale)]));
  }
  return values;
}

/// Mean of a column within [from, to]; of an angle in degrees if it wraps.
export function meanOf(history, from, to, {name, scale, wraps}) {
  const column = history.columns[name].subarray(history.at(from), history.at(to)).filter(Number.isFinite);
  if (!wraps) return column.reduce((sum, v) => sum + v, 0) / Math.max(1, column.length) * scale;
  const sum = part => column.reduce((total, v) => total + part(v / kDegrees), 0);
  return Math.atan2(sum(Math.sin), sum(Math.cos)) * kDegrees;
}

/// Difference of two values; of two angles in degrees if they wrap: within 180 degrees.
export function difference(value, mean, wraps) {
  const by = value - mean;
  return wraps ? by - 360 * Math.round(by / 360) : by;
}

const kUnseen = 1000;  // a gap between bands that is shorter than this part of the time shown is less than a pixel

/// Runs of one level within [from, to]: [{from, to, level}], level > 0 only.
export function bands(history, from, to, until = to) {
  const runs = [];
  const unseen = (to - from) / kUnseen;
  const {times, columns} = history;
  const first = Math.max(0, history.at(from) - 1);
  for (let n = first; n < history.length && times[n] <= to; ++n) {
    const level = columns.level[n];
    const begin = level === 3 && n > 0 ? times[n - 1] : times[n];
    const end = n + 1 < history.length ? times[n + 1] : until;
    if (level === 0) continue;
    const run = runs.at(-1);
    if (run && run.level === level && begin - run.to < unseen)
      run.to = end;
    else
      runs.push({from: begin, to: end, level});
  }
  return runs;
}
