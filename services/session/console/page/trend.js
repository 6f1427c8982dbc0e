'use strict';
// The scores of one exercise over the attempts, with the level that passes and the other trainees' scores; and the
// instructor's table of trainees and exercises.

const trend = (() => {
  let shown = null;

  const percent = value => `${value.toFixed(0)} %`;
  const shape = (name, attributes, text) => {
    const element = document.createElementNS($('trend-chart').namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };

  /** The chart, drawn for a width of `width` CSS pixels. */
  function chart({scores, cohort, pass}, width) {
    const height = 260, left = 56, right = width - 16, top = 14, bottom = height - 34;
    const count = Math.max(2, scores.length, cohort.length);
    const x = i => left + (right - left) * (i + 0.5) / count, y = score => bottom - (bottom - top) * score / 100;
    const parts = [];
    for (const value of [0, 25, 50, 75, 100]) {
      parts.push(shape('path', {class: 'grid', d: `M${left} ${y(value)}H${right}`}), shape('text', {x: left - 8, y: y(value) + 5, 'text-anchor': 'end'}, percent(value)));
    }
    const step = Math.ceil(count * 40 / (right - left));
    for (let i = 0; i < count; i += step) parts.push(shape('text', {x: x(i), y: height - 12, 'text-anchor': 'middle'}, i + 1));
    cohort.forEach(({low, median, high}, i) => {
      parts.push(shape('path', {class: 'spread', d: `M${x(i)} ${y(low)}V${y(high)}M${x(i) - 7} ${y(low)}h14M${x(i) - 7} ${y(high)}h14`}),
        shape('path', {class: 'median', d: `M${x(i) - 10} ${y(median)}h20`}));
    });
    parts.push(shape('path', {class: 'pass', d: `M${left} ${y(pass)}H${right}`}));
    parts.push(shape('path', {class: 'scores', d: scores.map((s, i) => `${i ? 'L' : 'M'}${x(i)} ${y(s)}`).join('')}));
    scores.forEach((s, i) => parts.push(shape('circle', {class: 'score', cx: x(i), cy: y(s), r: 5})));
    return [height, parts];
  }

  function open(exercise) {
    const {scores, cohort, pass} = exercise;
    setText($('trend-title'), `Scores of ${exercise.scene}`);
    setText($('trend-pass'), `Passed from ${percent(pass)}`);
    setText($('trend-note'), cohort.length ? '' : 'The scores of others are shown where at least three others have done the exercise.');
    $('trend-others').hidden = !cohort.length;
    const rows = [];
    for (let i = 0; i < Math.max(scores.length, cohort.length); ++i) {
      const row = make('tr'), score = scores[i], other = cohort[i];
      row.append(make('th', '', i + 1), make('td', 'number', score === undefined ? '–' : percent(score)),
        make('td', '', score === undefined ? '' : score >= pass ? '● passed' : '○ not passed'),
        make('td', 'number', other ? `${percent(other.median)} (${other.low.toFixed(0)} to ${other.high.toFixed(0)}), ${other.people} people` : '–'));
      row.firstChild.scope = 'row';
      rows.push(row);
    }
    $('trend-rows').replaceChildren(...rows);
    $('trend-box').showModal();
    shown = exercise;
    draw();
  }
  function draw() {
    if (!$('trend-box').open) return;
    const svg = $('trend-chart'), width = Math.max(240, svg.parentElement.clientWidth), [height, parts] = chart(shown, width);
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    svg.replaceChildren(...parts);
  }

  /** A button with the small plot of an exercise. */
  function button(exercise) {
    const {scores, cohort, pass, scene} = exercise, svg = $('trend-form').cloneNode(true), element = make('button', 'trend');
    svg.removeAttribute('id');
    svg.removeAttribute('hidden');
    svg.setAttribute('aria-hidden', 'true');
    const y = score => 42 - 0.4 * score, count = Math.max(2, scores.length), x = i => 8 + 104 * (scores.length < 2 ? 0.5 : i / (count - 1));
    svg.querySelector('.pass').setAttribute('d', `M0 ${y(pass)}H120`);
    svg.querySelector('.scores').setAttribute('d', scores.map((s, i) => `${i ? 'L' : 'M'}${x(i)} ${y(s)}h.1`).join(''));
    element.type = 'button';
    element.setAttribute('aria-label', `Scores of ${scene}: ${scores.length ? scores.map(percent).join(', ') : 'none of yours'}${cohort.length ? ', and those of others' : ''}`);
    element.append(svg);
    element.addEventListener('click', () => open(exercise));
    return element;
  }

  /** The table of all trainees and the exercises that they have tried, for an instructor. */
  function group(people) {
    $('group').hidden = !people.length;
    $('group-rows').replaceChildren(...people.flatMap(({trainee, results}) => results.map((result, i) => {
      const row = make('tr');
      if (!i) row.append(Object.assign(make('th', '', trainee), {scope: 'rowgroup', rowSpan: results.length}));
      row.append(make('td', '', result.scene), make('td', 'number', percent(result.best)), make('td', 'number', result.attempts),
        make('td', result.passed ? 'level-good' : 'level-off', result.passed ? '● passed' : '○ not passed'));
      return row;
    })));
  }

  document.addEventListener('DOMContentLoaded', () => $('trend-close').addEventListener('click', () => $('trend-box').close()));
  window.addEventListener('resize', draw);
  return {button, group};
})();
