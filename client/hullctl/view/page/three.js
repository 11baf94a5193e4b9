// three.js r111, as Debian's libjs-three has it: a classic script that was loaded before us.
// Nothing else names the global, so that another version or library needs a change here alone.
export const THREE = globalThis.THREE;

// Points as discs; without it they are squares.
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
