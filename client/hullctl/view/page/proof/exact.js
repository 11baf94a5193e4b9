// Exact numbers: integers of any length times a common power of two.
import {dot, scaled, sum} from 'hulld/vector.js';

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

export const isZero = (a) => a.every((value) => value === 0n);

// Returns {rows, scale}: R(q) and |q|^2 as symmetric bilinear forms of two quaternions. For a = b,
// these are R(a) and |a|^2.
export function rotationForm(a, b) {
  const [ww, xx, yy, zz] = a.map((value, i) => value * b[i]);
  const twice = (i, j) => a[i] * b[j] + a[j] * b[i];
  return {
    rows: [
      [ww + xx - yy - zz, twice(1, 2) - twice(0, 3), twice(1, 3) + twice(0, 2)],
      [twice(1, 2) + twice(0, 3), ww - xx + yy - zz, twice(2, 3) - twice(0, 1)],
      [twice(1, 3) - twice(0, 2), twice(2, 3) + twice(0, 1), ww - xx - yy + zz],
    ],
    scale: ww + xx + yy + zz,
  };
}

// Returns {rows, scale} of a quaternion of any length: R(q) and |q|^2, up to a common factor.
export function rotationOf(quaternion) {
  const q = toIntegers(quaternion, commonExponent(quaternion));
  return rotationForm(q, q);
}

// n^T M and M p, for the rows of M.
export const combination = (n, rows) =>
    sum(sum(scaled(n[0], rows[0]), scaled(n[1], rows[1])), scaled(n[2], rows[2]));
export const product = (rows, p) => rows.map((row) => dot(row, p));
