'use strict';
// Plot of one or two curves over the last minute on a canvas.

/** Step of 1, 2 or 5 times a power of ten that divides `span` into at most `most` parts. */
function niceStep(span, most) {
  const raw = span / most, ten = 10 ** Math.floor(Math.log10(raw));
  return ten * [1, 2, 5, 10].find(f => f * ten >= raw * 0.999);
}

/** @param lines [{colour, at}] with at = index of the value in a point; @param least the axis ends at least here. */
function drawPlot(canvas, points, {span, floor, least, unit, lines}) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (width < 40 || height < 40) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const rem = parseFloat(getComputedStyle(document.documentElement).fontSize);
  const g = canvas.getContext('2d');
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = `${rem}px system-ui, "DejaVu Sans", sans-serif`;

  const end = points.length ? points[points.length - 1][0] : span;
  let top = least;
  for (const p of points) for (const l of lines) if (p[l.at] > top) top = p[l.at];
  const step = niceStep((top - floor) * 1.02, height < 8 * rem ? 3 : 4);
  top = floor + Math.ceil((top - floor) / step - 1e-6) * step;
  const left = 3.2 * rem, right = width - 0.3 * rem, upper = 0.6 * rem, lower = height - 1.5 * rem;
  const x = t => right - (end - t) / span * (right - left);
  const y = v => lower - (Math.max(v, floor) - floor) / (top - floor) * (lower - upper);

  g.strokeStyle = '#3a4756';
  g.fillStyle = '#b9c6d3';
  g.lineWidth = 1;
  g.textBaseline = 'middle';
  g.textAlign = 'right';
  for (let v = floor; v <= top + step / 2; v += step) {
    const at = Math.round(y(v)) + 0.5;
    g.beginPath(); g.moveTo(left, at); g.lineTo(right, at); g.stroke();
    g.fillText(String(+v.toFixed(2)), left - 0.4 * rem, at);
  }
  g.textBaseline = 'alphabetic';
  g.textAlign = 'left';
  g.fillText(`${span} s ago`, left, height - 0.2 * rem);
  g.textAlign = 'right';
  g.fillText('now', right, height - 0.2 * rem);
  g.textAlign = 'center';
  g.fillText(unit, (left + right) / 2, height - 0.2 * rem);

  g.lineWidth = 0.18 * rem;
  g.lineJoin = 'round';
  for (const l of lines) {
    g.strokeStyle = l.colour;
    g.beginPath();
    let before = null;
    for (const p of points) {
      // A gap in the data is a gap in the curve.
      if (before === null || p[0] - before > 1.5) g.moveTo(x(p[0]), y(p[l.at])); else g.lineTo(x(p[0]), y(p[l.at]));
      before = p[0];
    }
    g.stroke();
  }
}
