"""Pages in Chromium: every number, on a phone and on paper."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

import hertzchain as hc
from hertzchain.report.contents import of_comparison
from hertzchain.report.page import write_page
from tests.conftest import chromium
from tests.report.test_page import HOSTILE

pytestmark = pytest.mark.chromium

CHROMIUM = [
    *("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        chrome = playwright.chromium.launch(executable_path=chromium(), args=CHROMIUM)
        yield chrome
        chrome.close()


@pytest.fixture(scope="module")
def opened(
    browser: Browser, compared: hc.Comparison, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Page, list[str]]]:
    """The page of the comparison without a network, and all that went wrong."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    write_page(of_comparison(compared), path, HOSTILE)
    context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True)
    wrong: list[str] = []
    page = context.new_page()
    page.on("console", lambda message: wrong.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("dialog", lambda dialog: wrong.append(dialog.message))
    page.on(
        "request",
        lambda asked: None if asked.url.startswith(("file:", "data:")) else wrong.append(asked.url),
    )
    page.goto(path.as_uri())
    yield page, wrong
    context.close()


def test_a_browser_shows_every_number(
    opened: tuple[Page, list[str]], compared: hc.Comparison
) -> None:
    page, wrong = opened
    assert page.locator(".plot svg").is_visible()
    assert page.locator(".plot").get_by_text("peak force [N]").is_visible()
    contact = [entry["contact"] for entry in compared.rows]
    cells = page.locator("section:has(h2:text-is('Peak forces')) tbody tr").all_inner_texts()
    assert [int(line.split()[0]) for line in cells] == contact
    # 9 digits are shown.
    assert [float(line.split()[1]) for line in cells] == pytest.approx(
        compared.native.peak_force, rel=5e-9, abs=0
    )
    assert page.locator("#numbers").text_content() is not None
    with page.expect_download() as download:
        page.get_by_text("Save all numbers as JSON").click()
    assert download.value.suggested_filename == "compare.json"
    saved = json.loads(Path(download.value.path()).read_text("utf-8"))
    assert saved == json.loads(json.dumps(compared.to_dict()))
    assert wrong == []


def test_a_phone_scrolls_down_only_and_paper_has_everything(opened: tuple[Page, list[str]]) -> None:
    page, wrong = opened
    page.set_viewport_size({"width": 360, "height": 740})
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 360
    page.set_viewport_size({"width": 1280, "height": 900})
    assert wrong == []
    page, wrong = opened
    page.emulate_media(media="print")
    assert page.locator(".plot:visible").count() == 1
    hidden = page.evaluate(
        "[...document.querySelectorAll('.scroll')]"
        ".filter(b => getComputedStyle(b).overflowY !== 'visible').length"
    )
    assert hidden == 0
    page.emulate_media(media="screen")
    pdf = page.pdf(prefer_css_page_size=True)
    assert 2 <= len(re.findall(rb"/Type /Page\b", pdf)) <= 8
    assert wrong == []
