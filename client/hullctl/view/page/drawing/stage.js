// The picture: renderer, camera, lights, and orbiting. Draws only after changes. Uses
// drawn coordinates (model.js).
import {THREE} from 'hulld/drawing/three.js';
import {AXIS_COLORS, THEMES} from 'hulld/palette.js';
import {unitQuaternion} from 'hulld/pose.js';

const FLIGHT_MS = 350;

// Parts on this layer are left out of coarse frames.
export const FINE_LAYER = 1;
// Frame time above which frames are drawn coarsely, until a pause.
const SLOW_MS = 50;
const PAUSE_MS = 200;

// Returns true if WebGL draws on the processor.
function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl');
  const info = gl?.getExtension('WEBGL_debug_renderer_info');
  return Boolean(info) &&
      /swiftshader|llvmpipe|software/i.test(gl.getParameter(info.UNMASKED_RENDERER_WEBGL));
}

const calm = matchMedia('(prefers-reduced-motion: reduce)');

export class Stage {
  constructor(canvas, model) {
    this.model = model;
    this.canvas = canvas;
    // In software, antialiasing makes each frame of a motion more than twice as slow; pictures at
    // rest are drawn at a higher resolution instead.
    this.antialias = !isSoftware() || document.body.classList.contains('picture');
    this.renderer =
        new THREE.WebGLRenderer({canvas, antialias: this.antialias, preserveDrawingBuffer: true});
    this.isCoarse = false;
    this.slowFrames = 0;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.1, 1000);
    this.camera.layers.enable(FINE_LAYER);
    // The sky distinguishes upper from lower faces; the lamp, above the camera's left,
    // distinguishes left from right ones.
    this.sky = new THREE.HemisphereLight(0xffffff, 0x888888, 0.7);
    this.lamp = new THREE.DirectionalLight(0xffffff, 0.42);
    this.lamp.position.set(-0.7, 1, 0.5);
    // The light shines from its position toward its target; both move with the camera.
    this.camera.add(this.lamp, this.lamp.target);
    this.scene.add(this.sky, this.camera);
    this.isOrthographic = false;
    // True until the user moves the camera: then the whole scene stays in view.
    this.isFitted = false;
    this.radius = 1;
    this.frames = 0;
    this.before = [];
    this.after = [];
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener('webglcontextrestored', () => this.draw());
    this.setUp('y');
    this.resize();
  }

  // `up`: the axis that points up.
  setUp(up) {
    this.up = up;
    this.camera.up.set(...{x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1]}[up]);
    this.controls?.dispose();
    // OrbitControls reads the axis in its constructor.
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.enableKeys = false;
    this.controls.screenSpacePanning = true;
    let byHand = false;
    this.controls.addEventListener('start', () => {
      byHand = true;
      this.flight = null;
    });
    this.controls.addEventListener('end', () => {
      byHand = false;
    });
    this.controls.addEventListener('change', () => {
      if (byHand) this.isFitted = false;
      this.draw(byHand);
    });
    const [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const negative = (axis) => axis.map((value) => -value);
    const front = {x: z, y: z, z: negative(y)}[up];
    const right = {x: negative(y), y: x, z: x}[up];
    // Directions from the target to the camera. The top view is tilted slightly to the front, so
    // that the front is at the bottom of the picture.
    this.views = {
      front,
      right,
      top: this.camera.up.toArray().map((value, k) => value + 1e-4 * front[k]),
      isometric: this.camera.up.toArray().map((value, k) => value + front[k] + right[k]),
    };
    this.sky.position.copy(this.camera.up);
  }

  // Pixels of the picture per CSS pixel; changes when the user zooms the page.
  get pixelRatio() {
    if (this.isCoarse) return 0.5;
    return this.antialias ? Math.min(devicePixelRatio, 2) : 2;
  }

  setTheme(name) {
    this.theme = THEMES[name];
    this.renderer.setClearColor(this.theme.ground);
    this.sky.color.set(this.theme.sky);
    this.sky.groundColor.set(this.theme.earth);
    this.draw();
  }

  resize() {
    const {clientWidth, clientHeight} = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(this.pixelRatio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.draw();
  }

  // Returns a world point in drawn coordinates: subtracts in double, before the GPU's floats would
  // lose the difference.
  local(p) {
    return new THREE.Vector3(...this.model.drawn(p));
  }

  // Moves a part to a world point, with the rotation of a pose.
  place(part, center, pose) {
    const [w, x, y, z] = unitQuaternion(pose);
    part.position.copy(this.local(center));
    part.quaternion.set(x, y, z, w);
  }

  // Requests a frame. `isMotion`: it belongs to a motion of the camera or of an object.
  draw(isMotion = false) {
    this.isMotion ||= isMotion;
    if (this.waiting) return;
    this.waiting = requestAnimationFrame((now) => {
      this.waiting = 0;
      if (this.isMotion) this.adaptTo(this.isMoving ? now - this.drawn : 0);
      this.isMotion = false;
      this.frame(now);
      this.drawn = now;
    });
  }

  // Draws a motion coarsely after two frames in succession that took too long, until a pause.
  adaptTo(duration) {
    this.isMoving = true;
    this.slowFrames = duration > SLOW_MS ? this.slowFrames + 1 : 0;
    if (this.slowFrames > 1) this.setCoarse(true);
    clearTimeout(this.pause);
    // The browser delays the callback until it has shown the frame.
    requestAnimationFrame(() => {
      clearTimeout(this.pause);
      this.pause = setTimeout(() => {
        this.isMoving = false;
        if (!this.isCoarse) return;
        this.setCoarse(false);
        this.draw();
      }, PAUSE_MS);
    });
  }

  // Coarse frames have half of the resolution, and no fine parts.
  setCoarse(on) {
    if (on === this.isCoarse) return;
    this.isCoarse = on;
    this.camera.layers[on ? 'disable' : 'enable'](FINE_LAYER);
    this.renderer.setPixelRatio(this.pixelRatio);
  }

  // Calls `update(now)` before each frame; frames continue while one returns true.
  beforeFrame(update) {
    this.before.push(update);
  }

  // Calls `update()` after each frame, with the camera of that frame.
  afterFrame(update) {
    this.after.push(update);
  }

  frame(now) {
    let more = this.fly(now);
    for (const update of this.before) more = update(now) || more;
    this.project();
    this.renderer.render(this.scene, this.camera);
    ++this.frames;
    this.drawTriad();
    for (const update of this.after) update();
    if (more) this.draw(Boolean(this.flight));
  }

  get distance() {
    return this.camera.position.distanceTo(this.controls.target);
  }

  // Returns half of the height of the picture at the target.
  get halfHeight() {
    return this.distance * Math.tan(this.camera.fov * Math.PI / 360);
  }

  // In the caller's length unit.
  lengthPerPixel() {
    return 2 * this.halfHeight / this.canvas.clientHeight * this.model.unit;
  }

  // Fits the near and far planes to the scene, for full depth precision. The orthographic view has
  // the scale of the perspective one at the target.
  project() {
    const {camera, distance} = this;
    const reach = 4 * this.radius / this.model.unit + this.controls.target.length();
    camera.near = Math.max((distance - reach) / 2, distance / 500, reach / 1e5);
    camera.far = distance + 2 * reach;
    camera.updateProjectionMatrix();
    if (!this.isOrthographic) return;
    const height = this.halfHeight;
    const width = height * camera.aspect;
    camera.projectionMatrix.makeOrthographic(
        -width, width, height, -height, distance - 2 * reach, camera.far);
    camera.projectionMatrixInverse.getInverse(camera.projectionMatrix);
  }

  setOrthographic(on) {
    this.isOrthographic = on;
    this.draw();
  }

  // Returns the direction from the target to the camera that shows three sides.
  defaultView() {
    const view = {x: [0.45, 0.8, 0.75], y: [0.75, 0.45, 0.8], z: [0.75, -0.8, 0.45]}[this.up];
    return new THREE.Vector3(...view).normalize();
  }

  // Shows all of the bounds (model.js); keeps the direction of view unless one is given: a key of
  // `views`, or a vector.
  flyTo({center, radius, corners}, {jump = false, direction = null} = {}) {
    const target = this.local(center);
    const view = this.views[direction] ?
        new THREE.Vector3(...this.views[direction]) :
        direction?.clone() || this.camera.position.clone().sub(this.controls.target);
    view.normalize();
    if (!(view.length() > 0.5)) view.copy(this.defaultView());
    const right = new THREE.Vector3().crossVectors(this.camera.up, view).normalize();
    const up = new THREE.Vector3().crossVectors(view, right);
    // Distance at which each corner is within the picture, with a margin for handles and labels.
    const height = 0.84 * Math.tan(this.camera.fov * Math.PI / 360);
    const width = height * this.camera.aspect;
    let distance = 0.05 * radius / this.model.unit;
    for (const corner of corners) {
      const p = this.local(corner).sub(target);
      const depth = this.isOrthographic ? 0 : p.dot(view);
      distance = Math.max(
          distance, depth + Math.abs(p.dot(up)) / height, depth + Math.abs(p.dot(right)) / width);
    }
    const position = target.clone().addScaledVector(view, distance);
    if (jump || calm.matches) {
      this.flight = null;
      this.controls.target.copy(target);
      this.camera.position.copy(position);
      this.controls.update();
    } else {
      this.flight = {
        start: null,
        from: [this.controls.target.clone(), this.camera.position.clone()],
        to: [target, position],
      };
    }
    this.draw();
  }

  // Shows all of the bounds again if they grew out of the picture, unless the user chose the view.
  // Leaves room for further growth.
  keepInView(bounds) {
    if (!this.isFitted || this.flight) return;
    const isOutside = bounds.corners.some((corner) => {
      const seen = this.toScreen(this.local(corner));
      return !seen || seen[0] < 0 || seen[0] > this.canvas.clientWidth || seen[1] < 0 ||
          seen[1] > this.canvas.clientHeight;
    });
    if (!isOutside) return;
    const {center, radius, corners} = bounds;
    this.radius = radius;
    const roomy =
        corners.map((corner) => corner.map((value, k) => center[k] + 1.3 * (value - center[k])));
    this.flyTo({center, radius, corners: roomy});
  }

  fly(now) {
    if (!this.flight) return false;
    const flight = this.flight;
    flight.start ??= now;
    const t = Math.min((now - flight.start) / FLIGHT_MS, 1);
    const eased = t * t * (3 - 2 * t);
    this.controls.target.lerpVectors(flight.from[0], flight.to[0], eased);
    this.camera.position.lerpVectors(flight.from[1], flight.to[1], eased);
    this.camera.lookAt(this.controls.target);
    if (t < 1) return true;
    this.flight = null;
    this.controls.update();
    return false;
  }

  // For the keyboard: angles in radians, a factor of the distance, or a shift across the picture.
  orbit(around, over) {
    this.isFitted = false;
    const offset = this.camera.position.clone().sub(this.controls.target);
    const up = this.camera.up;
    const right = new THREE.Vector3().crossVectors(up, offset).normalize();
    const height = offset.angleTo(up);
    offset.applyAxisAngle(right, Math.min(Math.max(over, 0.05 - height), Math.PI - 0.05 - height));
    offset.applyAxisAngle(up, around);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw(true);
  }

  zoom(factor) {
    this.isFitted = false;
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw(true);
  }

  pan(right, up) {
    this.isFitted = false;
    const shift = new THREE.Vector3(right, up, 0)
                      .multiplyScalar(this.distance * 0.05)
                      .applyQuaternion(this.camera.quaternion);
    this.camera.position.add(shift);
    this.controls.target.add(shift);
    this.controls.update();
    this.draw(true);
  }

  // Returns the position of a scene point in the picture, in CSS pixels; null behind the camera.
  toScreen(point) {
    const p = point.clone().project(this.camera);
    if (p.z > 1 || p.z < -1) return null;
    return [(p.x + 1) / 2 * this.canvas.clientWidth, (1 - p.y) / 2 * this.canvas.clientHeight];
  }

  // Draws the world axes in a corner.
  drawTriad() {
    const svg = document.getElementById('triad');
    if (!svg.firstChild) {
      for (const name of 'xyz') {
        const line = document.createElementNS(svg.namespaceURI, 'line');
        const text = document.createElementNS(svg.namespaceURI, 'text');
        line.setAttribute('stroke', AXIS_COLORS[name]);
        line.setAttribute('stroke-width', '2');
        text.setAttribute('fill', 'currentColor');
        text.setAttribute('text-anchor', 'middle');
        text.setAttribute('dominant-baseline', 'central');
        text.textContent = name;
        svg.append(line, text);
      }
    }
    const inverse = this.camera.quaternion.clone().conjugate();
    ['x', 'y', 'z'].forEach((name, i) => {
      const axis = new THREE.Vector3(+(i === 0), +(i === 1), +(i === 2)).applyQuaternion(inverse);
      const [line, text] = [svg.children[2 * i], svg.children[2 * i + 1]];
      line.setAttribute('x2', 22 * axis.x);
      line.setAttribute('y2', -22 * axis.y);
      text.setAttribute('x', 31 * axis.x);
      text.setAttribute('y', -31 * axis.y);
    });
  }
}
