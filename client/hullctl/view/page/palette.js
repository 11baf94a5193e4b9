// Colors distinguishable with any kind of color vision, and the accompanying words. Source: Okabe
// and Ito 2008, Color Universal Design.
export const OBJECT_COLORS = [
  '#56b4e9', '#009e73', '#cc79a7', '#f0e442', '#0072b2', '#999999', '#6a4c93', '#8bd3c7', '#a65e8b',
  '#bcbd5a'
];

// A neutral color: among many objects, only the colliding ones stand out.
export const CROWD_COLOR = '#8fa9bd';

// `sign` distinguishes relations without color.
export const RELATIONS = {
  RELATION_OVERLAPPING: {word: 'overlapping', sign: '\u25cf', style: 'overlapping', lit: '#d55e00'},
  RELATION_TOUCHING: {word: 'touching', sign: '\u25d0', style: 'touching', lit: '#e69f00'},
  RELATION_SEPARATED: {word: 'separated', sign: '\u25cb', style: 'separated', lit: '#0072b2'},
  RELATION_WITHIN_TOLERANCE:
      {word: 'within tolerance', sign: '\u25cc', style: 'tolerance', lit: '#cc79a7'},
};

export const RUNGS = {
  RUNG_BOUNDS: 'bounds of the hulls',
  RUNG_CACHED: 'result of the previous step',
  RUNG_FLOATING_POINT: 'floating point, proven bound',
  RUNG_EXACT: 'exact arithmetic',
};

export const MARK_COLORS = {
  plane: '#56b4e9',
  axis: '#009e73',
  witness: '#d55e00',
  certificate: '#cc79a7',
  shell: '#f0e442',
  flash: '#e69f00',
};
export const AXIS_COLORS = {
  x: '#d55e00',
  y: '#009e73',
  z: '#0072b2'
};

export const THEMES = {
  light: {
    ground: 0xf4f5f6,
    edge: 0x2a3036,
    edgeOpacity: 0.6,
    grid: 0xc3c9d0,
    sky: 0xffffff,
    earth: 0x8c939c
  },
  dark: {
    ground: 0x121417,
    edge: 0xd5dae0,
    edgeOpacity: 0.35,
    grid: 0x3a4149,
    sky: 0xffffff,
    earth: 0x6a7078
  },
};
