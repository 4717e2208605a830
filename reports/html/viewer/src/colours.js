// From good to bad: dark blue over green-grey to orange and red; ordered in lightness against both backgrounds, and told
// apart by those who do not see red or green.
const BAD = [[0.16, 0.32, 0.58], [0.35, 0.55, 0.72], [0.72, 0.75, 0.68], [0.96, 0.72, 0.29], [0.88, 0.42, 0.12], [0.7, 0.05, 0.12]];
const PLAIN = [[0.27, 0.13, 0.4], [0.24, 0.36, 0.55], [0.16, 0.55, 0.55], [0.4, 0.72, 0.36], [0.93, 0.85, 0.2]];

export function colour(part, best) {
  const stops = best === "none" ? PLAIN : BAD;
  const x = Math.min(Math.max(part, 0), 1) * (stops.length - 1);
  const k = Math.min(Math.floor(x), stops.length - 2);
  return stops[k].map((c, d) => c + (stops[k + 1][d] - c) * (x - k));
}

export const UNDEFINED = [0.75, 0.2, 0.75];

export function css([r, g, b]) {
  return `rgb(${[r, g, b].map((c) => Math.round(255 * c)).join(",")})`;
}

// A faint hue for each zone of the boundary.
export function hue(k, n, dark) {
  const h = (k * 0.618034) % 1;
  const l = dark ? 0.55 : 0.72;
  const c = n > 1 ? 0.1 : 0;
  return [0, 1 / 3, 2 / 3].map((o) => l + c * Math.cos(2 * Math.PI * (h + o)));
}
