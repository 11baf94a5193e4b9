// The ground: a grid below the scene, perpendicular to the axis that points up, with lines at
// round coordinates; and a bar in a corner that shows the scale.
import {DrawnGroup} from 'hulld/drawing/drawn_group.js';
import {geometryFrom, THREE} from 'hulld/drawing/three.js';
import {element, short} from 'hulld/panels/dom.js';

// Extent of the grid, in radii of the scene, and pieces of a line, for fading toward its ends.
const REACH = 3.2;
const PIECES = 16;
const MAX_BAR_PIXELS = 110;

// Returns the largest of 1, 2, and 5 times a power of ten that is at most `length`.
function roundBelow(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].map((digit) => digit * power).find((round) => round <= length) ?? power;
}

export class Ground extends DrawnGroup {
  constructor(model, stage) {
    super(model, stage);
    this.bar = document.getElementById('scale');
    stage.afterFrame(() => this.updateBar());
  }

  // `bounds`: those of the scene (model.js), or null.
  rebuild(bounds) {
    this.clear();
    this.step = null;
    if (!bounds || !this.model.show.grid) return;
    const up = 'xyz'.indexOf(this.stage.up);
    const [u, v] = [(up + 1) % 3, (up + 2) % 3];
    const {center, radius, corners} = bounds;
    this.step = roundBelow(radius / 2);
    const reach = REACH * radius;
    const count = 2 * reach / this.step;
    // Near the ends of the range of doubles, there are no round coordinates.
    if (!(count < 100)) return;
    const height = Math.min(...corners.map((corner) => corner[up])) - 0.003 * radius;
    const faint = new THREE.Color(this.stage.theme.ground);
    const strong = new THREE.Color(this.stage.theme.grid);
    const positions = [];
    const colors = [];
    const add = (at) => {
      const distance = Math.hypot(at[u] - center[u], at[v] - center[v]) / reach;
      const color = strong.clone().lerp(faint, Math.min(1, distance ** 2));
      positions.push(...this.stage.local(at).toArray());
      colors.push(color.r, color.g, color.b);
    };
    for (const [along, across] of [[u, v], [v, u]]) {
      // Far from the origin, beyond 2^53 steps, several lines may have the same coordinate.
      const first = Math.ceil((center[across] - reach) / this.step);
      for (let i = 0; i <= count; ++i) {
        const place = (first + i) * this.step;
        const offset = (place - center[across]) / reach;
        const half = reach * Math.sqrt(Math.max(0, 1 - offset ** 2));
        for (let piece = 0; piece < PIECES; ++piece) {
          for (const end of [piece, piece + 1]) {
            const at = [];
            at[up] = height;
            at[across] = place;
            at[along] = center[along] + half * (2 * end / PIECES - 1);
            add(at);
          }
        }
      }
    }
    const geometry =
        geometryFrom({position: new Float32Array(positions), color: new Float32Array(colors)});
    const lines = new THREE.LineSegments(
        geometry, new THREE.LineBasicMaterial({vertexColors: THREE.VertexColors}));
    lines.renderOrder = -1;
    this.group.add(lines);
  }

  updateBar() {
    const perPixel = this.stage.lengthPerPixel();
    const length = roundBelow(MAX_BAR_PIXELS * perPixel);
    if (!(length > 0) || !isFinite(length)) return;
    this.bar.style.width = `${(length / perPixel).toFixed(1)}px`;
    const unit = length === 1 ? 'unit' : 'units';
    const text = `${short(length)} ${unit}`;
    if (this.bar.textContent === text) return;
    this.bar.replaceChildren(element('span', {}, text));
    this.bar.title = 'Length at the center of the view, in the length unit of the points' +
        (this.step ? `; cells of the grid: ${short(this.step)}` : '');
  }
}
