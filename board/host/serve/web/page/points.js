// Captured points: single poses, or averages over a second, and their distances.
const kAverage_s = 1;
const kStill_mm = 5;  // an average over more motion than this (RMS) is refused

/// Mean of the valid poses of the last second. Returns {position_mm, spread_mm, poses} or {error}.
export function averageOf(history, now) {
  const c = history.columns;
  const sum = [0, 0, 0], squares = [0, 0, 0];
  let poses = 0;
  for (let n = history.at(now - kAverage_s); n < history.length; ++n) {
    if (!Number.isFinite(c.x[n])) continue;
    ['x', 'y', 'z'].forEach((name, k) => {
      sum[k] += c[name][n];
      squares[k] += c[name][n] ** 2;
    });
    ++poses;
  }
  if (poses < 2) return {error: 'No valid poses in the last second.'};
  const position_mm = sum.map(v => v / poses);
  const spread_mm = Math.sqrt(Math.max(0, squares.reduce((s, v, k) => s + v / poses - position_mm[k] ** 2, 0)));
  if (spread_mm > kStill_mm) return {error: `The sensor moved by ${spread_mm.toFixed(0)} mm RMS: hold it still for a second.`};
  return {position_mm, spread_mm, poses};
}

export const distance = (a, b) => Math.hypot(...a.position_mm.map((v, k) => v - b.position_mm[k]));

export function pointsCsv(points, from) {
  const rows = points.map(
      (point, n) => [n + 1, point.sensor + 1, ...point.position_mm.map(v => v.toFixed(4)), point.spread_mm.toFixed(4), point.poses, point.flags,
                     from ? distance(point, from).toFixed(4) : '']
                        .join(','));
  return ['point,sensor,x_mm,y_mm,z_mm,spread_mm,poses,flag_names,distance_mm', ...rows].join('\n') + '\n';
}
