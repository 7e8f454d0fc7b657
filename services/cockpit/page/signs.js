// Signs as the countries have them, drawn here: a limit, and the closed list of pictures beside a message.
import { board, disc, draw, letters, line, path, picture } from "./drawing.js";

const RED = "#c8102e", INK = "#111", WHITE = "#fff", YELLOW = "#ffd100", BLUE = "#00549f", GREY = "#6b6b6b", GREEN = "#00843d";
const YELLOW_GROUND = new Set(["SWE", "FIN", "ISL"]);
const YELLOW_WARNING = new Set(["SWE", "FIN", "ISL", "POL"]);
const DIAMONDS = new Set(["USA", "CAN", "MEX", "IRL", "AUS", "NZL", "JPN"]);
const UNION = new Set("AUT BEL BGR HRV CYP CZE DNK EST FIN FRA DEU GRC HUN IRL ITA LVA LTU LUX MLT NLD POL PRT ROU SVK SVN ESP SWE".split(" "));
const BOARDS = new Map([["USA", ["SPEED", "LIMIT"]], ["CAN", ["MAXIMUM"]]]);

const number = (value) => (value === null || value === undefined ? "" : String(Math.round(value)));

const ring = (value, country) => [
  disc(50, 50, 48, WHITE), disc(50, 50, 47, RED), disc(50, 50, 35.5, YELLOW_GROUND.has(country) ? YELLOW : WHITE),
  letters(value, 50, 50, value.length > 2 ? 27 : 34, value.length > 2 ? 60 : 56),
];
const boarded = (value, words) => [
  board(14, 1, 72, 98, 7, WHITE, { stroke: GREY, "stroke-width": 0.8 }),
  board(17, 4, 66, 92, 5, "none", { stroke: INK, "stroke-width": 2.5 }),
  ...words.map((word, at) => letters(word, 50, (words.length > 1 ? 16 : 21) + at * 16.5, 10.5, 54)),
  letters(value, 50, 68, 37, 58),
];
const advisory = (value, country) => country === "USA" || country === "CAN"
  ? [board(8, 8, 84, 84, 6, YELLOW, { stroke: INK, "stroke-width": 2.5 }), letters(value, 50, 50, 40, 72)]
  : [board(8, 8, 84, 84, 6, BLUE, { stroke: WHITE, "stroke-width": 3 }), letters(value, 50, 50, 40, 70, WHITE)];
const crossed = () => line("M14 86 86 14M14 14 86 86", RED, 7, { class: "crossed" });

// The limit in force. `known`: known, assumed (a question mark), unknown (crossed out).
export const limitSign = (limit, country, known) => {
  if (known === "unknown" || !limit) {
    return picture(disc(50, 50, 47, "#bbb"), disc(50, 50, 35.5, WHITE), letters("–", 50, 50, 30, 40, GREY), crossed());
  }
  const value = number(limit.value);
  const words = BOARDS.get(country);
  const made = picture(...(limit.advisory ? advisory(value, country) : words ? boarded(value, words) : ring(value, country)));
  if (known === "assumed") {
    made.append(disc(82, 19, 17, INK, { stroke: WHITE, "stroke-width": 3 }), letters("?", 82, 19, 22, 24, WHITE));
  }
  return made;
};
export const crossedOut = (made) => { made.append(crossed()); return made; };

const warning = (country, ...inside) => {
  const group = draw("g", {}, ...inside);
  if (DIAMONDS.has(country)) {
    group.setAttribute("transform", "translate(50 50) scale(.78) translate(-50 -56)");
    return picture(path("M50 1 99 50 50 99 1 50Z", INK), path("M50 5 95 50 50 95 5 50Z", YELLOW), group);
  }
  group.setAttribute("transform", "translate(50 66) scale(.66) translate(-50 -56)");
  return picture(
    path("M50 5 98 90Q99 94 95 94H5Q1 94 2 90Z", RED),
    path("M50 22 84 84H16Z", YELLOW_WARNING.has(country) ? YELLOW : WHITE), group,
  );
};
const car = (fill, y = 0) => path(`M20 ${72 + y}V${56 + y}L30 ${52 + y} 38 ${36 + y}H62L70 ${52 + y} 80 ${56 + y}V${72 + y}H74A7 7 0 0 1 60 ${72 + y}H40A7 7 0 0 1 26 ${72 + y}Z`, fill);
const walker = () => [
  disc(52, 28, 7, INK),
  line("M51 39 48 58 38 80M48 58 60 80M51 40 38 52M51 40 64 52", INK, 7),
];
const wave = (y) => line(`M20 ${y}q7-8 15 0t15 0 15 0 15 0`, INK, 5);
const light = (lit, colour) => picture(
  board(28, 3, 44, 94, 10, "#222", { stroke: WHITE, "stroke-width": 1.5 }),
  ...[22, 50, 78].map((y, at) => disc(50, y, 12, at === lit ? colour : "#555")),
);
const sheet = (fill, ...inside) => picture(board(6, 6, 88, 88, 10, fill, { stroke: WHITE, "stroke-width": 3 }), ...inside);
const arrow = () => path("M50 6 66 26H56V40H44V26H34Z", WHITE, { stroke: INK, "stroke-width": 3 });

const FACES = {
  limit: ({ value, country }) => limitSign({ value }, country, "known"),
  limit_advisory: ({ value, country }) => limitSign({ value, advisory: true }, country, "known"),
  limit_ahead: ({ value, country }) => {
    const small = draw("g", { transform: "translate(14 30) scale(.7)" });
    small.append(...limitSign({ value }, country, "known").childNodes);
    return picture(arrow(), small);
  },
  border: ({ country }) => sheet(
    BLUE, ...Array.from({ length: UNION.has(country) ? 12 : 0 }, (_, at) => disc(50 + 33 * Math.sin(at * Math.PI / 6), 50 - 33 * Math.cos(at * Math.PI / 6), 3.2, YELLOW)),
    letters(country || "–", 50, 50, UNION.has(country) ? 16 : 24, UNION.has(country) ? 46 : 72, WHITE),
  ),
  stop: () => picture(
    path("M30 2H70L98 30V70L70 98H30L2 70V30Z", WHITE), path("M31.500 5H68.500L95 31.500V68.500L68.500 95H31.500L5 68.500V31.500Z", RED),
    letters("STOP", 50, 50, 25, 78, WHITE),
  ),
  give_way: () => picture(path("M4 8H96Q99 8 98 12L53 93Q50 97 47 93L2 12Q1 8 4 8Z", RED), path("M20 19H80L50 74Z", WHITE)),
  red_light: () => light(0, "#ff3b30"),
  green_light: () => light(2, "#30d158"),
  person: ({ country }) => warning(country, ...walker()),
  vehicle: ({ country }) => warning(country, car(INK)),
  slippery: ({ country }) => warning(
    country, draw("g", { transform: "rotate(-8 50 50) translate(8 2) scale(.84)" }, car(INK, -12)), line("M30 84q8-10 0-20M58 84q8-10 0-20", INK, 5),
  ),
  deep_water: ({ country }) => warning(country, draw("g", { transform: "translate(10 0) scale(.8)" }, car(INK, -12)), wave(66), wave(80)),
  ice: ({ country }) => warning(
    country, ...[0, 60, 120].map((turn) => line("M50 26V86M42 32l8 8 8-8M42 80l8-8 8 8", INK, 5, { transform: `rotate(${turn} 50 56)` })),
  ),
  car_fault: () => sheet("#7a4a00", car(WHITE), letters("!", 50, 25, 24, 30, YELLOW)),
  unclear_sign: () => picture(disc(50, 50, 47, GREY), disc(50, 50, 36, WHITE), letters("?", 50, 50, 40, 40)),
  sign: () => sheet(BLUE, disc(50, 26, 7, WHITE), board(44, 40, 12, 40, 3, WHITE)),
  service_fault: () => sheet("#7a4a00", line("M50 22V44M30 30A28 28 0 1 0 70 30", WHITE, 9)),
  caution: ({ country }) => warning(country, letters("!", 50, 54, 46, 30)),
};

// The picture of a message; a face that is new to this page is drawn as caution.
export const face = (of) => (FACES[of.face] ?? FACES.caution)(of);
export const FACE_NAMES = Object.keys(FACES);

// What tells an urgency apart without colour: a circle, a square, a triangle, an octagon.
export const urgencyShape = (urgency) => ({
  info: () => picture(disc(50, 50, 44, "currentColor"), disc(50, 26, 7, "var(--on)"), board(44, 40, 12, 36, 3, "var(--on)")),
  advice: () => picture(board(8, 8, 84, 84, 12, "currentColor"), line("M28 52 44 68 74 34", "var(--on)", 11)),
  warning: () => picture(path("M50 6 98 92H2Z", "currentColor"), letters("!", 50, 64, 40, 30, "var(--on)")),
  alarm: () => picture(path("M30 2H70L98 30V70L70 98H30L2 70V30Z", "currentColor"), letters("!", 50, 50, 56, 40, "var(--on)")),
})[urgency]?.() ?? picture();

export const LAMPS = {
  fault: () => picture(path("M50 6 98 92H2Z", "currentColor"), letters("!", 50, 64, 40, 30, "var(--on)")),
  silence: () => picture(path("M14 38H32L56 18V82L32 62H14Z", "currentColor"), line("M68 38 90 62M90 38 68 62", "currentColor", 8)),
};
export const ICONS = {
  ask: () => picture(path("M12 14H88Q94 14 94 20V64Q94 70 88 70H50L28 90V70H12Q6 70 6 64V20Q6 14 12 14Z", "currentColor")),
  label: () => picture(path("M10 46H28V90H10ZM34 88V48L54 10Q66 12 62 28L58 42H86Q94 44 92 52L84 82Q82 90 74 90H40Z", "currentColor")),
  mute: LAMPS.silence,
  unmute: () => picture(path("M14 38H32L56 18V82L32 62H14Z", "currentColor"), line("M68 36q10 14 0 28M80 26q18 24 0 48", "currentColor", 8)),
  settings: () => picture(line("M12 26H88M12 50H88M12 74H88", "currentColor", 7), disc(34, 26, 11, "currentColor"), disc(66, 50, 11, "currentColor"), disc(34, 74, 11, "currentColor")),
};
