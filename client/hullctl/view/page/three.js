// three.js r111, as in Debian's libjs-three: a classic script loaded before our modules. Only this
// file names the global, so another version or library needs a change only here.
export const THREE = globalThis.THREE;

// Draws points as discs; without the texture they are squares.
let disc = null;
export function discTexture() {
  if (!disc) {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 32;
    const context = canvas.getContext('2d');
    context.fillStyle = '#fff';
    context.arc(16, 16, 15, 0, 2 * Math.PI);
    context.fill();
    disc = new THREE.CanvasTexture(canvas);
  }
  return disc;
}
