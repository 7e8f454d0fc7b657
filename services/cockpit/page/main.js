// Shows what the stream brings, at once, and that it brings nothing any more.
import { inUnit, speedRing } from "./ring.js";
import { bind, callTool, label } from "./sheets.js";
import { ICONS, LAMPS, crossedOut, face, limitSign, urgencyShape } from "./signs.js";
import { speak, tone } from "./speech.js";
import { inUse, say, setLanguage } from "./words.js";

const STALE_MS = 900, LOOK_MS = 100, SOUND_PERIOD_MS = 1000, OWED_MS = 4500;
const SHOWN_MS = { info: 8000, advice: 8000, warning: 8000, alarm: 6000 };
const URGENCY = { info: "informs", advice: "advises", warning: "warns", alarm: "alarms" };
const find = (id) => document.getElementById(id);
const state = { speed: null, told: null, toldAt: -Infinity, missing: [], unit: "km/h", chosen: "", cameAt: -Infinity, soundedAt: -Infinity, aloudAt: -Infinity, stale: true };
const drawn = new Map();

// Draws a part only when what it shows has changed.
const once = (part, of, make) => {
  const key = JSON.stringify([inUse(), of]);
  if (drawn.get(part) === key) return;
  drawn.set(part, key);
  make();
};

// A recommended speed in steps that can be driven: of 5, rounded down; below 20 as it is.
const inSteps = (value) => { const whole = Math.floor(value + 1e-6); return whole < 20 ? whole : whole - (whole % 5); };

const sign = () => {
  const speed = state.speed;
  const known = speed?.known ?? "unknown", limit = speed?.limit ?? null, country = speed?.country ?? "";
  once("sign", [known, limit, country, speed?.plate, state.stale, state.unit], () => {
    const made = limitSign(limit, country, known);
    find("sign").replaceChildren(state.stale && known !== "unknown" ? crossedOut(made) : made);
    const words = limit && known !== "unknown" ? say("limitIs", { value: Math.round(limit.value), unit: limit.unit }) : say("unknown");
    const more = [known === "assumed" ? say("assumed") : "", limit?.advisory ? say("recommended") : "", speed?.plate, state.stale ? say("noData") : ""];
    find("sign").setAttribute("aria-label", [words, ...more].filter(Boolean).join(", "));
    find("sign").dataset.known = known;
    find("sign").dataset.value = limit ? String(limit.value) : "";
    find("plate").textContent = speed?.plate ?? "";
    find("sign-unit").textContent = limit && known !== "unknown" && limit.unit !== state.unit ? limit.unit : "";
  });
  const target = speed?.target_mps ?? null;
  const below = target !== null && (limit === null || target < limit.mps - 0.5);
  const advised = below ? inSteps(inUnit(target, limit?.unit ?? state.unit)) : "";
  once("advised", [advised, state.stale], () => {
    find("advised").textContent = String(advised);
    find("advised").setAttribute("aria-label", advised === "" ? "" : say("advised", { value: advised, unit: limit?.unit ?? state.unit }));
  });
};

const ring = () => {
  const speed = state.speed;
  const of = {
    speed: state.stale ? null : speed?.speed_mps ?? null, limit: speed?.known === "known" ? speed.limit.mps : null,
    target: speed?.target_mps ?? null, unit: state.unit, warning: state.stale ? "none" : speed?.warning ?? "none",
  };
  once("ring", { ...of, speed: of.speed === null ? null : Math.round(inUnit(of.speed, of.unit)) }, () => {
    const { made, shown } = speedRing(of);
    const button = find("speed");
    button.replaceChildren(made);
    button.dataset.warning = of.warning;
    button.disabled = of.warning !== "sounded";
    const words = [shown === null ? say("noSpeed") : say("speedIs", { value: shown, unit: of.unit })];
    if (of.warning !== "none") words.push(say("over"));
    if (of.warning === "sounded") words.push(say("endSound"));
    button.setAttribute("aria-label", words.join(", "));
  });
};

const advice = () => {
  const told = performance.now() - state.toldAt < (SHOWN_MS[state.told?.urgency] ?? 0) ? state.told : null;
  once("advice", told && [told.tick, told.directive, told.urgency], () => {
    find("advice").dataset.urgency = told ? told.urgency : "none";
    find("words").textContent = told ? told.directive : "";
    find("words").lang = told ? told.language : inUse();
    find("picture").replaceChildren(...(told?.picture ? [face(told.picture)] : []));
    find("picture").dataset.face = told?.picture?.face ?? "";
    find("shape").replaceChildren(...(told ? [urgencyShape(told.urgency)] : []));
    const grave = told?.urgency === "alarm";
    find("alarm").textContent = grave ? told.directive : "";
    find("said").textContent = told && !grave ? `${say(URGENCY[told.urgency])}: ${told.directive}` : "";
  });
};

const lamps = () => {
  const what = [...new Set([...state.missing, ...(state.speed?.fault ? [state.speed.fault] : [])])];
  const muted = Boolean(state.speed?.muted);
  once("lamps", [what, muted, state.stale], () => {
    find("fault").hidden = what.length === 0;
    find("fault").replaceChildren(LAMPS.fault());
    find("fault").setAttribute("aria-label", say("fault", { what: what.join(", ") }));
    find("fault").title = what.join(", ");
    find("silence").hidden = !muted;
    find("silence").replaceChildren(LAMPS.silence());
    find("silence").setAttribute("aria-label", say("muted"));
    find("stale").hidden = !state.stale;
    find("stale").textContent = say("noData");
    find("mute").replaceChildren(muted ? ICONS.unmute() : ICONS.mute());
    find("mute").setAttribute("aria-label", say(muted ? "unmute" : "mute"));
    find("mute").setAttribute("aria-pressed", String(muted));
    find("cockpit").dataset.state = state.stale ? "stale" : "live";
  });
};

const show = () => {
  state.stale = performance.now() - state.cameAt > STALE_MS;
  sign();
  ring();
  advice();
  lamps();
};
const relabel = () => { label(); show(); };

const onSpeed = (speed) => {
  const now = performance.now();
  const sounds = speed.warning === "sounded" && !speed.muted;
  state.speed = speed;
  state.cameAt = now;
  show();
  if (!sounds) state.soundedAt = -Infinity;
  else if (now - state.soundedAt >= SOUND_PERIOD_MS) {
    state.soundedAt = now;
    tone("warning");
  }
};
const onAdvisory = (advisory) => {
  state.cameAt = performance.now();
  state.unit = advisory.unit;
  if (state.chosen === advisory.language) state.chosen = "";
  if (!state.chosen && advisory.language !== inUse()) { setLanguage(advisory.language); label(); }
  if (advisory.kind !== "SILENT" && advisory.directive) {
    const goesOn = !advisory.spoken && state.told?.directive === advisory.directive;
    state.told = goesOn ? { ...advisory, tick: state.told.tick } : advisory;  // not announced anew to a reader of screens
    state.toldAt = performance.now();
  }
  show();
  // A page that came late, or whose voice was off, has not said the words of an intervention that goes on.
  const owed = advisory.kind === "ACT" && performance.now() - state.aloudAt > OWED_MS;
  if (advisory.spoken || owed) state.aloudAt = speak(advisory) ? performance.now() : -Infinity;
};

const follow = () => {
  const stream = new EventSource("/events");
  stream.addEventListener("speed", (event) => onSpeed(JSON.parse(event.data)));
  stream.addEventListener("advisory", (event) => onAdvisory(JSON.parse(event.data)));
  stream.addEventListener("health", (event) => { state.missing = JSON.parse(event.data).missing; show(); });
  // A stream that was refused is closed by the browser for good: begin again.
  stream.onerror = () => { if (stream.readyState === EventSource.CLOSED) { stream.close(); setTimeout(follow, 1000); } };
};

setLanguage(navigator.language.slice(0, 2));
bind(state, relabel);
find("speed").onclick = () => callTool("acknowledge");
relabel();
setInterval(show, LOOK_MS);
follow();
