// Finds the object under the pointer: the first one on a ray, in double.
import {THREE} from 'hulld/drawing/three.js';
import {toWorld} from 'hulld/pose.js';
import {sum} from 'hulld/vector.js';

// Distance in CSS pixels within which a picked point snaps to a vertex.
const SNAP = 10;

// Returns the distance along the ray to the nearest triangle; Infinity if it meets none. `ray`: in
// drawn coordinates, relative to the center.
function hitTriangles({xyz, triangles, center}, ray, unit) {
  const middle = new THREE.Vector3(...center);
  const [a, b, c, point] = Array.from({length: 4}, () => new THREE.Vector3());
  let nearest = Infinity;
  for (let t = 0; t < triangles.length; t += 3) {
    [a, b, c].forEach(
        (corner, k) => corner.fromArray(xyz, 3 * triangles[t + k]).sub(middle).divideScalar(unit));
    if (!ray.intersectTriangle(a, b, c, false, point)) continue;
    nearest = Math.min(nearest, point.distanceTo(ray.origin));
  }
  return nearest;
}

// Returns the vertex of an object that is nearest in the picture to (x, y), if it is within `reach`
// of the camera and close enough to snap to; null otherwise.
function nearestVertex(model, stage, object, x, y, reach) {
  const {xyz} = model.shapeOf(object);
  let nearest = null;
  let least = SNAP;
  for (let i = 0; i < xyz.length; i += 3) {
    const point = Array.from(xyz.subarray(i, i + 3));
    const local = stage.local(toWorld(object.pose, point));
    const seen = stage.toScreen(local);
    if (!seen) continue;
    const away = Math.hypot(seen[0] - x, seen[1] - y);
    if (away < least && local.distanceTo(stage.camera.position) <= reach) {
      [nearest, least] = [point, away];
    }
  }
  return nearest;
}

// Returns {index, point}: the object under (x, y), in CSS pixels of the canvas, and the point that
// was hit, in the frame of the object; null if none. `toVertex`: snap to a vertex nearby.
export function pick(model, stage, x, y, {toVertex = false} = {}) {
  const caster = new THREE.Raycaster();
  caster.setFromCamera(
      {
        x: 2 * x / stage.canvas.clientWidth - 1,
        y: 1 - 2 * y / stage.canvas.clientHeight,
      },
      stage.camera);
  const {ray} = caster;
  const frame = new THREE.Object3D();
  let nearest = Infinity;
  let picked = null;
  for (const object of model.objects) {
    const shape = model.roundedOf(object) ?? model.shapeOf(object);
    if (!model.isShown(object) || !shape || shape.isEmpty) continue;
    stage.place(frame, model.centerOf(object), object.pose);
    const along = frame.position.clone().sub(ray.origin).dot(ray.direction);
    const radius = shape.radius / model.unit;
    const sphere = new THREE.Sphere(frame.position, radius);
    if (!ray.intersectsSphere(sphere) || along - radius > nearest) continue;
    const back = frame.quaternion.clone().conjugate();
    const local = new THREE.Ray(
        ray.origin.clone().sub(frame.position).applyQuaternion(back),
        ray.direction.clone().applyQuaternion(back));
    const distance = shape.triangles.length ? hitTriangles(shape, local, model.unit) : along;
    if (distance >= nearest) continue;
    nearest = distance;
    const hit = local.at(distance, new THREE.Vector3()).multiplyScalar(model.unit).toArray();
    picked = {index: object.index, point: sum(hit, shape.center)};
  }
  if (picked && toVertex) {
    const reach = stage.camera.position.distanceTo(ray.origin) + nearest;
    const object = model.objects[picked.index];
    picked.point = nearestVertex(model, stage, object, x, y, 1.02 * reach) ?? picked.point;
  }
  return picked;
}
