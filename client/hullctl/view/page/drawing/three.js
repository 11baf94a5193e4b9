// three.js r111, as in Debian's libjs-three: a classic script loaded before our modules. Only this
// file names the global, so another version or library needs a change only here.
export const THREE = globalThis.THREE;

// three.js derives the kind of projection from the class of the camera; Stage switches it without
// changing the class.
THREE.Raycaster.prototype.setFromCamera = function({x, y}, camera) {
  this.ray.origin.set(x, y, -1).unproject(camera);
  this.ray.direction.set(x, y, 1).unproject(camera).sub(this.ray.origin).normalize();
};

function textureOf(size, draw) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = size;
  draw(canvas.getContext('2d'), size);
  return new THREE.CanvasTexture(canvas);
}

// Draws points as discs; without the texture they are squares.
let disc = null;
function discTexture() {
  disc ??= textureOf(32, (context, size) => {
    context.fillStyle = '#fff';
    context.arc(size / 2, size / 2, size / 2 - 1, 0, 2 * Math.PI);
    context.fill();
  });
  return disc;
}

// Material of points as discs of a size in pixels.
export const discMaterial = (options) => new THREE.PointsMaterial(
    {sizeAttenuation: false, map: discTexture(), alphaTest: 0.3, ...options});

// Creates a geometry of the attributes, and of the indices, if given.
export function geometryFrom(attributes, index = null) {
  const geometry = new THREE.BufferGeometry();
  for (const [name, values] of Object.entries(attributes)) {
    geometry.setAttribute(
        name, values.isBufferAttribute ? values : new THREE.BufferAttribute(values, 3));
  }
  if (index) geometry.setIndex(new THREE.BufferAttribute(index, 1));
  return geometry;
}

// A cell of a grid: a line at its border over a faint fill, in white.
let cell = null;
export function gridTexture() {
  cell ??= textureOf(64, (context, size) => {
    context.fillStyle = 'rgba(255, 255, 255, 0.16)';
    context.fillRect(0, 0, size, size);
    context.fillStyle = 'rgba(255, 255, 255, 0.75)';
    context.fillRect(0, 0, size, 2);
    context.fillRect(0, 0, 2, size);
  });
  cell.wrapS = cell.wrapT = THREE.RepeatWrapping;
  cell.anisotropy = 4;
  return cell;
}
