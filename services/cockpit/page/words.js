// All words of the page, in one table. What is advised comes from the system in the driver's language.
export const WORDS = {
  en: {
    noData: "No data", limitIs: "Limit {value} {unit}", assumed: "assumed", unknown: "Limit unknown", recommended: "recommended",
    advised: "Advised {value} {unit}", speedIs: "Speed {value} {unit}", noSpeed: "Speed unknown", over: "too fast",
    endSound: "touch: sound off", fault: "Fault: {what}", muted: "Sounds off",
    why: "Why?", ask: "Ask", label: "Feedback", mute: "Mute", unmute: "Sounds on", settings: "Settings", close: "Close",
    whyNot: "Nothing was said yet.", question: "Your question", send: "Send", listen: "Speak", listening: "Listening …",
    thinking: "One moment …", late: "Too late", wrong: "Not right", thanks: "Thanks", noted: "Noted for the last message.",
    changed: "Kept.", failed: "That did not work: {why}", language: "Language", unit: "Unit", converts: "Say limits in my unit",
    low: "Tolerance up to 60", high: "Tolerance above 60", theme: "Day or night", auto: "automatic", day: "day", night: "night",
    voice: "This page speaks", informs: "information", advises: "advice", warns: "warning", alarms: "alarm", ahead: "ahead",
  },
  de: {
    noData: "Keine Daten", limitIs: "Tempolimit {value} {unit}", assumed: "angenommen", unknown: "Tempolimit unbekannt",
    recommended: "empfohlen", advised: "Empfohlen {value} {unit}", speedIs: "Tempo {value} {unit}", noSpeed: "Tempo unbekannt",
    over: "zu schnell", endSound: "berühren: Ton aus", fault: "Störung: {what}", muted: "Ton aus",
    why: "Warum?", ask: "Fragen", label: "Rückmeldung", mute: "Stumm", unmute: "Ton an", settings: "Einstellungen",
    close: "Schließen", whyNot: "Noch wurde nichts gesagt.", question: "Ihre Frage", send: "Senden", listen: "Sprechen",
    listening: "Ich höre …", thinking: "Einen Moment …", late: "Zu spät", wrong: "Falsch", thanks: "Danke",
    noted: "Zur letzten Meldung vermerkt.", changed: "Gemerkt.", failed: "Das ging nicht: {why}", language: "Sprache",
    unit: "Einheit", converts: "Limits in meiner Einheit sagen", low: "Toleranz bis 60", high: "Toleranz über 60",
    theme: "Tag oder Nacht", auto: "automatisch", day: "Tag", night: "Nacht", voice: "Diese Seite spricht",
    informs: "Hinweis", advises: "Rat", warns: "Warnung", alarms: "Alarm", ahead: "voraus",
  },
  fr: {
    noData: "Pas de données", limitIs: "Limite {value} {unit}", assumed: "supposée", unknown: "Limite inconnue",
    recommended: "conseillée", advised: "Conseillé : {value} {unit}", speedIs: "Vitesse {value} {unit}",
    noSpeed: "Vitesse inconnue", over: "trop vite", endSound: "toucher : couper le son", fault: "Panne : {what}",
    muted: "Son coupé", why: "Raison ?", ask: "Demander", label: "Avis", mute: "Muet", unmute: "Son", settings: "Réglages",
    close: "Fermer", whyNot: "Rien n’a encore été dit.", question: "Votre question", send: "Envoyer", listen: "Parler",
    listening: "J’écoute …", thinking: "Un instant …", late: "Trop tard", wrong: "Faux", thanks: "Merci",
    noted: "Noté pour le dernier message.", changed: "Retenu.", failed: "Cela n’a pas marché : {why}", language: "Langue",
    unit: "Unité", converts: "Dire les limites dans mon unité", low: "Tolérance jusqu’à 60", high: "Tolérance au-delà de 60",
    theme: "Jour ou nuit", auto: "automatique", day: "jour", night: "nuit", voice: "Cette page parle",
    informs: "information", advises: "conseil", warns: "avertissement", alarms: "alarme", ahead: "devant",
  },
};

let language = "en";

export const setLanguage = (code) => {
  language = code in WORDS ? code : "en";
  document.documentElement.lang = language;
};
export const inUse = () => language;
export const say = (name, values = {}) =>
  WORDS[language][name].replace(/\{(\w+)\}/g, (_, key) => String(values[key] ?? ""));
