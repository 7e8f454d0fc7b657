// The page's voice: off until a touch switches it on, since browsers let no page speak before one.
const TONES = { warning: [2, 880, 0.1, 0.1, 0.35], alarm: [4, 1480, 0.06, 0.04, 0.6] };
const PROSODY = { info: [1, 0.9, 0.8], advice: [1, 1, 0.85], warning: [1.05, 1.15, 1], alarm: [1.15, 1.4, 1] };
const STALE_MS = 2000;
const KEY = "drivemcp-voice";

let sound = null;
let waiting = 0;
export const available = () => "speechSynthesis" in window;
export const isOn = () => localStorage.getItem(KEY) === "on";
export const switchOn = (on) => {
  localStorage.setItem(KEY, on ? "on" : "off");
  if (on) wake();
  else if (available()) speechSynthesis.cancel();
};
const wake = () => {
  sound ??= "AudioContext" in window ? new AudioContext() : null;
  sound?.resume();
};
addEventListener("pointerdown", () => { if (isOn()) wake(); }, { passive: true });

// Seconds that the tone takes.
export const tone = (urgency) => {
  const form = TONES[urgency];
  if (!form || !isOn() || sound?.state !== "running") return 0;
  const [pulses, hz, pulse, gap, loudness] = form;
  for (let at = 0; at < pulses; at += 1) {
    const begins = sound.currentTime + at * (pulse + gap);
    const wave = new OscillatorNode(sound, { frequency: hz });
    const volume = new GainNode(sound, { gain: 0 });
    volume.gain.setValueAtTime(0, begins);
    volume.gain.linearRampToValueAtTime(loudness, begins + 0.008);
    volume.gain.setValueAtTime(loudness, begins + pulse - 0.008);
    volume.gain.linearRampToValueAtTime(0, begins + pulse);
    wave.connect(volume).connect(sound.destination);
    wave.start(begins);
    wave.stop(begins + pulse);
  }
  return pulses * (pulse + gap);
};

export const speak = ({ directive, urgency, language }) => {
  if (!isOn() || !available() || !directive) return false;
  if (urgency === "alarm") speechSynthesis.cancel();
  const said = new SpeechSynthesisUtterance(directive);
  said.lang = language;
  said.voice = speechSynthesis.getVoices().find((each) => each.lang.toLowerCase().startsWith(language)) ?? null;
  [said.rate, said.pitch, said.volume] = PROSODY[urgency];
  const asked = performance.now();
  const begin = () => {
    if (performance.now() - asked > STALE_MS || mine < waiting) return;
    if (speechSynthesis.speaking && urgency !== "alarm") setTimeout(begin, 100);
    else speechSynthesis.speak(said);
  };
  const mine = (waiting += 1);
  setTimeout(begin, 1000 * tone(urgency));
  return true;
};
