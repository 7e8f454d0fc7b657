// The speed: a number, an arc, and on it marks of the limit (a bar) and of the target (a wedge).
import { draw, letters, line, path, picture } from "./drawing.js";

const FROM = -135, SWEEP = 270, RADIUS = 44;
const SCALES = { "km/h": [80, 140, 220], mph: [50, 90, 140] };
const PER_MPS = { "km/h": 3.6, mph: 1 / 0.44704 };

export const inUnit = (mps, unit) => mps * PER_MPS[unit];

const at = (share, radius) => {
  const turn = ((FROM + SWEEP * Math.min(1, Math.max(0, share))) * Math.PI) / 180;
  return `${(50 + radius * Math.sin(turn)).toFixed(2)} ${(50 - radius * Math.cos(turn)).toFixed(2)}`;
};
const arc = (share, radius) => `M${at(0, radius)}A${radius} ${radius} 0 ${share * SWEEP > 180 ? 1 : 0} 1 ${at(share, radius)}`;
const mark = (share, inside) => draw("g", { transform: `rotate(${FROM + SWEEP * Math.min(1, share)} 50 50)` }, inside);

export const speedRing = ({ speed, limit, target, unit, warning }) => {
  const shown = speed === null ? null : Math.round(inUnit(speed, unit));
  const most = SCALES[unit].find((each) => each >= 1.2 * inUnit(limit ?? speed ?? 0, unit)) ?? SCALES[unit].at(-1);
  const share = (mps) => inUnit(mps, unit) / most;
  const made = picture(line(arc(1, RADIUS), "var(--track)", 7));
  if (shown !== null && shown > 0) made.append(line(arc(Math.min(1, share(speed)), RADIUS), "var(--arc)", 7, { class: "arc" }));
  if (limit !== null) made.append(mark(share(limit), line("M50 1V12", "var(--limit)", 3.5, { class: "limit" })));
  if (target !== null) made.append(mark(share(target), path("M50 12 45.500 22H54.500Z", "var(--target)", { class: "target" })));
  if (warning !== "none") made.append(draw("rect", { x: 22, y: 27, width: 56, height: 38, rx: 6, fill: "var(--over)", class: "over" }));
  made.append(
    letters(shown === null ? "–" : String(shown), 50, 46, 27, 50, warning !== "none" ? "var(--on-over)" : "var(--ink)", { id: "speed-number" }),
    letters(unit, 50, 80, 13.5, 44, "var(--ink)"),
  );
  return { made, shown };
};
