// SVG by elements and attributes alone: the policy of the page allows no inline style.
const SPACE = "http://www.w3.org/2000/svg";

export const draw = (name, attributes = {}, ...children) => {
  const made = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  made.append(...children);
  return made;
};
export const picture = (...children) => draw("svg", { viewBox: "0 0 100 100", focusable: "false" }, ...children);
export const path = (d, fill, more = {}) => draw("path", { d, fill, ...more });
export const line = (d, stroke, width, more = {}) =>
  draw("path", { d, fill: "none", stroke, "stroke-width": width, "stroke-linecap": "round", "stroke-linejoin": "round", ...more });
export const disc = (x, y, r, fill, more = {}) => draw("circle", { cx: x, cy: y, r, fill, ...more });
export const board = (x, y, width, height, r, fill, more = {}) => draw("rect", { x, y, width, height, rx: r, fill, ...more });
// Text of a given height of capitals, narrowed to a width where it is wider.
export const letters = (text, x, y, capital, width, fill = "#111", more = {}) => {
  const size = capital / 0.72;
  const made = draw("text", {
    x, y: y + capital / 2, fill, "font-size": size, "text-anchor": "middle", "font-weight": 700, class: "letters", ...more,
  }, text);
  if (text.length * size * 0.6 > width) {
    made.setAttribute("textLength", width);
    made.setAttribute("lengthAdjust", "spacingAndGlyphs");
  }
  return made;
};
