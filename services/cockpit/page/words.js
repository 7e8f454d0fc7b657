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
  nl: {
    noData: "Geen gegevens", limitIs: "Limiet {value} {unit}", assumed: "aangenomen", unknown: "Limiet onbekend",
    recommended: "aanbevolen", advised: "Aanbevolen {value} {unit}", speedIs: "Snelheid {value} {unit}",
    noSpeed: "Snelheid onbekend", over: "te snel", endSound: "aanraken: geluid uit", fault: "Storing: {what}",
    muted: "Geluid uit", why: "Reden?", ask: "Vragen", label: "Reactie", mute: "Stil", unmute: "Geluid", settings: "Opties",
    close: "Sluiten", whyNot: "Er is nog niets gezegd.", question: "Uw vraag", send: "Sturen", listen: "Spreken",
    listening: "Ik luister …", thinking: "Een ogenblik …", late: "Te laat", wrong: "Klopt niet", thanks: "Bedankt",
    noted: "Genoteerd bij de laatste melding.", changed: "Bewaard.", failed: "Dat lukte niet: {why}", language: "Taal",
    unit: "Eenheid", converts: "Limieten in mijn eenheid zeggen", low: "Tolerantie tot 60", high: "Tolerantie boven 60",
    theme: "Dag of nacht", auto: "automatisch", day: "dag", night: "nacht", voice: "Deze pagina spreekt",
    informs: "informatie", advises: "advies", warns: "waarschuwing", alarms: "alarm", ahead: "verderop",
  },
  pl: {
    noData: "Brak danych", limitIs: "Ograniczenie {value} {unit}", assumed: "przyjęte", unknown: "Ograniczenie nieznane",
    recommended: "zalecane", advised: "Zalecane {value} {unit}", speedIs: "Prędkość {value} {unit}",
    noSpeed: "Prędkość nieznana", over: "za szybko", endSound: "dotknij: wyłącz dźwięk", fault: "Usterka: {what}",
    muted: "Dźwięk wyłączony", why: "Czemu?", ask: "Pytaj", label: "Ocena", mute: "Cisza", unmute: "Dźwięk", settings: "Opcje",
    close: "Zamknij", whyNot: "Nic jeszcze nie powiedziano.", question: "Pytanie", send: "Wyślij", listen: "Mów",
    listening: "Słucham …", thinking: "Chwileczkę …", late: "Za późno", wrong: "Błędnie", thanks: "Dziękuję",
    noted: "Zapisano do ostatniego komunikatu.", changed: "Zapisano.", failed: "Nie udało się: {why}", language: "Język",
    unit: "Jednostka", converts: "Podawaj ograniczenia w mojej jednostce", low: "Tolerancja do 60", high: "Tolerancja powyżej 60",
    theme: "Dzień lub noc", auto: "automatycznie", day: "dzień", night: "noc", voice: "Ta strona mówi",
    informs: "informacja", advises: "rada", warns: "ostrzeżenie", alarms: "alarm", ahead: "dalej",
  },
  it: {
    noData: "Nessun dato", limitIs: "Limite {value} {unit}", assumed: "presunto", unknown: "Limite sconosciuto",
    recommended: "consigliata", advised: "Consigliati {value} {unit}", speedIs: "Velocità {value} {unit}",
    noSpeed: "Velocità sconosciuta", over: "troppo veloce", endSound: "tocca: audio spento", fault: "Guasto: {what}",
    muted: "Audio spento", why: "Motivo?", ask: "Chiedi", label: "Parere", mute: "Muto", unmute: "Audio", settings: "Opzioni",
    close: "Chiudi", whyNot: "Non è stato ancora detto nulla.", question: "La tua domanda", send: "Invia", listen: "Parla",
    listening: "Ascolto …", thinking: "Un momento …", late: "Troppo tardi", wrong: "Sbagliato", thanks: "Grazie",
    noted: "Annotato per l’ultimo messaggio.", changed: "Salvato.", failed: "Non è riuscito: {why}", language: "Lingua",
    unit: "Unità", converts: "Dire i limiti nella mia unità", low: "Tolleranza fino a 60", high: "Tolleranza oltre 60",
    theme: "Giorno o notte", auto: "automatico", day: "giorno", night: "notte", voice: "Questa pagina parla",
    informs: "informazione", advises: "consiglio", warns: "avviso", alarms: "allarme", ahead: "davanti",
  },
  es: {
    noData: "Sin datos", limitIs: "Límite {value} {unit}", assumed: "supuesto", unknown: "Límite desconocido",
    recommended: "aconsejada", advised: "Aconsejados {value} {unit}", speedIs: "Velocidad {value} {unit}",
    noSpeed: "Velocidad desconocida", over: "demasiado rápido", endSound: "tocar: quitar el sonido", fault: "Avería: {what}",
    muted: "Sin sonido", why: "Motivo", ask: "Preguntar", label: "Opinión", mute: "Callar", unmute: "Sonido",
    settings: "Ajustes", close: "Cerrar", whyNot: "Todavía no se ha dicho nada.", question: "Su pregunta", send: "Enviar",
    listen: "Hablar", listening: "Escucho …", thinking: "Un momento …", late: "Tarde", wrong: "No es así", thanks: "Gracias",
    noted: "Anotado para el último mensaje.", changed: "Guardado.", failed: "No ha funcionado: {why}", language: "Idioma",
    unit: "Unidad", converts: "Decir los límites en mi unidad", low: "Tolerancia hasta 60", high: "Tolerancia por encima de 60",
    theme: "Día o noche", auto: "automático", day: "día", night: "noche", voice: "Esta página habla",
    informs: "información", advises: "consejo", warns: "aviso", alarms: "alarma", ahead: "delante",
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
