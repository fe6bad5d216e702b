"""The editor in a real browser: a driveline from nothing by keys and clicks, errors at fields, undo, fifty bodies."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

import gearrattle as gr
from gearrattle.model.components import COMPONENTS
from gearrattle.workbench.table_templates import TABLES, shelf
from tests.browser import MARKS
from tests.workbench.page import boxes_of, fill, middle_of, name_it, opened_page, selected, text_of, waits
from tests.workbench.server import Server

pytest.importorskip("uvicorn")
playwright = pytest.importorskip("playwright.sync_api")
pytestmark = MARKS


@pytest.fixture
def server(empty_server: Server) -> Server:
    return empty_server


@pytest.fixture
def tab(server: Server) -> Iterator[Any]:
    """The Edit view with an empty sheet."""
    with opened_page(server) as page:
        page.wait_for_selector(".ed-start")
        yield page


def opened(tab: Any, name: str) -> None:
    tab.get_by_role("button", name="Open …", exact=True).click()
    tab.locator("dialog li button").filter(has=tab.locator(f"small:text-is('{name}')")).click()
    playwright.expect(tab.locator("dialog")).to_have_count(0)
    playwright.expect(tab.locator(".ed-state.ready")).to_be_visible()


def test_a_driveline_of_four_bodies_from_nothing_by_keys_and_clicks(tab: Any, server: Server) -> None:
    tab.get_by_role("button", name="Add an inertia").click()
    name_it(tab, "inertia", "flywheel")
    fill(tab, "J *", "0.3 kg*m^2")
    for key, new, old, name in (("n", "Coupling", "coupling", "damper"), ("n", "Coupling", "coupling", "spline")):
        last = tomllib.loads(text_of(tab)).get("inertia", [])
        selected(tab, f"inertia.{len(last) - 1}")
        tab.keyboard.press(key)
        tab.get_by_role("dialog").get_by_role("button", name=new).click()
        name_it(tab, old, name)
    selected(tab, "inertia.2")
    tab.keyboard.press("n")
    tab.get_by_role("dialog").get_by_role("button", name="Mesh").click()
    name_it(tab, "mesh", "gear")
    for number, name in ((1, "hub"), (2, "input_gear"), (3, "output_gear")):
        selected(tab, f"inertia.{number}")
        tab.keyboard.press("F2")
        old = tomllib.loads(text_of(tab))["inertia"][number]["name"]
        name_it(tab, old, name)
    selected(tab, "inertia.0")
    tab.get_by_role("toolbar", name="Add").get_by_role("button", name="Torque").click()
    waits(tab, "text.includes('[[torque]]')")
    playwright.expect(tab.locator(".ed-state.ready")).to_be_visible()
    model = gr.loads(text_of(tab))
    assert [body.name for body in model.inertias] == ["flywheel", "hub", "input_gear", "output_gear"]
    assert [element.between for element in model.elements] == [
        ("flywheel", "hub"),
        ("hub", "input_gear"),
        ("input_gear", "output_gear"),
    ]
    assert model.torques[0].on == "flywheel"
    tab.get_by_role("button", name="Run", exact=True).click()
    tab.wait_for_url("**/#/runs/*")
    job = server.ended(tab.url.rpartition("/")[2])
    assert job["state"] == "done"
    tab.wait_for_selector(".gr-headline", timeout=60_000)


def test_a_connection_is_drawn_by_the_pointer_and_by_keys(tab: Any) -> None:
    opened(tab, "case3")
    selected(tab, "inertia.0")
    bodies = [tab.locator(f'[data-key="inertia.{k}"] .gr-disc').first for k in (0, 2)]
    first, second, handle = boxes_of(*bodies, tab.locator('[data-handle="0"] circle').first)
    tab.mouse.move(*middle_of(handle))
    tab.mouse.down()
    tab.mouse.move(*middle_of(second), steps=6)
    tab.mouse.up()
    tab.get_by_role("dialog").get_by_role("button", name="Coupling").click()
    waits(tab, 'text.includes(\'between = ["flywheel", "input_gear"]\')')
    tab.wait_for_function("() => document.activeElement.value === 'coupling'")
    selected(tab, "inertia.1")
    tab.keyboard.press("c")
    tab.keyboard.press("g")
    playwright.expect(tab.get_by_role("dialog").get_by_role("button", name="Coupling")).to_be_focused()
    playwright.expect(tab.get_by_role("dialog").get_by_role("button", name="Mesh")).to_have_count(0)
    tab.keyboard.press("Enter")
    waits(tab, 'text.includes(\'between = ["hub", "ground"]\')')
    assert first["x"] < second["x"]


def test_a_wrong_unit_is_refused_at_its_field_in_the_words_of_the_command_line(tab: Any) -> None:
    opened(tab, "case3")
    selected(tab, "mesh.0")
    field = tab.locator(".ed-form").get_by_label("backlash", exact=True)
    field.fill("0.1 kg")
    field.press("Enter")
    wrong = tab.locator(".field.wrong")
    with pytest.raises(gr.ModelError) as caught:
        gr.example("case3").with_({"mesh.gear.backlash": "0.1 kg"})
    playwright.expect(wrong.locator(".field-problems")).to_contain_text(caught.value.problems[0].rule)
    playwright.expect(field).to_have_attribute("aria-invalid", "true")
    playwright.expect(tab.get_by_role("button", name="Run", exact=True)).to_be_disabled()
    assert tab.locator(".toml-line.wrong").inner_text().startswith("backlash")
    assert "1 problem" in tab.locator('[data-key="mesh.0"]').first.get_attribute("aria-description")
    tab.keyboard.press("Control+z")
    playwright.expect(wrong).to_have_count(0)
    playwright.expect(tab.locator(".ed-state.ready")).to_be_visible()


def focused(tab: Any, key: str) -> None:
    """Wait until a mark of the drawing has the focus."""
    tab.wait_for_function(f"() => document.activeElement.dataset.key === '{key}'")


def test_enter_and_escape_return_from_a_field_to_the_drawing(tab: Any) -> None:
    opened(tab, "case3")
    selected(tab, "mesh.0")
    field = tab.locator(".ed-form").get_by_label("backlash", exact=True)
    before = field.input_value()
    field.fill("0.07 mm")
    field.press("Enter")
    focused(tab, "mesh.0")
    waits(tab, "text.includes('0.07 mm')")
    field.fill("0.09 mm")
    field.press("Escape")
    focused(tab, "mesh.0")
    playwright.expect(field).to_have_value("0.07 mm")
    field.fill("0.1 kg")
    field.press("Enter")
    playwright.expect(tab.locator(".field.wrong")).to_have_count(1)
    playwright.expect(field).to_be_focused()  # what is wrong stays under the hand
    field.press("Escape")
    focused(tab, "mesh.0")
    tab.keyboard.press("ArrowLeft")
    tab.keyboard.press("F2")
    tab.wait_for_function("() => document.activeElement.id.endsWith('-name')")
    assert before != "0.07 mm"
    assert "0.09 mm" not in text_of(tab)


def test_means_that_do_not_balance_are_said_as_on_the_command_line(tab: Any) -> None:
    model = gr.example("case3").with_({"torque.0.mean": 20.6})
    (note,) = gr.equilibrium(model).notes
    assert "N m are left over" in note
    tab.locator(".toml-area").fill(model.to_toml())
    playwright.expect(tab.get_by_role("list", name="Notes")).to_have_text(note)
    playwright.expect(tab.locator(".ed-state.ready")).to_have_text("✓ ready with 1 note")
    opened(tab, "case1")
    playwright.expect(tab.get_by_role("list", name="Notes")).to_have_count(0)
    playwright.expect(tab.locator(".ed-state.ready")).to_have_text("✓ ready to run")


def test_the_verdict_follows_a_change_and_colours_the_drawing(tab: Any) -> None:
    opened(tab, "case3")
    verdict = tab.locator(".ed-verdict:not(.stale)")
    playwright.expect(verdict).to_contain_text("rattle", timeout=60_000)  # the first answer waits for its process
    rattling = tab.locator(".gr-link:is(.gr-single-sided, .gr-double-sided)")
    selected(tab, "mesh.0")
    for value in ("0.12 mm", "0.08 mm"):
        with tab.expect_response("**/api/live") as answer:
            fill(tab, "backlash", value)
        text = answer.value.request.post_data_json["text"]
        assert tomllib.loads(text)["mesh"][0]["backlash"] == value
        shown = answer.value.json()["verdict"]
        playwright.expect(verdict).to_contain_text(shown["headline"])
        playwright.expect(rattling).to_have_count(sum(part["rattles"] for part in shown["parts"]))
    staged = [part for part in shown["parts"] if not part["gap"] and part["regime"] != "quiet"]
    assert staged
    playwright.expect(tab.locator(".gr-regime", has_text="changes stage")).to_have_count(len(staged))


def test_undo_and_redo_give_the_texts_back_letter_by_letter(tab: Any) -> None:
    opened(tab, "clutch_friction")
    texts = [text_of(tab)]
    for act in (
        lambda: (selected(tab, "inertia.1"), tab.keyboard.press("Delete")),
        lambda: (selected(tab, "mesh.0"), fill(tab, "backlash", "0.2 mm")),
        lambda: tab.get_by_role("toolbar", name="Add").get_by_role("button", name="Planetary set").click(),
    ):
        act()
        tab.wait_for_function("before => document.querySelector('.toml-area').value !== before", arg=texts[-1])
        texts.append(text_of(tab))
        if len(texts) == 2:
            playwright.expect(tab.locator(".ed-note")).to_contain_text(
                "coupling damper and coupling spline went with hub"
            )
    for expected in reversed(texts[:-1]):
        tab.get_by_role("button", name="Undo").click()
        waits(tab, f"text === {_js(expected)}")
    for expected in texts[1:]:
        tab.get_by_role("button", name="Redo").click()
        waits(tab, f"text === {_js(expected)}")


def _js(text: str) -> str:
    import json

    return json.dumps(text)


def test_the_text_changes_the_drawing_and_the_form(tab: Any) -> None:
    opened(tab, "case3")
    area = tab.locator(".toml-area")
    area.fill(text_of(tab).replace('"input_gear"', '"shaft"'))
    playwright.expect(tab.locator('[data-key="inertia.2"] .gr-name')).to_have_text("shaft")
    area.fill(text_of(tab) + "\n[[mesh\n")
    playwright.expect(tab.locator(".ed-problems li")).to_have_count(1)
    playwright.expect(tab.locator(".gr-node")).to_have_count(4)


@pytest.mark.parametrize("table", [table for table in TABLES if table not in ("excitation", "simulation", "criteria")])
def test_everything_on_the_shelf_can_be_added_and_has_a_form(tab: Any, table: str) -> None:
    entry = next(entry for entry in shelf() if entry["table"] == table)
    button = tab.get_by_role("toolbar", name="Add").get_by_role("button", name=entry["title"], exact=True)
    assert button.locator("path").get_attribute("d").endswith(entry["symbol"])
    if table == "motion":  # one body must stay free
        tab.get_by_role("toolbar", name="Add").get_by_role("button", name="Coupling").click()
        waits(tab, "text.includes('[[coupling]]')")
    button.click()
    waits(tab, f"text.includes('[[{table}]]')")
    if table == "bearing":  # its body must have a mass
        with_mass = text_of(tab).replace("[[inertia]]\n", "[[inertia]]\nmass = 0.5\n", 1)
        tab.locator(".toml-area").fill(with_mass)
        selected(tab, "bearing.0")
    playwright.expect(tab.locator(".ed-state.ready")).to_be_visible()
    for key in entry["template"]:
        assert tab.locator(f'[id^="field-{table}-0-{key}"]').count() >= 1, key
    model = gr.loads(text_of(tab))
    if table in COMPONENTS:
        assert len(model.components) == 1
        drawn = 1 if table == "bearing" else len(model.elements)
        assert tab.locator(".gr-link:not(.gr-unsound)").count() == drawn


def test_a_model_is_saved_and_opened_again_and_a_draft_survives_a_reload(tab: Any, server: Server) -> None:
    opened(tab, "case2")
    text = text_of(tab)
    tab.get_by_role("button", name="Save as …").click()
    tab.get_by_role("dialog").get_by_label("File in this folder").fill("second.toml")
    tab.keyboard.press("Enter")
    playwright.expect(tab.locator(".ed-note")).to_contain_text("Saved second.toml")
    assert server.client.get("/api/files/second.toml").text == text
    selected(tab, "mesh.0")
    fill(tab, "backlash", "0.07 mm")
    tab.wait_for_function("""() => localStorage.getItem("gearrattle.draft")?.includes("0.07 mm")""")
    tab.reload()
    tab.wait_for_selector(".gr-node")
    assert '"0.07 mm"' in text_of(tab)


def saved_as(tab: Any, name: str) -> None:
    tab.get_by_role("button", name="Save as …").click()
    tab.get_by_role("dialog").get_by_label("File in this folder").fill(name)
    tab.keyboard.press("Enter")


def test_a_file_that_another_program_changed_is_not_lost(tab: Any, server: Server) -> None:
    opened(tab, "case1")
    saved_as(tab, "shared.toml")
    playwright.expect(tab.locator(".ed-note")).to_contain_text("Saved shared.toml")
    selected(tab, "mesh.0")
    fill(tab, "backlash", "0.07 mm")
    tab.keyboard.press("Control+s")
    playwright.expect(tab.locator(".ed-note")).to_contain_text("Saved shared.toml")
    assert '"0.07 mm"' in server.client.get("/api/files/shared.toml").text
    server.client.put("/api/files/shared.toml", content="schema = 1  # of another program")
    fill(tab, "backlash", "0.08 mm")
    tab.keyboard.press("Control+s")
    question = tab.get_by_role("dialog")
    playwright.expect(question).to_contain_text("shared.toml was changed by another program since it was read")
    question.get_by_role("button", name="Save under another name …").click()
    playwright.expect(question.get_by_label("File in this folder")).to_be_visible()
    question.get_by_label("File in this folder").fill("own.toml")
    tab.keyboard.press("Enter")
    playwright.expect(tab.locator(".ed-note")).to_contain_text("Saved own.toml")
    assert server.client.get("/api/files/shared.toml").text == "schema = 1  # of another program"
    assert '"0.08 mm"' in server.client.get("/api/files/own.toml").text
    saved_as(tab, "shared.toml")
    playwright.expect(question).to_contain_text("shared.toml was changed by another program")
    question.get_by_role("button", name="Overwrite").click()
    playwright.expect(tab.locator(".ed-note")).to_contain_text("Saved shared.toml")
    assert '"0.08 mm"' in server.client.get("/api/files/shared.toml").text


def test_a_file_that_this_tab_has_not_read_is_not_written_over(tab: Any, server: Server) -> None:
    server.client.put("/api/files/there.toml", content="schema = 1")
    opened(tab, "case1")
    saved_as(tab, "there.toml")
    question = tab.get_by_role("dialog")
    playwright.expect(question).to_contain_text("there.toml exists already")
    question.get_by_role("button", name="Cancel").click()
    assert server.client.get("/api/files/there.toml").text == "schema = 1"


def test_a_body_stays_under_the_pointer_while_the_window_and_the_model_change(tab: Any) -> None:
    opened(tab, "case3")
    disc = tab.locator('[data-key="inertia.1"] .gr-disc').first
    ((across, down),) = map(middle_of, boxes_of(disc))
    tab.mouse.move(across, down)
    tab.mouse.down()
    tab.mouse.move(across + 10, down + 20, steps=4)
    tab.locator(".toml-area").evaluate(
        """(area) => {
          area.value = area.value.replace('hub', 'plate').replaceAll('"hub"', '"plate"');
          area.dispatchEvent(new Event("input", { bubbles: true }));
        }"""
    )
    tab.locator(".gr-driveline").evaluate("(frame) => { frame.style.height = '300px'; }")
    tab.wait_for_timeout(3000)
    tab.mouse.move(across + 20, down + 40, steps=4)
    assert middle_of(*boxes_of(disc)) == pytest.approx((across + 20, down + 40), abs=4)
    playwright.expect(tab.locator('[data-key="inertia.1"]')).not_to_contain_text("plate")
    tab.mouse.up()
    playwright.expect(tab.locator('[data-key="inertia.1"]')).to_contain_text("plate")


def test_a_body_of_fifty_is_dragged_and_stays_over_a_reload(tab: Any) -> None:
    bodies = "".join(f'[[inertia]]\nname = "b{k}"\nJ = 0.01\n\n' for k in range(50))
    links = "".join(
        f'[[coupling]]\nname = "c{k}"\nbetween = ["b{k}", "b{k + 1}"]\nstiffness = 100\nclearance = 0.01\n\n'
        for k in range(49)
    )
    tab.locator(".toml-area").fill(f'schema = 1\n\n{bodies}{links}[excitation]\nspeed = "800 rpm"\n')
    playwright.expect(tab.locator(".gr-node")).to_have_count(50)
    discs = [tab.locator(f'[data-key="inertia.{number}"] .gr-disc') for number in (25, 24)]
    box, neighbour = boxes_of(*discs)
    first = (box["x"] - neighbour["x"], box["y"] - neighbour["y"])
    across, down = middle_of(box)
    tab.mouse.move(across, down)
    tab.mouse.down()
    tab.mouse.move(across + 40, down + 30, steps=20)
    tab.mouse.up()
    box, neighbour = boxes_of(*discs)
    assert box["x"] - neighbour["x"] - first[0] == pytest.approx(40, abs=4)
    assert box["y"] - neighbour["y"] - first[1] == pytest.approx(30, abs=4)
    tab.wait_for_function("() => 'b25' in JSON.parse(localStorage.getItem('gearrattle.draft')).positions")
    stored_position = "() => JSON.parse(localStorage.getItem('gearrattle.draft')).positions.b25"
    kept = tab.evaluate(stored_position)
    tab.reload()
    playwright.expect(tab.locator(".gr-node")).to_have_count(50)
    assert tab.evaluate(stored_position) == kept
    box, neighbour = boxes_of(*discs)
    ratio = (box["y"] - neighbour["y"]) / (box["x"] - neighbour["x"])
    assert ratio == pytest.approx((first[1] + 30) / (first[0] + 40), abs=0.1)  # it may be drawn at another scale
