// Draws one object with three.js: points, mesh, and hull with its edges. Its group is at the center
// of the object's box, turned by the pose.
import {DrawnGroup, facetMaterial} from 'hulld/drawing/drawn_group.js';
import {FINE_LAYER} from 'hulld/drawing/stage.js';
import {discMaterial, geometryFrom, THREE} from 'hulld/drawing/three.js';
import {MARK_COLORS, RELATIONS} from 'hulld/palette.js';

const FLASH_MS = 1200;

// Objects share shapes and their GPU resources, which are in the unit of drawn coordinates.
const geometries = new WeakMap();
export function geometryOf(shape, kind, unit) {
  let kinds = geometries.get(shape);
  if (kinds?.unit !== unit) {
    kinds = {unit, position: new THREE.BufferAttribute(shape.positions(unit), 3)};
    geometries.set(shape, kinds);
  }
  if (!kinds[kind]) {
    const {position} = kinds;
    const geometry = geometryFrom({position}, kind === 'points' ? null : shape[kind]);
    geometry.boundingSphere = new THREE.Sphere(new THREE.Vector3(), shape.radius / unit || 1e-9);
    kinds[kind] = geometry;
  }
  return kinds[kind];
}

// For a larger hull, lines would cover the surface, and drawing both sides would double the cost.
const isHuge = (hull) => hull.facetCount > 200000;

// Too many lines would hide the surface.
export const edgeWeight = (count) => (count > 20000 ? 0.2 : count > 1000 ? 0.55 : 1);

export class ObjectView extends DrawnGroup {
  constructor(model, stage, object) {
    super(model, stage);
    this.object = object;
  }

  // Rebuilds the drawn parts; cheap because geometries are shared.
  rebuild() {
    const {model, object} = this;
    this.clear();
    this.group.visible = model.isShown(object);
    const hull = model.hullOf(object);
    const mesh = model.meshOf(object);
    this.center = (hull || mesh)?.center || [0, 0, 0];
    const {show} = model;
    if (mesh && show.mesh && mesh.triangles.length) this.addMesh(mesh);
    // A file without triangles has only points.
    const cloud = mesh || hull;
    if (cloud && (show.points || (mesh && !mesh.triangles.length && show.mesh))) {
      this.addPoints(cloud);
    }
    if (hull && show.hull && !hull.isEmpty)
      this.addHull(hull, Boolean(mesh && show.mesh) || show.points);
    const rounded = model.roundedOf(object);
    if (rounded && show.hull) this.addRounded(rounded, hull);
    if (hull && show.edges && !hull.isEmpty && !isHuge(hull) &&
        (show.hull || !(mesh && show.mesh))) {
      this.addEdges(hull);
    }
    this.place();
  }

  // Shapes other than the hull have their own centers.
  shift(part, shape) {
    part.position.set(...this.model.drawn(shape.center, this.center));
    part.userData.sharesGeometry = true;
    this.group.add(part);
  }

  addMesh(mesh) {
    const {opacity} = this.object;
    const material = facetMaterial({
      color: this.model.colorOf(this.object),
      side: THREE.DoubleSide,
      transparent: opacity < 1,
      opacity,
    });
    this.shift(new THREE.Mesh(geometryOf(mesh, 'triangles', this.model.unit), material), mesh);
  }

  addPoints(shape) {
    const size = shape.vertexCount > 20000 ? 1.5 : 4;
    const material = discMaterial({color: this.pointColor(), size, alphaTest: 0.5});
    const points = new THREE.Points(geometryOf(shape, 'points', this.model.unit), material);
    points.renderOrder = 2;
    this.shift(points, shape);
  }

  // Points stand out from the facets of their own color.
  pointColor() {
    const color = new THREE.Color(this.model.colorOf(this.object));
    return color.lerp(new THREE.Color(this.stage.theme.edge), this.model.show.hull ? 0.35 : 0);
  }

  // A hull is solid. With something inside, or with an overlap to be seen, it is glass: far
  // sides are drawn before near ones, which is correct for convex shapes.
  addHull(hull, isBeside) {
    const {model, object} = this;
    const overlaps = model.relationOf.get(object.index) === 'RELATION_OVERLAPPING';
    const opacity = object.opacity *
        (isBeside || object.isGlass    ? 0.3 :
             overlaps && !isHuge(hull) ? 0.62 :
                                         1);
    const isGlass = opacity < 1;
    const sides = hull.dimension < 3 ? [THREE.DoubleSide] :
        isGlass && !isHuge(hull)     ? [THREE.BackSide, THREE.FrontSide] :
                                       [THREE.FrontSide];
    for (const side of sides) {
      const glass = {
        transparent: true,
        opacity: side === THREE.BackSide ? opacity / 2 : opacity,
        depthWrite: false,
      };
      const material =
          facetMaterial({color: model.colorOf(object), side, ...(isGlass ? glass : {})});
      const part = new THREE.Mesh(geometryOf(hull, 'triangles', model.unit), material);
      part.renderOrder = side === THREE.BackSide ? 3 : 4;
      this.shift(part, hull);
    }
  }

  // The surface of a radius is glass around a solid hull, and solid around a point, a segment, or a
  // polygon.
  addRounded(rounded, {dimension}) {
    const {model, object} = this;
    const overlaps = model.relationOf.get(object.index) === 'RELATION_OVERLAPPING';
    const opacity = object.opacity * (dimension === 3 ? 0.3 : overlaps ? 0.62 : 1);
    const material = facetMaterial({
      color: model.colorOf(object),
      transparent: opacity < 1,
      opacity,
      depthWrite: opacity === 1,
    });
    const part = new THREE.Mesh(geometryOf(rounded, 'triangles', model.unit), material);
    part.renderOrder = 4;
    this.shift(part, rounded);
  }

  addEdges(hull) {
    const relation = RELATIONS[this.model.relationOf.get(this.object.index)];
    const material = new THREE.LineBasicMaterial({
      color: relation ? relation.lit : this.stage.theme.edge,
      transparent: true,
      opacity: (relation ? 0.8 : this.stage.theme.edgeOpacity) * edgeWeight(hull.edgeCount),
    });
    const edges = new THREE.LineSegments(geometryOf(hull, 'edges', this.model.unit), material);
    edges.layers.set(FINE_LAYER);
    edges.renderOrder = 5;
    this.shift(edges, hull);
  }

  place() {
    this.stage.place(this.group, this.model.centerOf(this.object), this.object.pose);
  }

  // Highlights new vertices.
  flash(hull, indices) {
    const position =
        Float32Array.from(indices.flatMap((v) => this.model.drawn(hull.vertex(v), hull.center)));
    const material = discMaterial({
      color: MARK_COLORS.flash,
      size: 11,
      alphaTest: 0,
      transparent: true,
      depthTest: false,
    });
    const points = new THREE.Points(geometryFrom({position}), material);
    points.renderOrder = 6;
    points.userData.end = performance.now() + FLASH_MS;
    this.shift(points, hull);
    points.userData.sharesGeometry = false;
    this.stage.draw();
  }

  // Fades flashes; returns true while any is visible.
  fade(now) {
    let any = false;
    for (const part of [...this.group.children]) {
      const {end} = part.userData;
      if (!end) continue;
      const left = (end - now) / FLASH_MS;
      if (left > 0) {
        part.material.opacity = Math.min(left, 1);
        any = true;
      } else {
        part.geometry.dispose();
        part.material.dispose();
        this.group.remove(part);
      }
    }
    return any;
  }
}
