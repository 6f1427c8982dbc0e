// What WCAG 2.1 AA asks of a page that a program can measure: axe-core's rules, contrast of text among them, and the
// contrast of controls (1.4.11), which axe-core does not measure.
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';

/** A script for every page of a context; the page's own policy does not apply to it. */
export const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** Faults of the present view, each a line of text, and the number of texts whose contrast was measured. */
export async function faultsOf(page) {
  const text = await page.evaluate(async () => {
    const result = await axe.run(document, {runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa'], resultTypes: ['violations', 'incomplete', 'passes']});
    const line = (rule, node) => `${rule.id}: ${node.target.join(' ')}: ${[...node.any, ...node.all, ...node.none].map(c => c.message).join(' ')}`;
    const lines = rules => rules.flatMap(rule => rule.nodes.map(node => line(rule, node)));
    // What axe-core leaves open, such as a text of one sign: measured below. The page has no gradients.
    const open = result.incomplete.filter(rule => rule.id === 'color-contrast').flatMap(rule => rule.nodes.map(node => node.target.join(' ')));
    const passed = result.passes.find(rule => rule.id === 'color-contrast');
    return {faults: lines(result.violations), open, texts: passed ? passed.nodes.length : 0};
  });
  const controls = await page.evaluate(open => {
    const luminance = ([r, g, b]) => {
      const part = c => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
      return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
    };
    const ratio = (a, b) => {
      const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
      return (high + 0.05) / (low + 0.05);
    };
    /** [r, g, b] of a colour that is not transparent; null for one that is. */
    const colour = text => {
      const numbers = text.match(/[\d.]+/g).map(Number);
      return numbers.length === 4 && numbers[3] < 1 ? null : numbers.slice(0, 3);
    };
    /** The colour that an element lies on. */
    const ground = element => {
      for (let e = element; e; e = e.parentElement) {
        const found = colour(getComputedStyle(e).backgroundColor);
        if (found) return found;
      }
      return [255, 255, 255];
    };
    const top = document.querySelector('dialog[open]') || document.body, faults = [];
    let measured = 0;
    for (const e of top.querySelectorAll('button, input, select, .chips span, .lane .sign, .lane .bar, svg path, svg circle')) {
      if (e.matches('.chips input, :disabled, .grid') || !e.checkVisibility({checkOpacity: true, checkVisibilityCSS: true})) continue;
      const style = getComputedStyle(e), outside = ground(e.parentElement);
      // A control is seen by its border or its filling; a mark by its colour, in which a slider's track is drawn too.
      const candidates = e.matches('.sign, .bar, [type=range]') ? [style.color] : e.matches('path, circle') ? [style.stroke, style.fill].filter(c => c.startsWith('rgb'))
          : [parseFloat(style.borderTopWidth) >= 1 && style.borderTopStyle !== 'none' ? style.borderTopColor : style.backgroundColor, style.backgroundColor];
      const best = Math.max(...candidates.map(colour).filter(c => c).map(c => ratio(c, outside)));
      ++measured;
      if (!(best >= 3)) faults.push(`${e.tagName} ${e.id || e.getAttribute('class') || e.textContent}: ${best.toFixed(2)} of 3 against what is around it`);
    }
    // The state of a running session may have removed one meanwhile.
    for (const e of open.map(selector => document.querySelector(selector)).filter(found => found)) {
      const own = colour(getComputedStyle(e).color), found = own ? ratio(own, ground(e)) : 0;
      if (!(found >= 4.5)) faults.push(`text ${e.id || e.className || e.textContent}: ${found.toFixed(2)} of 4.5`);
    }
    return {faults: [...new Set(faults)], measured};
  }, text.open);
  return {faults: [...text.faults, ...controls.faults], texts: text.texts, controls: controls.measured};
}

/** Whether the element with the focus is marked, in a colour of at least 3 : 1; its name, or null without a focus. */
export function focusOf() {
  const e = document.activeElement;
  if (!e || e === document.body) return null;
  // The sign of a chip's hidden radio button is on the text beside it.
  const marked = e.matches('.chips input') ? e.nextElementSibling : e, style = getComputedStyle(marked), box = marked.getBoundingClientRect();
  const inside = box.bottom > 0 && box.right > 0 && box.top < innerHeight && box.left < innerWidth;
  // The place on the page, wherever it has been scrolled to.
  let scrolled = 0;
  for (let around = e.parentElement; around; around = around.parentElement) scrolled += around.scrollTop;
  return {name: e.id || e.getAttribute('aria-label') || e.name || e.textContent.trim(), outline: style.outlineStyle === 'none' ? 0 : parseFloat(style.outlineWidth), inside, visible: marked.checkVisibility(),
    top: box.top + scrolled, bottom: box.bottom + scrolled, left: box.left};
}
