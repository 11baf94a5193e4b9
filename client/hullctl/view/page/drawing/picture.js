// Pictures of the stage: the drawing, its labels, its axes, and its scale. They are independent of
// the browser's window and of timing.

// Returns a canvas with the picture of the last frame.
function pictureOf(stage) {
  const sheet = document.createElement('canvas');
  [sheet.width, sheet.height] = [stage.canvas.width, stage.canvas.height];
  const context = sheet.getContext('2d');
  context.drawImage(stage.canvas, 0, 0);
  const ratio = stage.canvas.width / stage.canvas.clientWidth;
  context.scale(ratio, ratio);
  const origin = stage.canvas.getBoundingClientRect();
  drawTriad(context, origin);
  drawScale(context, origin);
  for (const label of stage.canvas.parentElement.querySelectorAll('.label:not([hidden])')) {
    drawLabel(context, origin, label);
  }
  return sheet;
}

// Keeps a PNG of each frame in an attribute of the body, which the browser outputs as text; for
// `hullctl view --png`.
export function keepPicture(stage) {
  stage.afterFrame(() => {
    document.body.dataset.png = pictureOf(stage).toDataURL('image/png');
  });
}

// Lets the browser save a PNG under the name.
export function savePicture(stage, name) {
  const link = document.createElement('a');
  link.download = name;
  link.href = pictureOf(stage).toDataURL('image/png');
  link.click();
}

function boxOf(element, origin) {
  const {left, top, width, height} = element.getBoundingClientRect();
  return {left: left - origin.left, top: top - origin.top, width, height};
}

function drawText(context, text, style, x, y) {
  context.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  context.fillText(text, x, y);
}

function drawLabel(context, origin, label) {
  const style = getComputedStyle(label);
  const {left, top, width, height} = boxOf(label, origin);
  context.fillStyle = style.backgroundColor;
  context.beginPath();
  context.roundRect(left, top, width, height, parseFloat(style.borderRadius));
  context.fill();
  context.textBaseline = 'middle';
  context.textAlign = 'left';
  const range = document.createRange();
  for (const part of label.childNodes) {
    const partStyle = part.nodeType === Node.TEXT_NODE ? style : getComputedStyle(part);
    range.selectNodeContents(part);
    const box = boxOf(range, origin);
    context.fillStyle = partStyle.color;
    drawText(context, part.textContent, partStyle, box.left, box.top + box.height / 2);
  }
}

function drawTriad(context, origin) {
  const triad = document.getElementById('triad');
  const style = getComputedStyle(triad);
  const {left, top, width, height} = boxOf(triad, origin);
  const number = (part, name) => Number(part.getAttribute(name) || 0);
  context.save();
  context.translate(left + width / 2, top + height / 2);
  context.scale(width / triad.viewBox.baseVal.width, height / triad.viewBox.baseVal.height);
  context.textBaseline = 'middle';
  context.textAlign = 'center';
  for (const part of triad.children) {
    if (part.tagName === 'line') {
      context.strokeStyle = part.getAttribute('stroke');
      context.lineWidth = number(part, 'stroke-width');
      context.beginPath();
      context.moveTo(0, 0);
      context.lineTo(number(part, 'x2'), number(part, 'y2'));
      context.stroke();
    } else {
      context.fillStyle = style.color;
      drawText(context, part.textContent, style, number(part, 'x'), number(part, 'y'));
    }
  }
  context.restore();
}

function drawScale(context, origin) {
  const bar = document.getElementById('scale');
  if (!bar.textContent) return;
  const style = getComputedStyle(bar);
  const {left, top, width, height} = boxOf(bar, origin);
  context.strokeStyle = context.fillStyle = style.color;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(left + 0.5, top + height - 5);
  context.lineTo(left + 0.5, top + height - 0.5);
  context.lineTo(left + width - 0.5, top + height - 0.5);
  context.lineTo(left + width - 0.5, top + height - 5);
  context.stroke();
  context.textBaseline = 'bottom';
  context.textAlign = 'center';
  drawText(context, bar.textContent, style, left + width / 2, top + height - 4);
}
