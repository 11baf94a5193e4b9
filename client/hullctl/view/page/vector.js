// Vectors [x, y, z] of numbers, or of integers of any length.
export const scaled = (s, a) => [s * a[0], s * a[1], s * a[2]];
export const sum = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const difference = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
// Requires numbers. Returns 0 for 0.
export function unit(a) {
  const length = Math.hypot(...a) || 1;
  return a.map((value) => value / length);
}
export const cross =
    (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
