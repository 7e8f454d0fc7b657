// What one touch opens: why, ask, feedback, settings. Each answer is told in words, and a failure too.
import { ICONS } from "./signs.js";
import { available, isOn, speak, switchOn } from "./speech.js";
import { inUse, say, setLanguage } from "./words.js";

const find = (id) => document.getElementById(id);

export const callTool = async (name, given = {}) => {
  try {
    const answer = await fetch(`/tool/${name}`, {
      method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(given),
    });
    return answer.ok ? await answer.json() : { ok: false, result: null, error: String(answer.status) };
  } catch (error) {
    return { ok: false, result: null, error: String(error.message) };
  }
};
const failed = (answer) => say("failed", { why: answer.error });

const list = (place, citations) => place.replaceChildren(...(citations ?? []).map((each) => {
  const item = document.createElement("li");
  item.textContent = [each.document, each.section, `“${each.excerpt}”`].filter(Boolean).join(" · ");
  return item;
}));

const showWhy = ({ told, speed, missing }) => {
  const fault = [...missing, ...(speed?.fault ? [speed.fault] : [])].join(", ");
  const words = told ? `${told.directive}. ${told.justification}`.replace(/([.!?])\./, "$1") : say("whyNot");
  find("why-words").textContent = [words, fault && say("fault", { what: fault })].filter(Boolean).join(" ");
  list(find("why-citations"), told?.citations);
  find("why-sheet").showModal();
};

let spoken = false;
const ask = async (event) => {
  event.preventDefault();
  find("answer").textContent = say("thinking");
  list(find("answer-citations"), []);
  const answer = await callTool("ask", { question: find("question").value, language: inUse() });
  find("answer").textContent = answer.ok ? answer.result.text : failed(answer);
  list(find("answer-citations"), answer.ok ? answer.result.citations : []);
  if (answer.ok && spoken) speak({ directive: answer.result.text, urgency: "info", language: answer.result.language ?? inUse() });
  spoken = false;
};

const listening = () => {
  const Recognition = window.SpeechRecognition ?? window.webkitSpeechRecognition;
  if (!Recognition) return;
  find("listen").hidden = false;
  find("listen").onclick = () => {
    const ear = new Recognition();
    ear.lang = inUse();
    find("answer").textContent = say("listening");
    ear.onresult = (event) => {
      spoken = true;
      find("question").value = event.results[0][0].transcript;
      find("ask-form").requestSubmit();
    };
    ear.onerror = (event) => { find("answer").textContent = say("failed", { why: event.error }); };
    ear.start();
  };
};

const giveLabel = async (label, tick) => {
  const answer = await callTool("feedback", { label, tick });
  const words = answer.ok ? Object.values(answer.result).filter((each) => typeof each === "string" && each) : [];
  find("label-answer").textContent = answer.ok ? words.join(" ") || say("noted") : failed(answer);
};

const showPreferences = (kept) => {
  for (const name of ["language", "unit", "tolerance_low", "tolerance_high"]) {
    if (name in kept) find(name).value = String(kept[name]);
  }
  if ("converts" in kept) find("converts").checked = kept.converts;
};
const prefer = async (fields) => {
  const answer = await callTool("set_preferences", fields);
  find("settings-answer").textContent = answer.ok ? say("changed") : failed(answer);
  if (answer.ok) showPreferences(answer.result);
  return answer;
};

export const theme = (chosen) => {
  const root = document.documentElement;
  if (chosen === "auto") delete root.dataset.theme;
  else root.dataset.theme = chosen;
  const night = chosen === "night" || (chosen === "auto" && matchMedia("(prefers-color-scheme: dark)").matches);
  root.toggleAttribute("data-night", night);
};

export const label = () => {
  for (const [id, name] of [
    ["why-title", "why"], ["ask-title", "ask"], ["label-title", "label"], ["settings-title", "settings"], ["why", "why"],
    ["send", "send"], ["listen", "listen"],
  ]) find(id).textContent = say(name);
  for (const [id, name] of [
    ["question", "question"], ["language", "language"], ["unit", "unit"], ["converts", "converts"], ["tolerance_low", "low"],
    ["tolerance_high", "high"], ["theme", "theme"], ["voice", "voice"],
  ]) document.querySelector(`label[for="${id}"]`).textContent = say(name);
  for (const id of ["ask", "label", "settings"]) {
    find(id).setAttribute("aria-label", say(id));
    find(id).title = say(id);
    if (!find(id).firstChild) find(id).append(ICONS[id]());
  }
  for (const each of document.querySelectorAll(".close")) each.textContent = say("close");
  for (const [value, name] of [["late_warning", "late"], ["false_positive", "wrong"], ["helpful", "thanks"]]) {
    document.querySelector(`[data-label="${value}"]`).textContent = say(name);
  }
  for (const each of find("theme").options) each.textContent = say(each.value);
};

export const bind = (state, changed) => {
  const kept = localStorage.getItem("drivemcp-theme") ?? "auto";
  find("theme").value = kept;
  theme(kept);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme(find("theme").value));
  find("theme").onchange = () => { localStorage.setItem("drivemcp-theme", find("theme").value); theme(find("theme").value); };
  find("voice").checked = isOn();
  find("voice").disabled = !available();
  find("voice").onchange = () => switchOn(find("voice").checked);
  find("why").onclick = () => showWhy(state);
  find("ask").onclick = () => { find("answer").textContent = ""; list(find("answer-citations"), []); find("ask-sheet").showModal(); };
  find("ask-form").onsubmit = ask;
  find("label").onclick = () => { find("label-answer").textContent = ""; find("label-sheet").showModal(); };
  for (const each of document.querySelectorAll("[data-label]")) {
    each.onclick = () => giveLabel(each.dataset.label, state.told?.tick ?? 0);
  }
  find("mute").onclick = () => callTool("set_preferences", { muted: !state.speed?.muted });
  find("settings").onclick = async () => {
    find("settings-answer").textContent = "";
    find("language").value = inUse();
    find("unit").value = state.unit;
    find("settings-sheet").showModal();
    const answer = await callTool("set_preferences");
    if (answer.ok) showPreferences(answer.result);
  };
  find("language").onchange = async () => {
    setLanguage(find("language").value);
    state.chosen = inUse();
    changed();
    await prefer({ language: inUse() });
  };
  find("unit").onchange = () => { state.unit = find("unit").value; changed(); prefer({ unit: state.unit }); };
  find("converts").onchange = () => prefer({ converts: find("converts").checked });
  for (const id of ["tolerance_low", "tolerance_high"]) {
    find(id).onchange = () => { if (find(id).reportValidity()) prefer({ [id]: Number(find(id).value) }); };
  }
  find("settings-form").onsubmit = (event) => event.preventDefault();
  for (const each of document.querySelectorAll("dialog .close")) each.onclick = () => each.closest("dialog").close();
  listening();
};
