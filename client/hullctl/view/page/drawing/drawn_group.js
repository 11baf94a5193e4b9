// Parts drawn for one purpose, in a group of the scene, added and removed together.
import {THREE} from 'hulld/drawing/three.js';

export class DrawnGroup {
  constructor(model, stage) {
    this.model = model;
    this.stage = stage;
    this.group = new THREE.Group();
    stage.scene.add(this.group);
  }

  // Removes all parts and frees their GPU resources.
  clear() {
    this.group.traverse((part) => {
      if (!part.userData.sharesGeometry) part.geometry?.dispose();
      part.material?.dispose();
    });
    this.group.remove(...this.group.children);
  }

  dispose() {
    this.clear();
    this.stage.scene.remove(this.group);
  }
}

// Material of flat-shaded facets. Without highlights, each facet has one color.
export const facetMaterial = (options) => new THREE.MeshPhongMaterial({
  flatShading: true,
  specular: 0x000000,
  polygonOffset: true,
  polygonOffsetFactor: 1,
  polygonOffsetUnits: 1,
  ...options,
});
