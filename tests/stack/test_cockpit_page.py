"""The cockpit's page in a real browser, on a real session: what it shows, how soon it says that it knows nothing, how it reads."""

import statistics
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal, get_args

import msgspec
import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ToolFailed
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from proto import topics
from proto.decision import Advisory, Language
from proto.rules import Citation
from proto.speed_assistance import Face, Picture, SpeedAssistance
from services.cockpit.service import SERVICE
from tests.browser import chromium, needs_chromium
from tests.unit.services.cockpit.messages import SILENT, assistance, told

pytestmark = [pytest.mark.stack, needs_chromium]
SMALL, LARGE = (360, 640), (1280, 800)
CITED = Citation(document="StVO", start=0, end=4, excerpt="bei Nässe", section="Anlage 2")


class Orchestrator:
    """Publishes ten times a second what it was told last, and answers the driver's touches."""

    def __init__(self) -> None:
        self.speed: SpeedAssistance | None = assistance(50)
        self.preferences: dict[str, Any] = {"language": "en", "unit": "km/h", "muted": False, "converts": False}
        self.acknowledged = 0
        self.node: Node | None = None
        self.tick = 0

    def build(self, config: ServiceConfig, node: Node) -> None:
        """Offer the tools."""
        self.node = node

        @node.tool(deadline_ms=500)
        def ask(question: str, language: str | None = None) -> dict[str, Any]:
            """Answer."""
            return {"text": f"{language}: {question}", "citations": [msgspec.to_builtins(CITED)]}

        @node.tool(deadline_ms=200, read_only=False)
        def feedback(label: Literal["late_warning", "false_positive", "helpful"], tick: int = 0) -> dict[str, Any]:
            """A label."""
            if label == "helpful":
                raise ToolFailed("one label every 10 s counts")
            return {"tick": tick, "says": f"warns 0.2 s earlier from now on ({label})"}

        @node.tool(deadline_ms=200, read_only=False)
        def set_preferences(
            language: Language | None = None,
            unit: Literal["km/h", "mph"] | None = None,
            muted: bool | None = None,
            converts: bool | None = None,
            tolerance_low: Annotated[float, msgspec.Meta(ge=0, le=10)] | None = None,
            tolerance_high: Annotated[float, msgspec.Meta(ge=0, le=10)] | None = None,
        ) -> dict[str, Any]:
            """Keep."""
            given = {"language": language, "unit": unit, "muted": muted, "converts": converts,
                     "tolerance_low": tolerance_low, "tolerance_high": tolerance_high}  # fmt: skip
            self.preferences |= {name: value for name, value in given.items() if value is not None}
            return self.preferences

        @node.tool(deadline_ms=200, read_only=False)
        def acknowledge() -> dict[str, bool]:
            """End the sound."""
            self.acknowledged += 1
            return {"ended": True}

    def publish(self) -> None:
        """One tick."""
        self.tick += 1
        if self.speed is not None and self.node is not None:
            muted = self.preferences["muted"]
            self.node.publish(topics.SPEED_ASSISTANCE, msgspec.structs.replace(self.speed, tick=self.tick, muted=muted))
            self.say(SILENT)

    def say(self, advisory: Advisory) -> None:
        """An advisory in the driver's language and unit."""
        assert self.node is not None
        kept = {"language": self.preferences["language"], "unit": self.preferences["unit"]}
        self.node.publish(topics.ADVISORY, msgspec.structs.replace(advisory, tick=self.tick, **kept))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """One browser for all tests."""
    with chromium() as found:
        yield found


@pytest.fixture
def drive() -> Iterator[tuple[Orchestrator, str]]:
    """A cockpit beside an orchestrator that ticks; the page's address."""
    with bus() as b:
        orchestrator, stop = Orchestrator(), threading.Event()
        b.start(Service("orchestrator", ServiceConfig, orchestrator.build))
        node = b.start(SERVICE)
        assert wait_settled(lambda: "acknowledge" in node.catalogue(), 5.0)

        def work() -> None:
            while not stop.wait(0.1):
                orchestrator.publish()

        thread = threading.Thread(target=work)
        thread.start()
        yield orchestrator, node.detail["page"]
        stop.set()
        thread.join(5.0)


@pytest.fixture
def open_page(browser: Any, drive: tuple[Orchestrator, str]) -> Iterator[Callable[..., Any]]:
    """Opens the page; an error in its scripts, or what its policy refuses, fails the test."""
    pages: list[Any] = []
    wrong: list[str] = []

    def begin(size: tuple[int, int] = SMALL, **options: Any) -> Any:
        page = browser.new_page(viewport={"width": size[0], "height": size[1]}, **{"locale": "en-GB", **options})
        pages.append(page)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
        page.goto(drive[1])
        expect(page, "#cockpit[data-state=live]")
        return page

    yield begin
    for page in pages:
        page.close()
    assert not [each for each in wrong if "net::ERR" not in each]


def expect(page: Any, selector: str) -> Any:
    """An element that is there within 10 s."""
    return page.wait_for_selector(selector, state="attached", timeout=10_000)


def until(page: Any, true: str) -> None:
    """Until an expression is true; the page's own policy forbids the browser driver's wait, which evaluates text."""
    assert wait_settled(lambda: bool(page.evaluate(true)), 10.0), true


def test_a_limit_that_changes_is_a_sign_that_changes(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page()
    expect(page, "#sign[data-value='50'][data-known=known]")
    drive[0].speed = assistance(70, plate="when wet", target_mps=62 / 3.6)
    expect(page, "#sign[data-value='70']")
    assert page.text_content("#plate") == "when wet"
    assert page.text_content("#sign-unit") == ""
    assert page.text_content("#advised") == "60"
    assert page.get_attribute("#sign", "aria-label") == "Limit 70 km/h, when wet"
    assert page.query_selector("#speed .target") is not None
    drive[0].speed = assistance(30, "mph", assumed=True, country="GBR")
    expect(page, "#sign[data-value='30'][data-known=assumed]")
    assert "?" in page.text_content("#sign")
    assert page.text_content("#sign-unit") == "mph", "the driver's unit is another"
    drive[0].speed = assistance(None)
    expect(page, "#sign[data-known=unknown] .crossed")
    drive[0].speed = assistance(65, "mph", country="USA")
    expect(page, "#sign[data-value='65'] rect")
    assert "SPEED" in page.text_content("#sign")


def test_a_page_without_events_says_so_within_a_second_and_comes_back(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page()
    watched = """new Promise((done) => { let last = performance.now();
      new EventSource('/events').addEventListener('speed', () => { last = performance.now(); });
      const look = () => document.querySelector('#cockpit').dataset.state === 'stale'
        ? done(performance.now() - last) : setTimeout(look, 5);
      look(); })"""
    page.evaluate(f"window.silence = {watched}; 0")
    page.wait_for_timeout(300)
    kept, drive[0].speed = drive[0].speed, None
    expect(page, "#cockpit[data-state=stale]")
    assert page.text_content("#stale") == "No data"
    assert page.query_selector("#sign .crossed") is not None
    assert "No data" in page.get_attribute("#sign", "aria-label")
    assert page.evaluate("window.silence") > 500, "one event that is late is not silence"
    drive[0].speed = kept
    expect(page, "#cockpit[data-state=live]")
    assert page.query_selector("#sign .crossed") is None


def test_an_alarm_is_told_by_colour_shape_and_to_a_reader_of_screens(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page(LARGE)
    shapes = {}
    pictures: tuple[tuple[str, Face], ...] = (
        ("info", "border"),
        ("advice", "give_way"),
        ("warning", "deep_water"),
        ("alarm", "person"),
    )
    for urgency, face in pictures:
        drive[0].say(told(f"It is {urgency}", urgency, picture=Picture(face=face, country="DEU")))
        expect(page, f"#advice[data-urgency={urgency}] #picture[data-face={face}] svg")
        assert page.text_content("#words") == f"It is {urgency}"
        shapes[urgency] = page.inner_html("#shape")
        assert page.text_content("#alarm") == ("It is alarm" if urgency == "alarm" else "")
        assert (page.text_content("#said") != "") == (urgency != "alarm")
    assert len(set(shapes.values())) == 4


def test_every_picture_of_the_closed_list_is_drawn(open_page: Callable[..., Any]) -> None:
    page = open_page()
    drawn = page.evaluate("import('/page/signs.js').then((signs) => signs.FACE_NAMES)")
    assert set(drawn) == set(Face.__args__)  # type: ignore[attr-defined]


def test_why_tells_the_reasons_and_what_they_rest_on(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page()
    page.click("#why")
    assert page.text_content("#why-words") == "Nothing was said yet."
    page.click("#why-sheet .close")
    drive[0].say(told("70 when wet", citations=(CITED,)))
    expect(page, "#advice[data-urgency=advice]")
    page.click("#why")
    assert page.text_content("#why-words") == "70 when wet. The sign says so."
    assert page.text_content("#why-citations li") == "StVO · Anlage 2 · “bei Nässe”"
    page.keyboard.press("Escape")
    assert page.evaluate("document.activeElement.id") == "why"


def test_a_question_is_answered_and_a_label_says_what_it_changed_or_why_it_does_not_count(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page()
    page.click("#ask")
    page.fill("#question", "Why 70?")
    page.click("#send")
    until(page, "document.querySelector('#answer').textContent === 'en: Why 70?'")
    assert page.query_selector("#answer-citations li") is not None
    page.click("#ask-sheet .close")
    page.click("#label")
    page.click("[data-label=late_warning]")
    until(page, "document.querySelector('#label-answer').textContent.includes('0.2 s earlier')")
    page.click("[data-label=helpful]")
    until(page, "document.querySelector('#label-answer').textContent.includes('one label every 10 s')")


def test_a_touch_ends_the_sound_of_an_overspeed_and_mutes(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str]
) -> None:
    page = open_page()
    assert page.is_disabled("#speed")
    drive[0].speed = assistance(50, speed_mps=63 / 3.6, warning="sounded", excess_mps=3.6)
    expect(page, "#speed[data-warning=sounded] .over")
    page.click("#speed")
    assert wait_settled(lambda: drive[0].acknowledged == 1, 5.0)
    page.click("#mute")
    expect(page, "#mute[aria-pressed=true]")
    expect(page, "#silence:not([hidden])")
    page.click("#mute")
    expect(page, "#mute[aria-pressed=false]")
    drive[0].speed = assistance(50, fault="tracks")
    expect(page, "#fault[aria-label='Fault: tracks']:not([hidden])")


@pytest.mark.parametrize(
    ("language", "why"),
    [("de", "Warum?"), ("fr", "Raison ?"), ("nl", "Reden?"), ("pl", "Czemu?"), ("it", "Motivo?"), ("es", "Motivo")],
)
def test_language_unit_and_tolerance_are_set_on_the_page(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str], language: str, why: str
) -> None:
    page = open_page()
    page.click("#settings")
    page.select_option("#language", language)
    until(page, f"document.querySelector('#why').textContent === '{why}'")
    page.select_option("#unit", "mph")
    page.fill("#tolerance_low", "3")
    page.press("#tolerance_low", "Tab")
    wanted = {"language": language, "unit": "mph", "tolerance_low": 3.0}
    assert wait_settled(lambda: wanted.items() <= drive[0].preferences.items(), 5.0), drive[0].preferences
    page.click("#settings-sheet .close")
    assert page.get_attribute("html", "lang") == language
    until(page, "document.querySelector('#speed').textContent.includes('mph')")
    page.reload()
    until(page, f"document.querySelector('#why').textContent === '{why}'")


def test_the_page_speaks_what_was_decided_once_a_touch_has_switched_it_on(
    browser: Any, drive: tuple[Orchestrator, str]
) -> None:
    page = browser.new_page(locale="en-GB")
    page.add_init_script(
        """window.heard = [];
        speechSynthesis.speak = (said) => window.heard.push(`${said.lang} ${said.text} ${said.rate}`);
        speechSynthesis.cancel = () => window.heard.push('cut');"""
    )
    page.goto(drive[1])
    expect(page, "#cockpit[data-state=live]")
    drive[0].say(told("Not heard"))
    until(page, "document.querySelector('#words').textContent === 'Not heard'")
    assert page.evaluate("window.heard") == []
    page.click("#settings")
    page.check("#voice")
    page.click("#settings-sheet .close")
    drive[0].say(told("70 when wet"))
    until(page, "window.heard.length === 1")
    drive[0].say(told("Brake!", "alarm"))
    until(page, "window.heard.length === 3")
    assert page.evaluate("window.heard") == ["en 70 when wet 1", "cut", "en Brake! 1.149999976158142"]
    page.evaluate(
        """window.alarms = 0;
        new MutationObserver(() => { window.alarms += 1; }).observe(document.querySelector('#alarm'), { childList: true });"""
    )
    for hazard in ("pedestrian", "held"):
        for _ in range(6):
            drive[0].tick += 1
            drive[0].say(told(f"It is {hazard}", "alarm", kind="ACT", hazard=hazard))
        until(page, f"window.heard.at(-1).includes('It is {hazard}')")
    loud = "1.149999976158142"
    assert page.evaluate("window.heard")[3:] == ["cut", f"en It is pedestrian {loud}", "cut", f"en It is held {loud}"]
    assert page.evaluate("window.alarms") == 2, "a reader of screens is told of each once"
    page.click("#settings")
    page.uncheck("#voice")
    drive[0].say(told("It is late", "alarm", kind="ACT", hazard="closing_lead"))
    page.check("#voice")
    drive[0].say(told("It is late", "alarm", kind="ACT", hazard="closing_lead"))
    until(page, "window.heard.at(-1).includes('It is late')")
    page.close()


def test_the_table_of_words_is_whole(open_page: Callable[..., Any]) -> None:
    page = open_page()
    words = page.evaluate("import('/page/words.js').then((words) => words.WORDS)")
    assert set(words) == set(Language.__args__)  # type: ignore[attr-defined]
    for table in words.values():
        assert table.keys() == words["en"].keys()
        assert all(table.values())
    for name, text in words["en"].items():
        assert all(("{" in table[name]) == ("{" in text) for table in words.values()), name


def test_day_and_night_follow_the_device_or_the_switch(open_page: Callable[..., Any]) -> None:
    def ground(page: Any) -> int:
        return int(page.evaluate("getComputedStyle(document.body).backgroundColor").strip("rgb()").split(",")[0])

    day, night = open_page(color_scheme="light"), open_page(color_scheme="dark")
    assert ground(day) > 200
    assert ground(night) < 40
    day.click("#settings")
    day.select_option("#theme", "night")
    assert ground(day) < 40
    day.reload()
    assert ground(day) < 40


@pytest.mark.parametrize("size", [SMALL, LARGE, (640, 360)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_off_touch_targets_are_wide_and_axe_finds_nothing(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str], size: tuple[int, int], scheme: str
) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    for language in get_args(Language):
        drive[0].preferences["language"] = language
        page = open_page(size, color_scheme=scheme)
        until(page, f"document.documentElement.lang === '{language}'")
        for urgency in ("info", "advice", "warning", "alarm"):
            drive[0].speed = assistance(70, "mph", plate="when wet", target_mps=60 / 3.6, warning="sounded")
            drive[0].say(told("Hold the distance", urgency, picture=Picture(face="vehicle", country="DEU")))
            expect(page, f"#advice[data-urgency={urgency}]")
            found = axe.Axe().run(page)
            assert found.violations_count == 0, found.generate_report()
            cut = page.evaluate(
                """[['#limit', '#plate'], ['#limit', '#sign-unit'],
                 ['#advice', '#words'], ['#touch', '#why'], ['body', '#touch'], ['#lamps', '#fault']]
                .filter(([around, inside]) => {
                  const [a, b] = [around, inside].map((each) => document.querySelector(each).getBoundingClientRect());
                  const wide = document.querySelector(inside);
                  return b.height > 0 && (b.left < a.left - 1 || b.right > a.right + 1 || b.top < a.top - 1 || b.bottom > a.bottom + 1
                    || wide.scrollWidth > wide.clientWidth + 1);
                }).map(([, inside]) => inside)"""
            )
            assert cut == [], language
        for name in ("why", "ask", "label", "settings"):
            page.click(f"#{name}")
            found = axe.Axe().run(page)
            assert found.violations_count == 0, found.generate_report()
            narrow = page.evaluate(
                """[...document.querySelectorAll('button, select, input')].filter((each) => each.offsetParent)
                .filter((each) => each.offsetWidth < 44 || each.offsetHeight < 44).map((each) => each.id)"""
            )
            assert narrow == []
            page.keyboard.press("Escape")
        page.close()


def test_the_time_from_an_advisory_to_the_glass_is_told(
    open_page: Callable[..., Any], drive: tuple[Orchestrator, str], capsys: pytest.CaptureFixture[str]
) -> None:
    page = open_page()
    page.evaluate(
        """window.seen = {}; new MutationObserver(() => {
          const words = document.querySelector('#words').textContent;
          window.seen[words] ??= performance.timeOrigin + performance.now();
        }).observe(document.querySelector('#words'), { childList: true, characterData: true, subtree: true }); 0"""
    )
    sent: dict[str, float] = {}
    for number in range(40):
        words = f"Message {number}"
        sent[words] = time.time() * 1e3
        drive[0].say(told(words))
        until(page, f"window.seen[{words!r}] !== undefined")
    seen = page.evaluate("window.seen")
    delays = [seen[words] - at for words, at in sent.items() if words in seen]
    assert len(delays) == len(sent), "each was shown"
    with capsys.disabled():
        sys.stdout.write(
            f"\n  advisory to glass: median {statistics.median(delays):.1f} ms, most {max(delays):.1f} ms\n"
        )
