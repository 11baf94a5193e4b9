// Exact numbers: integers of any length times a common power of two.

const view = new DataView(new ArrayBuffer(8));
const HIDDEN_BIT = 1n << 52n;
const EXPONENT_BIAS = 1075;

// Returns the exponent of the last bit that a double of this size can have.
function exponentOf(number) {
  view.setFloat64(0, number);
  return (view.getUint16(0) >> 4 & 0x7ff || 1) - EXPONENT_BIAS;
}

// Returns the least exponent at which all numbers are integers. Requires finite numbers.
export function commonExponent(...lists) {
  let least = 1024;
  for (const list of lists) {
    for (const number of list) {
      if (number !== 0) least = Math.min(least, exponentOf(number));
    }
  }
  return least;
}

// Returns number / 2^exponent. Requires an exponent that covers the number.
export function toInteger(number, exponent) {
  if (number === 0) return 0n;
  view.setFloat64(0, number);
  const bits = view.getBigUint64(0);
  const isNormal = (bits >> 52n & 0x7ffn) !== 0n;
  const size = (bits & (HIDDEN_BIT - 1n) | (isNormal ? HIDDEN_BIT : 0n))
      << BigInt(exponentOf(number) - exponent);
  return number < 0 ? -size : size;
}

export const toIntegers = (numbers, exponent) =>
    Array.from(numbers, (number) => toInteger(number, exponent));

export const scaled = (s, a) => [s * a[0], s * a[1], s * a[2]];
export const sum = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const difference = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross =
    (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const isZero = (a) => a.every((value) => value === 0n);

// Returns {rows, scale} of a quaternion of any length: R(q) and |q|^2, up to a common factor.
export function rotationOf(quaternion) {
  const [w, x, y, z] = toIntegers(quaternion, commonExponent(quaternion));
  return {
    rows: [
      [w * w + x * x - y * y - z * z, 2n * (x * y - w * z), 2n * (x * z + w * y)],
      [2n * (x * y + w * z), w * w - x * x + y * y - z * z, 2n * (y * z - w * x)],
      [2n * (x * z - w * y), 2n * (y * z + w * x), w * w - x * x - y * y + z * z],
    ],
    scale: w * w + x * x + y * y + z * z,
  };
}

// n^T M and M p, for the rows of M.
export const combination = (n, rows) =>
    sum(sum(scaled(n[0], rows[0]), scaled(n[1], rows[1])), scaled(n[2], rows[2]));
export const product = (rows, p) => rows.map((row) => dot(row, p));
