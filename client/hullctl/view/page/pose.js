// Poses as in the contract: seven doubles, quaternion w x y z (of any length) and translation.

export const IDENTITY = [1, 0, 0, 0, 0, 0, 0];

// Returns the rotation of a pose as a unit quaternion [w, x, y, z].
export function unitQuaternion([w, x, y, z]) {
  const length = Math.hypot(w, x, y, z) || 1;
  return [w / length, x / length, y / length, z / length];
}

// Rotates p by a unit quaternion.
export function rotate([w, x, y, z], [px, py, pz]) {
  const tx = 2 * (y * pz - z * py);
  const ty = 2 * (z * px - x * pz);
  const tz = 2 * (x * py - y * px);
  return [
    px + w * tx + y * tz - z * ty,
    py + w * ty + z * tx - x * tz,
    pz + w * tz + x * ty - y * tx,
  ];
}

// Transforms a point from the object's frame to the world.
export function toWorld(pose, p) {
  const [x, y, z] = rotate(unitQuaternion(pose), p);
  return [x + pose[4], y + pose[5], z + pose[6]];
}

// Returns the pose at time t of a motion, rounded: as PoseAt of client/hullctl/view/view_scene.h,
// to the last bit.
export const poseAt = (start, end, t) => start.map((value, i) => (1 - t) * value + t * end[i]);

// Returns the angle in radians between two rotations.
export function angleBetween(a, b) {
  const [p, q] = [unitQuaternion(a), unitQuaternion(b)];
  const cosine = p.reduce((sum, value, i) => sum + value * q[i], 0);
  return 2 * Math.acos(Math.min(1, Math.abs(cosine)));
}

export const samePose = (a, b) => a.every((value, i) => Object.is(value, b[i]));

// Returns the pose in the form of `hullctl check --pose-b`; every number reads back as the same
// double.
export const poseText = (pose) => pose.map(String).join(',');
